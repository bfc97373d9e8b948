// Copyright 2026 linkage_ros contributors
// SPDX-License-Identifier: Apache-2.0
// Configures a slotted lever in the way that is asked for; says why it cannot, or where it is.
#include <cstdio>
#include <cstdlib>
#include <string>
#include <vector>

#include "slotted_lever.hpp"

int main(int argc, char ** argv)
{
  const std::string what = argv[1], first = argc > 2 ? argv[2] : "", second = argc > 3 ? argv[3] : "";
  hardware_interface::TransmissionInfo info;
  info.name = "lever";
  info.actuators.emplace_back();
  info.actuators[0].name = "slotted_lever_crank";
  if (what != "none") {
    info.joints.emplace_back();
    info.joints[0].name = what == "joint" ? first : "slotted_lever_lever";
    info.joints[0].role = what == "joint" ? second : "lever";
  }
  if (what == "twice") {
    info.joints.push_back(info.joints[0]);
  }
  if (what == "parameter") {
    info.parameters[first] = second;
  }
  if (what == "reduction") {
    info.actuators[0].mechanical_reduction = 10.0;
  }
  const std::string interface = what == "interface" ? first : "position";
  const std::string named = what == "joint" || what == "handle" ? first : "slotted_lever_lever";
  double crank = argc > 4 ? std::atof(argv[4]) : 0.0, lever = 0.0;
  using Plugins = slotted_lever_transmissions_plugins::SlottedLeverLoader;
  try {
    const auto made = Plugins().load(info);
    made->configure({{named, interface, &lever}}, {{"slotted_lever_crank", interface, &crank}});
    made->actuator_to_joint();
    made->joint_to_actuator();
    std::printf("%.17g %.17g\n", lever, crank);
    return 0;
  } catch (const std::exception & error) {
    std::printf("%s\n", error.what());
    return 1;
  }
}
