// Copyright 2026 linkage_ros contributors
//
// Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
// in compliance with the License. You may obtain a copy of the License at
// http://www.apache.org/licenses/LICENSE-2.0
// Unless required by applicable law or agreed to in writing, software distributed under the
// License is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either
// express or implied. See the License for the specific language governing permissions and
// limitations under the License.
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
