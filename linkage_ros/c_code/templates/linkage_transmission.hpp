// Copyright 2026 linkage_ros contributors
//
// Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
// in compliance with the License. You may obtain a copy of the License at
// http://www.apache.org/licenses/LICENSE-2.0
// Unless required by applicable law or agreed to in writing, software distributed under the
// License is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either
// express or implied. See the License for the specific language governing permissions and
// limitations under the License.

// Written by linkage_ros, with the same content in every package of transmissions.
#ifndef LINKAGE_ROS__LINKAGE_TRANSMISSION_HPP_
#define LINKAGE_ROS__LINKAGE_TRANSMISSION_HPP_

#include "transmission_interface/transmission.hpp"

namespace linkage_ros
{
/// What all transmissions that linkage_ros has written have in common, in any package:
/// `dynamic_cast<const linkage_ros::LinkageTransmission *>(transmission.get())`.
class __attribute__((visibility("default"))) LinkageTransmission
  : public transmission_interface::Transmission
{
public:
  /// Bits of a status: outside the reach or the sweep, or not found by a search; a velocity or an
  /// effort would be infinite; a value is NaN or infinite, which of a command means that there is none.
  enum Status : int { OK = 0, OUT_OF_REACH = 1, SINGULAR = 2, NOT_KNOWN = 4 };

  /// The status of the last call of actuator_to_joint() or joint_to_actuator(), a sum of these bits.
  virtual int status() const noexcept = 0;
};
}  // namespace linkage_ros

#endif  // LINKAGE_ROS__LINKAGE_TRANSMISSION_HPP_
