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
#include <numeric>
#include <sstream>
#include <string>
#include <thread>
#include <type_traits>
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

/// The names that the interface of each quantity may have, the usual one first.
inline const std::array<std::vector<std::string>, 3> interfaces{
  {{"position"}, {"velocity"}, {"effort", "torque", "force"}}};

/// Positions of joints that are not commanded, and their rates by each input, at inputs.
using Passive = void(const double * q, double * position, double (*rate)[LKR_MAX_INPUTS]);

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

/// The handles of all actuators, or of all joints, by interface: position, velocity, effort. The
/// first `needed` of them have to be there.
template <class Handle, std::size_t needed, std::size_t size = needed>
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
    for (std::size_t i = 0; i < needed; ++i) {
      allowed += std::string(" '") + axes[i].name + "' (role '" + axes[i].role + "')";
    }
    std::array<std::string, size> names;
    factor_.fill(1.0);
    for (const auto & info : infos) {
      std::size_t i = place(axes, info.name, info.role);
      if (i == size && is_added(info)) {
        // It is the only actuator, or one beside that of the description.
        if (!names[0].empty()) {
          continue;
        }
        i = 0;
      }
      if (i == size || !names[i].empty()) {
        throw Exception(what + " '" + info.name + "', role '" + info.role + "', is none of" + allowed);
      }
      if (!std::isfinite(info.offset) || !std::isnormal(info.mechanical_reduction)) {
        throw Exception(what + " '" + info.name + "' needs a finite offset, and a finite "
          "mechanical_reduction other than 0");
      }
      names[i] = info.name;
      // A reduction is that of the built-in transmissions: from the joint to the actuator.
      offset_[i] = info.offset;
      factor_[i] = is_actuator ? info.mechanical_reduction : 1.0 / info.mechanical_reduction;
    }
    for (std::size_t i = 0; i < size; ++i) {
      if (names[i].empty() && i < needed) {
        throw Exception(what + " '" + axes[i].name + "' is missing; needed are" + allowed);
      }
      if (names[i].empty()) {
        names[i] = axes[i].name;
      }
      for (std::size_t kind = 0; kind < interfaces.size(); ++kind) {
        auto & own = handles_[kind][i];
        for (const auto & interface : interfaces[kind]) {
          const auto found =
            transmission_interface::get_ordered_handles(given, {names[i]}, interface);
          own.insert(own.end(), found.begin(), found.end());
        }
        if (own.size() > 1) {
          throw Exception(what + " '" + names[i] + "' has several handles for " +
            interfaces[kind][0]);
        }
      }
    }
  }

  /// The number of handles for an interface.
  std::size_t count(std::size_t kind) const
  {
    const auto & own = handles_[kind];
    return static_cast<std::size_t>(std::count_if(
      own.begin(), own.begin() + needed, [](const auto & handles) { return !handles.empty(); }));
  }

  bool have(std::size_t kind) const { return !handles_[kind][0].empty(); }

  /// Read values as the scene has them; those without a handle are 0.
  lkr_side read() const
  {
    lkr_side values{};
    for (std::size_t i = 0; i < needed; ++i) {
      values.position[i] = (value(0, i) - offset_[i]) / factor_[i];
      values.velocity[i] = value(1, i) / factor_[i];
      values.effort[i] = value(2, i) * factor_[i];
    }
    return values;
  }

  /// Write what is finite.
  void write(const lkr_side & values)
  {
    for (std::size_t i = 0; i < needed; ++i) {
      write(i, values.position[i], values.velocity[i]);
      set(2, i, values.effort[i] / factor_[i]);
    }
  }

  void write(std::size_t i, double position, double velocity)
  {
    set(0, i, position * factor_[i] + offset_[i]);
    set(1, i, velocity * factor_[i]);
  }

