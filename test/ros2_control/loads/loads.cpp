// SPDX-FileCopyrightText: 2026 linkage_ros contributors
// SPDX-License-Identifier: Apache-2.0

// All transmissions of a URDF, loaded by pluginlib as a hardware component does: where a joint is
// measured it can be commanded, over the motors' range. Takes the URDF's file.
#include <cmath>
#include <cstdio>
#include <fstream>
#include <limits>
#include <map>
#include <memory>
#include <sstream>
#include <string>
#include <vector>

#include "hardware_interface/component_parser.hpp"
#include "pluginlib/class_loader.hpp"
#include "transmission_interface/transmission_loader.hpp"

int main(int argc, char ** argv)
{
  if (argc != 2) {
    std::fprintf(stderr, "usage: loads URDF\n");
    return 2;
  }
  std::stringstream urdf;
  urdf << std::ifstream(argv[1]).rdbuf();
  pluginlib::ClassLoader<transmission_interface::TransmissionLoader> loader(
    "transmission_interface", "transmission_interface::TransmissionLoader");
  const double nan = std::numeric_limits<double>::quiet_NaN();
  int loaded = 0;
  for (const auto & hardware : hardware_interface::parse_control_resources_from_urdf(urdf.str())) {
    for (const auto & info : hardware.transmissions) {
      std::map<std::string, double> memory;
      std::vector<transmission_interface::JointHandle> joints;
      std::vector<transmission_interface::ActuatorHandle> actuators;
      for (const auto & joint : info.joints) {
        joints.emplace_back(joint.name, "position", &(memory["joint " + joint.name] = nan));
      }
      for (const auto & actuator : info.actuators) {
        actuators.emplace_back(
          actuator.name, "position", &(memory["actuator " + actuator.name] = nan));
      }
      auto transmission = loader.createSharedInstance(info.type)->load(info);
      transmission->configure(joints, actuators);
      int back = 0;
      for (double position = -1.0; position < 5.0; position += 0.01) {
        for (auto & [name, value] : memory) {
          value = name[0] == 'a' ? position : nan;
        }
        transmission->actuator_to_joint();
        bool is_known = true;
        for (auto & [name, value] : memory) {
          is_known = is_known && std::isfinite(value);
          value = name[0] == 'a' ? nan : value;
        }
        transmission->joint_to_actuator();
        for (auto & [name, value] : memory) {
          if (is_known && name[0] == 'a' && std::abs(value - position) < 1e-9) {
            ++back;
          }
        }
      }
      std::printf("%s: %d positions there and back\n", info.name.c_str(), back);
      if (back < 20) {
        return 1;
      }
      ++loaded;
    }
  }
  return loaded > 0 ? 0 : 1;
}
