// SPDX-FileCopyrightText: 2026 linkage_ros contributors
// SPDX-License-Identifier: Apache-2.0

// Written by linkage_ros.
#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <memory>
#include <sstream>  // for accessor.hpp of Humble
#include <string>
#include <vector>

@includes@
#include "hardware_interface/hardware_info.hpp"
#include "pluginlib/class_list_macros.hpp"
#include "transmission_interface/accessor.hpp"
#include "transmission_interface/exception.hpp"
#include "transmission_interface/handle.hpp"
#include "transmission_interface/transmission_loader.hpp"

namespace @namespace@
{
using transmission_interface::ActuatorHandle;
using transmission_interface::JointHandle;

/// The name of an actuator or a joint in the scene, and its role in the linkage.
struct Axis { const char * name, * role; };

/// A linkage in C, with its axes: the commanded joints come before the passive ones.
struct Linkage
{
  const lkr_model & model;
  std::vector<Axis> actuators, joints;
};

/// The quantities: their interfaces, and their values.
const char * const interfaces[] = {"position", "velocity", "effort"};
using Values = lkr_real[LKR_MAX_JOINTS];
Values lkr_side::* const quantities[] = {
  &lkr_side::position, &lkr_side::velocity, &lkr_side::effort};

/// A handle for one quantity of an axis, whose value is factor * that of the scene + offset.
template <class Handle>
struct Channel
{
  Handle handle;
  Values lkr_side::* quantity;
  std::size_t axis;
  double factor, offset;
};

inline void require(bool holds, const std::string & what)
{
  if (!holds) {
    throw transmission_interface::Exception(what);
  }
}

/// The handles of all actuators, or of all joints; those of the first `needed` have to be there.
template <class Handle>
struct Handles
{
  std::vector<Channel<Handle>> channels;
  /// The number of needed handles for each quantity.
  std::array<std::size_t, 3> count{};

  Handles() = default;

  /// Find them by role or name; `what` they are is "actuator" or "joint".
  template <class Info>
  Handles(
    const std::string & what, const std::vector<Axis> & axes, std::size_t needed,
    const std::vector<Info> & infos, const std::vector<Handle> & given)
  {
    std::string allowed;
    for (std::size_t i = 0; i < needed; ++i) {
      allowed += std::string(" '") + axes[i].name + "' (role '" + axes[i].role + "')";
    }
    // What this robot says of each axis.
    std::vector<Info> owns(axes.size());
    for (const auto & info : infos) {
      // ros2_control adds an actuator to hardware of type "actuator".
      if (info.name == "actuator1" && info.role == "actuator1") {
        continue;
      }
      const auto i = static_cast<std::size_t>(
        std::find_if(axes.begin(), axes.end(), [&info](const Axis & axis) {
          return info.role.empty() ? info.name == axis.name : info.role == axis.role;
        }) - axes.begin());
      const std::string named = what + " '" + info.name + "'";
      require(i < axes.size() && owns[i].name.empty(),
        named + ", role '" + info.role + "', is none of" + allowed);
      require(std::isfinite(info.offset) && std::isnormal(info.mechanical_reduction),
        named + " needs a finite offset, and a finite mechanical_reduction other than 0");
      owns[i] = info;
    }
    for (std::size_t i = 0; i < axes.size(); ++i) {
      require(i >= needed || !owns[i].name.empty(),
        what + " '" + axes[i].name + "' is missing; needed are" + allowed);
      const std::string name = owns[i].name.empty() ? axes[i].name : owns[i].name;
      // A reduction is that of the built-in transmissions: from the joint to the actuator.
      const double reduction = owns[i].mechanical_reduction;
      const double factor = what == "actuator" ? reduction : 1.0 / reduction;
      const double factors[] = {factor, factor, 1.0 / factor};
      const double offsets[] = {owns[i].offset, 0.0, 0.0};
      for (std::size_t kind = 0; kind < 3; ++kind) {
        const auto found =
          transmission_interface::get_ordered_handles(given, {name}, interfaces[kind]);
        require(found.size() <= 1,
          what + " '" + name + "' has several handles for " + interfaces[kind]);
        for (const auto & handle : found) {
          channels.push_back({handle, quantities[kind], i, factors[kind], offsets[kind]});
          count[kind] += i < needed;
        }
      }
    }
  }
};

/// A linkage between actuators and joints.
class Transmission : public transmission_interface::Transmission
{
public:
  Transmission(const Linkage & linkage, const hardware_interface::TransmissionInfo & info)
  : linkage_(linkage), info_(info) {}

  /// Find handles by role or name; throws an exception that says what is wrong.
  void configure(
    const std::vector<JointHandle> & joint_handles,
    const std::vector<ActuatorHandle> & actuator_handles) override
  {
    const std::string start = "transmission '" + info_.name + "': ";
    require(info_.parameters.empty(),
      start + "it has no parameters: write the package again for other lengths");
    const std::size_t n = num_joints();
    actuators_ = {"actuator", linkage_.actuators, n, info_.actuators, actuator_handles};
    joints_ = {"joint", linkage_.joints, n, info_.joints, joint_handles};
    status_ = transmission_interface::get_ordered_handles(joint_handles, {info_.name}, "status");
    for (std::size_t kind = 0; kind < 3; ++kind) {
      const auto count = actuators_.count[kind] + joints_.count[kind];
      require(count == 2 * n || (count == 0 && kind > 0),
        start + "all its actuators and joints need a handle for " + interfaces[kind] +
        (kind ? ", or none of them" : ": velocities and efforts depend on the pose"));
    }
    lkr_begin(&linkage_.model, &memory_);
  }

  void actuator_to_joint() override { transmit(LKR_ACTUATORS, actuators_, joints_); }

  void joint_to_actuator() override { transmit(LKR_JOINTS, joints_, actuators_); }

  std::size_t num_actuators() const override { return linkage_.actuators.size(); }

  std::size_t num_joints() const override { return linkage_.actuators.size(); }

private:
  /// From the handles of one side to those of the other.
  template <class From, class To>
  void transmit(int side, const From & from, To & to)
  {
    // What has no handle is 0; what is not set is not written.
    lkr_side values{}, result;
    for (const auto & [handle, quantity, axis, factor, offset] : from.channels) {
      (values.*quantity)[axis] = (handle.get_value() - offset) / factor;
    }
    for (const auto quantity : quantities) {
      std::fill_n(result.*quantity, LKR_MAX_JOINTS, LKR_NAN);
    }
    int status = lkr_transmit(&linkage_.model, &memory_, side, &values, &result);
    if (joints_.count[1] + joints_.count[2] == 0) {
      status &= ~LKR_SINGULAR;
    }
    for (auto & [handle, quantity, axis, factor, offset] : to.channels) {
      const double value = factor * (result.*quantity)[axis] + offset;
      if (std::isfinite(value)) {
        (void)handle.set_value(value);
      }
    }
    for (auto & handle : status_) {
      (void)handle.set_value(status);
    }
  }

  const Linkage & linkage_;
  hardware_interface::TransmissionInfo info_;
  lkr_memory memory_{};
  Handles<ActuatorHandle> actuators_;
  Handles<JointHandle> joints_;
  std::vector<JointHandle> status_;
};

template <const Linkage & linkage>
class LoaderOf : public transmission_interface::TransmissionLoader
{
public:
  std::shared_ptr<transmission_interface::Transmission> load(
    const hardware_interface::TransmissionInfo & info) override
  {
    return std::make_shared<Transmission>(linkage, info);
  }
};

@linkages@
}  // namespace @namespace@

@exports@
