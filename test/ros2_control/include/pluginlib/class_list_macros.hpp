// Copyright 2026 linkage_ros contributors
//
// Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
// in compliance with the License. You may obtain a copy of the License at
// http://www.apache.org/licenses/LICENSE-2.0
// Unless required by applicable law or agreed to in writing, software distributed under the
// License is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either
// express or implied. See the License for the specific language governing permissions and
// limitations under the License.
// A generated transmission, its names in NAME, CLASS and NAMESPACE, is proved: both ways at many states: positions there and back, velocities against differences, power, and
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
