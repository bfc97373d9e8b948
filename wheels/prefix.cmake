# Copyright 2026 linkage_ros contributors
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the
# License is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either
# express or implied. See the License for the specific language governing permissions and
# limitations under the License.

# Building against the wheels: handed in with -DCMAKE_PROJECT_INCLUDE, so that the CMakeLists.txt of
# the package stays plain ROS. CMAKE_PREFIX_PATH is the prefix of the virtual environment.

# The ament index of the wheels.
set(ENV{AMENT_PREFIX_PATH} "${CMAKE_PREFIX_PATH}")

# The exported Python generators list include directories of the machine that built the wheels,
# which CMake refuses: keep those that exist.
find_package(service_msgs REQUIRED)
foreach(package IN ITEMS builtin_interfaces service_msgs)
  set(target ${package}::${package}__rosidl_generator_py)
  get_target_property(directories ${target} INTERFACE_INCLUDE_DIRECTORIES)
  set(existing "")
  foreach(directory IN LISTS directories)
    if(EXISTS "${directory}")
      list(APPEND existing "${directory}")
    endif()
  endforeach()
  set_target_properties(${target} PROPERTIES INTERFACE_INCLUDE_DIRECTORIES "${existing}")
endforeach()
