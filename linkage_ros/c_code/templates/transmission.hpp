// SPDX-FileCopyrightText: 2026 linkage_ros contributors
// SPDX-License-Identifier: Apache-2.0

// Written by linkage_ros.
#pragma once

#include <algorithm>
#include <array>
#include <atomic>
#include <chrono>
#include <cmath>
#include <cstddef>
#include <future>
#include <memory>
#include <string>
#include <thread>
#include <vector>

#include "hardware_interface/hardware_info.hpp"
#include "linkage_ros/linkage_transmission.hpp"
#include "rcutils/logging_macros.h"
#include "transmission_interface/accessor.hpp"
#include "transmission_interface/exception.hpp"
#include "transmission_interface/handle.hpp"
#include "transmission_interface/transmission_loader.hpp"

namespace @namespace@
{
/// The name of an actuator or a joint in the scene, and its role in the linkage.
struct Axis { const char * name, * role; };

/// A linkage in C, with its axes: the commanded joints come before the passive ones.
struct Linkage
{
  const lkr_model & model;
  std::vector<Axis> actuators, joints;
};

/// The names that the interface of each quantity may have, the usual one first.
inline const std::array<std::vector<std::string>, 3> interfaces{
  {{"position"}, {"velocity"}, {"effort", "torque", "force"}}};

/// The values of each quantity.
inline std::array<lkr_real *, 3> quantities(lkr_side & side)
{
  return {side.position, side.velocity, side.effort};
}

/// Logs why values are held, from a thread of its own: a control loop only sets bits.
class HeldLog
{
public:
  explicit HeldLog(const std::string & name) : thread_(&HeldLog::run, this, name) {}

  ~HeldLog()
  {
    over_.set_value();
    thread_.join();
  }

  /// Note the status of a command, or of a measurement; neither allocates, locks nor waits.
  void note(int status, bool is_command)
  {
    // A value that is not commanded is not held.
    seen_ |= is_command ? status & ~linkage_ros::LinkageTransmission::NOT_KNOWN : status << 3;
  }

private:
  void run(const std::string & name)
  {
    static const std::array<const char *, 6> reasons{
      "a command is out of reach or out of the sweep: the actuators hold their positions",
      "a command at a singular pose: velocities are 0 or efforts are held", "",
      "actuators are measured where the linkage cannot be: the joints' positions are held",
      "measured at a singular pose: velocities are 0 or efforts are held",
      "a measured value is not finite: the joints' values are held"};
    const auto over = over_.get_future();
    bool is_over = false;
    for (int before = 0; !is_over;) {
      is_over = over.wait_for(std::chrono::seconds(1)) == std::future_status::ready;
      const int now = seen_.exchange(0);
      for (std::size_t i = 0; i < reasons.size(); ++i) {
        // A reason that goes on is logged once.
        if (now & ~before & 1 << i) {
          RCUTILS_LOG_WARN_NAMED("linkage_transmission", "%s: %s", name.c_str(), reasons[i]);
        }
      }
      before = now;
    }
  }

  std::atomic<int> seen_{0};
  std::promise<void> over_;
  // The last: it uses the others.
  std::thread thread_;
};

/// The handles of all actuators, or of all joints; those of the first `needed` have to be there.
template <class Handle>
class Handles
{
public:
  /// The number of needed handles for each quantity.
  std::array<std::size_t, 3> count{};

  Handles() = default;

  /// Find them by role or name; `what` they are is "actuator" or "joint".
  template <class Infos>
  Handles(
    const std::string & what, const std::vector<Axis> & axes, std::size_t needed,
    const Infos & infos, const std::vector<Handle> & given)
  {
    using transmission_interface::Exception;
    const bool is_actuator = what == "actuator";
    std::string allowed;
    for (std::size_t i = 0; i < needed; ++i) {
      allowed += std::string(" '") + axes[i].name + "' (role '" + axes[i].role + "')";
    }
    // What this robot calls each axis, and where it is there: factor * position + offset.
    struct Own { std::string name; double factor = 1.0, offset = 0.0; };
    std::vector<Own> owns(axes.size());
    for (const auto & info : infos) {
      std::size_t i = 0;
      while (i < axes.size() && (info.role.empty() ? info.name != axes[i].name : info.role != axes[i].role)) {
        ++i;
      }
      // To hardware of type "actuator", ros2_control adds an actuator: the only one, or one beside it.
      if (is_actuator && axes.size() == 1 && info.name == "actuator1" && info.role == "actuator1") {
        if (!owns[0].name.empty()) {
          continue;
        }
        i = 0;
      }
      if (i == axes.size() || !owns[i].name.empty()) {
        throw Exception(what + " '" + info.name + "', role '" + info.role + "', is none of" + allowed);
      }
      if (!std::isfinite(info.offset) || !std::isnormal(info.mechanical_reduction)) {
        throw Exception(what + " '" + info.name + "' needs a finite offset, and a finite "
          "mechanical_reduction other than 0");
      }
      // A reduction is that of the built-in transmissions: from the joint to the actuator.
      const double reduction = info.mechanical_reduction;
      owns[i] = {info.name, is_actuator ? reduction : 1.0 / reduction, info.offset};
    }
    for (std::size_t i = 0; i < axes.size(); ++i) {
      if (owns[i].name.empty() && i < needed) {
        throw Exception(what + " '" + axes[i].name + "' is missing; needed are" + allowed);
      }
      const std::string name = owns[i].name.empty() ? axes[i].name : owns[i].name;
      for (std::size_t kind = 0; kind < interfaces.size(); ++kind) {
        std::vector<Handle> found;
        for (const auto & interface : interfaces[kind]) {
          const auto handles = transmission_interface::get_ordered_handles(given, {name}, interface);
          found.insert(found.end(), handles.begin(), handles.end());
        }
        if (found.size() > 1) {
          throw Exception(what + " '" + name + "' has several handles for " + interfaces[kind][0]);
        }
        const double factor = kind == 2 ? 1.0 / owns[i].factor : owns[i].factor;
        for (const auto & handle : found) {
          channels_.push_back({handle, kind, i, factor, kind == 0 ? owns[i].offset : 0.0});
          count[kind] += i < needed;
        }
      }
    }
  }

