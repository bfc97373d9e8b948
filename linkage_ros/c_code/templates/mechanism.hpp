// SPDX-FileCopyrightText: 2026 linkage_ros contributors
// SPDX-License-Identifier: Apache-2.0

// Written by linkage_ros.
#pragma once

#include "@name@_linkage.h"
#include "transmission-of.hpp"

namespace @namespace@
{
/// The C of the mechanism @name@, for TransmissionOf.
struct @class@Code
{
  static constexpr std::size_t size = @n@;
  static constexpr std::array<Axis, size> actuators{{@actuators@}};
  /// The commanded joints, then the passive ones, and the function for those.
  static constexpr std::array<Axis, @joint_count@> joints{{@joints@}};
  static constexpr Passive * at_passive = @passive_function@;
  static constexpr const lkr_model & model = @name@_model;
};

using @class@Transmission = TransmissionOf<@class@Code>;
using @class@Loader = LoaderOf<@class@Code>;
}  // namespace @namespace@
