// SPDX-FileCopyrightText: 2026 linkage_ros contributors
// SPDX-License-Identifier: Apache-2.0

// Written by linkage_ros.
#define LKR_MAX_PASSIVE @passive@
@includes@
#include "pluginlib/class_list_macros.hpp"
#include "transmission.hpp"

namespace @namespace@
{
@linkages@
}  // namespace @namespace@

@exports@
