// Copyright 2026 linkage_ros contributors
//
// Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
// in compliance with the License. You may obtain a copy of the License at
// http://www.apache.org/licenses/LICENSE-2.0
// Unless required by applicable law or agreed to in writing, software distributed under the
// License is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either
// express or implied. See the License for the specific language governing permissions and
// limitations under the License.

// Written by linkage_ros.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <limits>
#include <locale>
#include <optional>
#include <sstream>
#include <string>
#include <vector>

#include "hardware_interface/hardware_info.hpp"
#include "transmission_interface/exception.hpp"
#include "transmission_interface/handle.hpp"
#include "transmission_interface/transmission.hpp"

namespace @namespace@
{
/// The name of an actuator or a joint in the scene, and its role in the linkage.
struct Axis { const char * name, * role; };

/// A dimension [m] that a parameter of the transmission may replace.
struct Dimension { const char * name; double value; };

/// The handles of all actuators, or of all joints, by interface: position, velocity, effort.
template <class Handle, std::size_t size>
class Handles
{
public:
  template <class Infos>
  void find(
    const std::string & what, const std::array<Axis, size> & axes, const Infos & infos,
    const std::vector<Handle> & given)
  {
    using transmission_interface::Exception;
    std::string allowed;
    for (const auto & axis : axes) {
      allowed += std::string(" '") + axis.name + "' (role '" + axis.role + "')";
    }
    std::array<std::string, size> names;
    for (const auto & info : infos) {
      const std::size_t i = place(axes, info.name, info.role);
      if (i == size || !names[i].empty()) {
        throw Exception(what + " '" + info.name + "', role '" + info.role + "', is none of" + allowed);
      }
      if (info.mechanical_reduction != 1.0 || info.offset != 0.0) {
        throw Exception(what + " '" + info.name + "' must have no mechanical_reduction and no offset: "
          "the scene has them");
      }
      names[i] = info.name;
    }
    for (std::size_t i = 0; i < size; ++i) {
      if (names[i].empty()) {
        throw Exception(what + " '" + axes[i].name + "' is missing; needed are" + allowed);
      }
    }
    static const std::array<std::string, 5> kinds{"position", "velocity", "effort", "torque", "force"};
    for (const auto & handle : given) {
      const auto i = static_cast<std::size_t>(
        std::find(names.begin(), names.end(), handle.get_prefix_name()) - names.begin());
      const auto kind = static_cast<std::size_t>(
        std::find(kinds.begin(), kinds.end(), handle.get_interface_name()) - kinds.begin());
      if (i == size) {
        throw Exception("handle '" + handle.get_prefix_name() + "' belongs to no " + what + " of" + allowed);
      }
      if (handle && kind < kinds.size()) {
        handles_[std::min<std::size_t>(kind, 2)][i].emplace(handle);
      }
    }
  }

  /// Whether all of them have an interface.
  bool have(std::size_t kind) const
  {
    const auto & own = handles_[kind];
    return std::all_of(own.begin(), own.end(), [](const auto & handle) { return handle.has_value(); });
  }

  void read(std::size_t kind, double missing, double (&values)[size]) const
  {
    for (std::size_t i = 0; i < size; ++i) {
      values[i] = have(kind) ? handles_[kind][i]->get_value() : missing;
    }
  }

  void write(std::size_t kind, const double (&values)[size])
  {
    for (std::size_t i = 0; i < size; ++i) {
      if (handles_[kind][i] && std::isfinite(values[i])) {
        (void)handles_[kind][i]->set_value(values[i]);
      }
    }
  }

private:
  static std::size_t place(
    const std::array<Axis, size> & axes, const std::string & name, const std::string & role)
  {
    for (const bool by_role : {true, false}) {
      for (std::size_t i = 0; i < size; ++i) {
        if (by_role ? role == axes[i].role : name == axes[i].name) {
          return i;
        }
      }
    }
    return size == 1 ? 0 : size;
  }

