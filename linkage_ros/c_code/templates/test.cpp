// SPDX-FileCopyrightText: 2026 linkage_ros contributors
// SPDX-License-Identifier: Apache-2.0

// Written by linkage_ros.
// Positions of the actuators over all their range, to the joints and back.
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <vector>

#include "@name@.hpp"

int main()
{
  const auto & linkage = @namespace@::@name@_linkage;
  const std::size_t n = linkage.actuators.size();
  hardware_interface::TransmissionInfo info;
  std::vector<transmission_interface::JointHandle> joint_handles;
  std::vector<transmission_interface::ActuatorHandle> actuator_handles;
  double actuator[LKR_MAX_INPUTS] = {}, joint[LKR_MAX_INPUTS] = {};
  for (std::size_t i = 0; i < n; ++i) {
    info.actuators.emplace_back();
    info.actuators.back().name = linkage.actuators[i].name;
    info.joints.emplace_back();
    info.joints.back().name = linkage.joints[i].name;
    actuator_handles.emplace_back(linkage.actuators[i].name, "position", &actuator[i]);
    joint_handles.emplace_back(linkage.joints[i].name, "position", &joint[i]);
  }
  @namespace@::Transmission transmission(linkage, info);
  transmission.configure(joint_handles, actuator_handles);

  constexpr double ranges[][2] = @ranges@;
  int tried = 0;
  for (long state = 1; state <= 2000; ++state) {
    lkr_real q[LKR_MAX_INPUTS], x[LKR_MAX_INPUTS], gap[LKR_MAX_INPUTS];
    lkr_point p;
    for (std::size_t i = 0; i < n; ++i) {
      // Multiples of irrational numbers, without their whole parts.
      const double part = static_cast<double>(state) * std::sqrt(1.0 + (i + 1.0) * (i + 1.0));
      q[i] = ranges[i][0] + (ranges[i][1] - ranges[i][0]) * (part - std::floor(part));
    }
    if (!linkage.model.at(q, &p) ||
      !lkr_input_change(&linkage.model, LKR_JOINTS, &p, 1e-3, p.load, x))
    {
      continue;
    }
    std::copy_n(p.position[0], n, actuator);
    transmission.actuator_to_joint();
    transmission.joint_to_actuator();
    if (transmission.status() || !(lkr_gap(&linkage.model, LKR_ACTUATORS, actuator, &p, gap) <= 1e-9)) {
      std::printf("state %ld does not come back\n", state);
      return 1;
    }
    ++tried;
  }
  return tried > 1000 ? 0 : 1;
}
