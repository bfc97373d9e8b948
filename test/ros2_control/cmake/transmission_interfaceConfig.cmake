# SPDX-FileCopyrightText: 2026 linkage_ros contributors
# SPDX-License-Identifier: Apache-2.0
# transmission_interface, as far as a package of transmissions needs it, written for the tests.
if(NOT TARGET transmission_interface::transmission_interface)
  add_library(transmission_interface::transmission_interface INTERFACE IMPORTED)
  target_include_directories(transmission_interface::transmission_interface SYSTEM INTERFACE ${CMAKE_CURRENT_LIST_DIR}/../include)
endif()
