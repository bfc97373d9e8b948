# SPDX-FileCopyrightText: 2026 linkage_ros contributors
# SPDX-License-Identifier: Apache-2.0

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
