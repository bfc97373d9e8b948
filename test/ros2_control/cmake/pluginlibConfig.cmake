# Copyright 2026 linkage_ros contributors
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the
# License is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either
# express or implied. See the License for the specific language governing permissions and
# limitations under the License.
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
