// SPDX-FileCopyrightText: 2026 linkage_ros contributors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

namespace transmission_interface
{
/// The handles with a value of such names and an interface, in the order of the names.
template <class T>
std::vector<T> get_ordered_handles(
  const std::vector<T> & unordered_handles, const std::vector<std::string> & names,
  const std::string & interface_type)
{
  std::vector<T> result;
  for (const auto & name : names) {
    for (const auto & handle : unordered_handles) {
      if (handle && handle.get_prefix_name() == name &&
        handle.get_interface_name() == interface_type)
      {
        result.push_back(handle);
      }
    }
  }
  return result;
}
}  // namespace transmission_interface
