// SPDX-FileCopyrightText: 2026 linkage_ros contributors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <type_traits>

#define STAND_IN_JOINED(a, b) a##b
#define STAND_IN_NAME(count) STAND_IN_JOINED(stand_in_made_, count)
// Functions stand_in_made_0, stand_in_made_1 ... of a library, each of which makes a plugin.
#define PLUGINLIB_EXPORT_CLASS(Derived, Base) \
  static_assert(std::is_base_of<Base, Derived>::value, "a plugin is of its base"); \
  extern "C" __attribute__((visibility("default"))) Base * STAND_IN_NAME(__COUNTER__)( \
    const char ** type) \
  { \
    *type = #Derived; \
    return new Derived; \
  }
