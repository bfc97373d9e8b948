// Copyright 2026 linkage_ros contributors
//
// Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
// in compliance with the License. You may obtain a copy of the License at
// http://www.apache.org/licenses/LICENSE-2.0
// Unless required by applicable law or agreed to in writing, software distributed under the
// License is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either
// express or implied. See the License for the specific language governing permissions and
// limitations under the License.
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
