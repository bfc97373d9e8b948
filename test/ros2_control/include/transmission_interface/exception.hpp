// SPDX-FileCopyrightText: 2026 linkage_ros contributors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <stdexcept>

namespace transmission_interface
{
struct Exception : std::runtime_error
{
  using std::runtime_error::runtime_error;
};
}  // namespace transmission_interface
