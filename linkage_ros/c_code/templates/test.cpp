// SPDX-FileCopyrightText: 2026 linkage_ros contributors
// SPDX-License-Identifier: Apache-2.0

// Written by linkage_ros.
// Positions of the actuators over all their range, to the joints and back.
#include <cmath>
#include <cstdio>
#include <vector>

#include "@name@.hpp"

int main()
{
  using Code = @namespace@::@class@Code;
  hardware_interface::TransmissionInfo info;
  std::vector<transmission_interface::JointHandle> joint_handles;
  std::vector<transmission_interface::ActuatorHandle> actuator_handles;
  double actuator[Code::size] = {}, joint[Code::size] = {};
  for (std::size_t i = 0; i < Code::size; ++i) {
    info.actuators.emplace_back();
    info.actuators.back().name = Code::actuators[i].name;
    info.joints.emplace_back();
    info.joints.back().name = Code::joints[i].name;
    actuator_handles.emplace_back(Code::actuators[i].name, "position", &actuator[i]);
    joint_handles.emplace_back(Code::joints[i].name, "position", &joint[i]);
  }
  @namespace@::@class@Transmission transmission(info);
  transmission.configure(joint_handles, actuator_handles);

  constexpr double ranges[Code::size][2] = @ranges@;
  int tried = 0;
  for (long state = 1; state <= 2000; ++state) {
    lkr_real q[Code::size], x[Code::size], gap[Code::size];
    lkr_point p;
    for (std::size_t i = 0; i < Code::size; ++i) {
      // Multiples of irrational numbers, without their whole parts.
      const double x = static_cast<double>(state) * std::sqrt(1.0 + (i + 1.0) * (i + 1.0));
      q[i] = ranges[i][0] + (ranges[i][1] - ranges[i][0]) * (x - std::floor(x));
    }
    if (!Code::model.at(q, &p) ||
      !lkr_input_change(&Code::model, LKR_JOINTS, &p, 1e-3, p.load, x))
    {
      continue;
    }
    for (std::size_t i = 0; i < Code::size; ++i) {
      actuator[i] = p.position[0][i];
    }
    transmission.actuator_to_joint();
    transmission.joint_to_actuator();
    if (transmission.status() || !(lkr_gap(&Code::model, LKR_ACTUATORS, actuator, &p, gap) <= 1e-9)) {
      std::printf("state %ld does not come back\n", state);
      return 1;
    }
    ++tried;
  }
  return tried > 1000 ? 0 : 1;
}
