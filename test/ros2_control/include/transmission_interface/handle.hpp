// SPDX-FileCopyrightText: 2026 linkage_ros contributors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <stdexcept>
#include <string>

namespace transmission_interface
{
/// A number of an actuator or a joint; without a place for it, it throws as the real one does.
class Handle
{
public:
  Handle(const std::string & prefix, const std::string & interface, double * value)
  : prefix_(prefix), interface_(interface), value_(value)
  {
  }

  operator bool() const { return value_ != nullptr; }

  const std::string & get_prefix_name() const { return prefix_; }

  const std::string & get_interface_name() const { return interface_; }

  double get_value() const { return place(); }

  void set_value(double value) { place() = value; }

private:
  double & place() const
  {
    if (!value_) {
      throw std::runtime_error("the handle has no value");
    }
    return *value_;
  }

  std::string prefix_, interface_;
  double * value_;
};

struct ActuatorHandle : Handle
{
  using Handle::Handle;
};

struct JointHandle : Handle
{
  using Handle::Handle;
};
}  // namespace transmission_interface
