// SPDX-FileCopyrightText: 2026 linkage_ros contributors
// SPDX-License-Identifier: Apache-2.0

// Written by linkage_ros.
#pragma once

#include "@name@_linkage.h"
#include "transmission-of.hpp"

namespace @namespace@
{
inline const Linkage @name@_linkage{
  @name@_model, {@actuators@}, {@joints@}, @passive_function@};
using @class@Loader = LoaderOf<@name@_linkage>;
}  // namespace @namespace@
