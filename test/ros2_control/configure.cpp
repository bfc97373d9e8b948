// Copyright 2026 linkage_ros contributors
//
// Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
// in compliance with the License. You may obtain a copy of the License at
// http://www.apache.org/licenses/LICENSE-2.0
// Unless required by applicable law or agreed to in writing, software distributed under the
// License is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either
// express or implied. See the License for the specific language governing permissions and
// limitations under the License.
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
