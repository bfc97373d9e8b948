// Copyright 2026 linkage_ros contributors
//
// Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
// in compliance with the License. You may obtain a copy of the License at
// http://www.apache.org/licenses/LICENSE-2.0
// Unless required by applicable law or agreed to in writing, software distributed under the
// License is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either
// express or implied. See the License for the specific language governing permissions and
// limitations under the License.

// Written by linkage_ros.
#pragma once

#include <memory>

#include "@name@_linkage.h"
#include "transmission-of.hpp"
#include "transmission_interface/transmission_loader.hpp"

namespace @namespace@
{
/// The C of the mechanism @name@, for TransmissionOf.
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

using @class@Transmission = TransmissionOf<@class@Code>;

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