private:
  static constexpr bool is_actuator =
    std::is_same_v<Handle, transmission_interface::ActuatorHandle>;

  double value(std::size_t kind, std::size_t i) const
  {
    return have(kind) ? handles_[kind][i].front().get_value() : 0.0;
  }

  void set(std::size_t kind, std::size_t i, double value)
  {
    if (!handles_[kind][i].empty() && std::isfinite(value)) {
      (void)handles_[kind][i].front().set_value(value);
    }
  }

  /// The place of a role; of a name, if there is no role.
  static std::size_t place(
    const std::array<Axis, size> & axes, const std::string & name, const std::string & role)
  {
    for (std::size_t i = 0; i < size; ++i) {
      if (role.empty() ? name == axes[i].name : role == axes[i].role) {
        return i;
      }
    }
    return size;
  }

  /// Whether ros2_control has added an actuator, which it does to hardware of type "actuator".
  template <class Info>
  static bool is_added(const Info & info)
  {
    return size == 1 && is_actuator && info.name == "actuator1" && info.role == "actuator1";
  }

  // Of each quantity and axis one handle, or none.
  std::array<std::array<std::vector<Handle>, size>, 3> handles_;
  std::array<double, size> offset_{}, factor_{};
};

/// A linkage between actuators and joints; Code wraps its generated C, which is included before.
template <class Code>
class TransmissionOf : public linkage_ros::LinkageTransmission
{
public:
  static constexpr std::size_t passive_count = Code::joints.size() - Code::size;

  explicit TransmissionOf(const hardware_interface::TransmissionInfo & info)
  : info_(info), log_(info.name)
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
    actuators_ = {};
    joints_ = {};
    actuators_.find("actuator", Code::actuators, info_.actuators, actuator_handles);
    joints_.find("joint", Code::joints, info_.joints, joint_handles);
    for (std::size_t kind = 0; kind < interfaces.size(); ++kind) {
      const auto count = actuators_.count(kind) + joints_.count(kind);
      if (count != 2 * Code::size && (count != 0 || kind == 0)) {
        refuse("all its actuators and joints need a handle for " + interfaces[kind][0] +
          (kind ? ", or none of them" : ": velocities and efforts depend on the pose"));
      }
    }
    lkr_begin(&Code::model, &memory_);
  }

  void actuator_to_joint() override
  {
    transmit(LKR_ACTUATORS, actuators_, joints_);
    if constexpr (passive_count > 0) {
      write_passive();
    }
  }

  void joint_to_actuator() override { transmit(LKR_JOINTS, joints_, actuators_); }

  std::size_t num_actuators() const override { return Code::size; }

  std::size_t num_joints() const override { return Code::size; }

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
    for (auto kind : {result.position, result.velocity, result.effort}) {
      // What is not set is not written.
      std::fill_n(kind, LKR_MAX_INPUTS, LKR_NAN);
    }
    status_ = lkr_transmit(&Code::model, &memory_, side, &values, &result);
    if (!joints_.have(1) && !joints_.have(2)) {
      status_ &= ~SINGULAR;
    }
    log_.note(status_, side == LKR_JOINTS);
    to.write(result);
  }

  /// Write states of the joints that are not commanded: where the newest measurement is, or standing.
  void write_passive()
  {
    double position[passive_count], rate[passive_count][LKR_MAX_INPUTS];
    Code::at_passive(memory_.q, position, rate);
    for (std::size_t i = 0; i < passive_count; ++i) {
      const double velocity = std::inner_product(
        rate[i], rate[i] + Code::size, memory_.speed, 0.0);
      joints_.write(
        Code::size + i, memory_.newest == LKR_ACTUATORS ? position[i] : LKR_NAN,
        std::isfinite(velocity) ? velocity : 0.0);
    }
  }

  hardware_interface::TransmissionInfo info_;
  lkr_memory memory_{};
  Handles<transmission_interface::ActuatorHandle, Code::size> actuators_;
  Handles<transmission_interface::JointHandle, Code::size, Code::joints.size()> joints_;
  int status_ = OK;
  HeldLog log_;
};

template <class Code>
class LoaderOf : public transmission_interface::TransmissionLoader
{
public:
  std::shared_ptr<transmission_interface::Transmission> load(
    const hardware_interface::TransmissionInfo & info) override
  {
    return std::make_shared<TransmissionOf<Code>>(info);
  }
};
}  // namespace @namespace@
