// Copyright 2026 linkage_ros contributors
// SPDX-License-Identifier: Apache-2.0
// Exports a maker under the name of the class, so that a test can look it up in the library.
#pragma once

#include <type_traits>

#define STAND_IN_JOINED(a, b) a##b
#define STAND_IN_NAME(line) STAND_IN_JOINED(stand_in_maker_, line)
#define PLUGINLIB_EXPORT_CLASS(Derived, Base) \
  static_assert(std::is_base_of<Base, Derived>::value, "a plugin is of its base"); \
  extern "C" const char * STAND_IN_NAME(__LINE__)() \
  { \
    static Derived made; \
    return static_cast<Base *>(&made) ? #Derived : ""; \
  }
