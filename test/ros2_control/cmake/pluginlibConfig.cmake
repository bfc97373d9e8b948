# SPDX-FileCopyrightText: 2026 linkage_ros contributors
# SPDX-License-Identifier: Apache-2.0
# pluginlib, as far as a package of transmissions needs it, written for the tests.
if(NOT TARGET pluginlib::pluginlib)
  add_library(pluginlib::pluginlib INTERFACE IMPORTED)
  target_include_directories(pluginlib::pluginlib SYSTEM INTERFACE ${CMAKE_CURRENT_LIST_DIR}/../include)
endif()
function(pluginlib_export_plugin_description_file category file)
  if(NOT EXISTS ${CMAKE_CURRENT_SOURCE_DIR}/${file})
    message(FATAL_ERROR "${file} is missing")
  endif()
endfunction()