  /// Read values; those without a handle are 0.
  lkr_side read() const
  {
    lkr_side values{};
    for (const auto & channel : channels_) {
      quantities(values)[channel.kind][channel.axis] =
        (channel.handle.get_value() - channel.offset) / channel.factor;
    }
    return values;
  }

  /// Write values, those that are finite.
  void write(lkr_side & values)
  {
    for (auto & channel : channels_) {
      const double value =
        channel.factor * quantities(values)[channel.kind][channel.axis] + channel.offset;
      if (std::isfinite(value)) {
        (void)channel.handle.set_value(value);
      }
    }
  }

private:
  /// A handle for one quantity of an axis, whose value is factor * that of the scene + offset.
  struct Channel
  {
    Handle handle;
    std::size_t kind, axis;
    double factor, offset;
  };

  std::vector<Channel> channels_;
};

/// A linkage between actuators and joints.
class Transmission : public linkage_ros::LinkageTransmission
{
public:
  Transmission(const Linkage & linkage, const hardware_interface::TransmissionInfo & info)
  : linkage_(linkage), info_(info), log_(info.name)
  {
  }

  /// Set parameters and find handles by role or name; throws an exception that says what is wrong.
  void configure(
    const std::vector<transmission_interface::JointHandle> & joint_handles,
    const std::vector<transmission_interface::ActuatorHandle> & actuator_handles) override
  {
    if (!info_.parameters.empty()) {
      refuse("there is no parameter '" + info_.parameters.begin()->first +
        "': write the package again for other lengths");
    }
    actuators_ = {
      "actuator", linkage_.actuators, num_joints(), info_.actuators, actuator_handles};
    joints_ = {"joint", linkage_.joints, num_joints(), info_.joints, joint_handles};
    for (std::size_t kind = 0; kind < interfaces.size(); ++kind) {
      const auto count = actuators_.count[kind] + joints_.count[kind];
      if (count != 2 * num_joints() && (count != 0 || kind == 0)) {
        refuse("all its actuators and joints need a handle for " + interfaces[kind][0] +
          (kind ? ", or none of them" : ": velocities and efforts depend on the pose"));
      }
    }
    lkr_begin(&linkage_.model, &memory_);
  }

  void actuator_to_joint() override { transmit(LKR_ACTUATORS, actuators_, joints_); }

  void joint_to_actuator() override { transmit(LKR_JOINTS, joints_, actuators_); }

  std::size_t num_actuators() const override { return linkage_.actuators.size(); }

  std::size_t num_joints() const override { return linkage_.actuators.size(); }

  int status() const noexcept override { return status_; }

private:
  [[noreturn]] void refuse(const std::string & why) const
  {
    throw transmission_interface::Exception("transmission '" + info_.name + "': " + why);
  }

  /// From the handles of one side to those of the other.
  template <class From, class To>
  void transmit(int side, const From & from, To & to)
  {
    const auto values = from.read();
    lkr_side result;
    for (auto kind : quantities(result)) {
      // What is not set is not written.
      std::fill_n(kind, LKR_MAX_JOINTS, LKR_NAN);
    }
    status_ = lkr_transmit(&linkage_.model, &memory_, side, &values, &result);
    if (joints_.count[1] + joints_.count[2] == 0) {
      status_ &= ~SINGULAR;
    }
    log_.note(status_, side == LKR_JOINTS);
    to.write(result);
  }

  const Linkage & linkage_;
  hardware_interface::TransmissionInfo info_;
  lkr_memory memory_{};
  Handles<transmission_interface::ActuatorHandle> actuators_;
  Handles<transmission_interface::JointHandle> joints_;
  int status_ = OK;
  HeldLog log_;
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
}  // namespace @namespace@