  std::array<std::array<std::optional<Handle>, size>, 3> handles_;
};

/// A linkage between actuators and joints; Code wraps its generated C.
template <class Code>
class TransmissionOf : public transmission_interface::Transmission
{
public:
  explicit TransmissionOf(const hardware_interface::TransmissionInfo & info) : info_(info) {}

  /// Set parameters and find handles by role or name; throws an exception that says what is wrong.
  void configure(
    const std::vector<transmission_interface::JointHandle> & joint_handles,
    const std::vector<transmission_interface::ActuatorHandle> & actuator_handles) override
  {
    set_dimensions();
    actuators_ = {};
    joints_ = {};
    actuators_.find("actuator", Code::actuators, info_.actuators, actuator_handles);
    joints_.find("joint", Code::joints, info_.joints, joint_handles);
    const auto both = [this](std::size_t kind) { return actuators_.have(kind) && joints_.have(kind); };
    if (!both(0) && !both(1) && !both(2)) {
      refuse("all actuators and joints need one interface in common: position, velocity or effort");
    }
    if (!actuators_.have(0) && !joints_.have(0)) {
      refuse("velocities and efforts depend on the pose: all actuators, or all joints, need a "
        "position interface");
    }
  }

  void actuator_to_joint() override { transmit(actuators_, joints_, Code::to_joints); }

  void joint_to_actuator() override { transmit(joints_, actuators_, Code::to_actuators); }

  std::size_t num_actuators() const override { return Code::size; }

  std::size_t num_joints() const override { return Code::size; }

  /// The status of the last call: 0, or a sum of the bits in the header.
  int status() const { return status_; }

private:
  void set_dimensions()
  {
    auto left = info_.parameters;
    std::array<double, Code::dimensions.size() + 1> values{};
    std::string allowed = Code::dimensions.size() ? "" : " none";
    for (std::size_t i = 0; i < Code::dimensions.size(); ++i) {
      const std::string name = Code::dimensions[i].name;
      const auto own = left.find(name);
      allowed += " " + name;
      values[i] = Code::dimensions[i].value;
      if (own != left.end()) {
        std::istringstream text(own->second);
        text.imbue(std::locale::classic());
        std::string rest;
        if (!(text >> values[i]) || text >> rest) {
          refuse("parameter " + name + " must be a number [m], not '" + own->second + "'");
        }
        left.erase(own);
      }
    }
    if (!left.empty()) {
      refuse("there is no parameter '" + left.begin()->first + "'; allowed:" + allowed);
    }
    if (const char * wrong = Code::set(linkage_, values.data())) {
      refuse(wrong);
    }
    if (!Code::begin(linkage_, memory_)) {
      refuse("with these dimensions it cannot be assembled");
    }
  }

  [[noreturn]] void refuse(const std::string & why) const
  {
    throw transmission_interface::Exception("transmission '" + info_.name + "': " + why);
  }

  template <class From, class To, class Function>
  void transmit(const From & from, To & to, Function function)
  {
    typename Code::Side given{}, found{};
    from.read(0, std::numeric_limits<double>::quiet_NaN(), given.position);
    from.read(1, 0.0, given.velocity);
    from.read(2, 0.0, given.effort);
    std::fill_n(found.position, Code::size, std::numeric_limits<double>::quiet_NaN());
    status_ = function(linkage_, memory_, given, found);
    const double (*values[3])[Code::size] = {&found.position, &found.velocity, &found.effort};
    for (std::size_t kind = 0; kind < 3; ++kind) {
      if (from.have(kind)) {
        to.write(kind, *values[kind]);
      }
    }
  }

  hardware_interface::TransmissionInfo info_;
  typename Code::Linkage linkage_{};
  typename Code::Memory memory_{};
  Handles<transmission_interface::ActuatorHandle, Code::size> actuators_;
  Handles<transmission_interface::JointHandle, Code::size> joints_;
  int status_ = 0;
};
}  // namespace @namespace@
