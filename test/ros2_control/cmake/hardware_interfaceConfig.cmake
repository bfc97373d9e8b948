# SPDX-FileCopyrightText: 2026 linkage_ros contributors
# SPDX-License-Identifier: Apache-2.0
# hardware_interface, as far as a package of transmissions needs it, written for the tests.
if(NOT TARGET hardware_interface::hardware_interface)
  add_library(hardware_interface::hardware_interface INTERFACE IMPORTED)
  target_include_directories(hardware_interface::hardware_interface SYSTEM INTERFACE ${CMAKE_CURRENT_LIST_DIR}/../include)
endif()
