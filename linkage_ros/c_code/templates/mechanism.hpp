// Written by linkage_ros. SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>

#include "@name@_linkage.h"
#include "linkage_transmission.hpp"
#include "transmission_interface/transmission_loader.hpp"

namespace @namespace@
{
/// The C of the mechanism @name@, for LinkageTransmission.
struct @class@Code
{
  using Linkage = @name@_linkage;
  using Memory = @name@_memory;
  using Side = @name@_side;
  static constexpr std::size_t size = @n@;
  static constexpr std::array<Axis, size> actuators{{@actuators@}};
  static constexpr std::array<Axis, size> joints{{@joints@}};
  static constexpr std::array<Dimension, @dimension_count@> dimensions{@dimensions@};
  static const char * set(Linkage & c, const double * values) { return @name@_set(&c, values); }
  static bool begin(const Linkage & c, Memory & m) { return @name@_begin(&c, &m) != 0; }
  static int to_joints(const Linkage & c, Memory & m, const Side & from, Side & to)
  {
    return @name@_actuators_to_joints(&c, &m, &from, &to);
  }
  static int to_actuators(const Linkage & c, Memory & m, const Side & from, Side & to)
  {
    return @name@_joints_to_actuators(&c, &m, &from, &to);
  }
};

using @class@Transmission = LinkageTransmission<@class@Code>;

class @class@Loader : public transmission_interface::TransmissionLoader
{
public:
  std::shared_ptr<transmission_interface::Transmission> load(
    const hardware_interface::TransmissionInfo & info) override
  {
    return std::make_shared<@class@Transmission>(info);
  }
};
}  // namespace @namespace@
