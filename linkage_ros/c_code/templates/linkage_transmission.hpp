// SPDX-FileCopyrightText: 2026 linkage_ros contributors
// SPDX-License-Identifier: Apache-2.0

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
  /// Bits of a status: outside the reach or the sweep; a velocity or an effort would be infinite; a
  /// value is NaN or infinite, which of a command means that there is none.
  enum Status : int { OK = 0, OUT_OF_REACH = 1, SINGULAR = 2, NOT_KNOWN = 4 };

  /// The status of the last call of actuator_to_joint() or joint_to_actuator(), a sum of these bits.
  virtual int status() const noexcept = 0;
};
}  // namespace linkage_ros

#endif  // LINKAGE_ROS__LINKAGE_TRANSMISSION_HPP_
