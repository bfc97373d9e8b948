// Copyright 2026 linkage_ros contributors
//
// Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
// in compliance with the License. You may obtain a copy of the License at
// http://www.apache.org/licenses/LICENSE-2.0
// Unless required by applicable law or agreed to in writing, software distributed under the
// License is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either
// express or implied. See the License for the specific language governing permissions and
// limitations under the License.
// What a transmission reads of hardware_interface, written for the tests.
#pragma once

#include <string>
#include <unordered_map>
#include <vector>

namespace hardware_interface
{
struct JointInfo
{
  std::string name, role;
  double mechanical_reduction = 1.0, offset = 0.0;
};

using ActuatorInfo = JointInfo;

struct TransmissionInfo
{
  std::string name, type;
  std::vector<JointInfo> joints;
  std::vector<ActuatorInfo> actuators;
  std::unordered_map<std::string, std::string> parameters;
};
}  // namespace hardware_interface
