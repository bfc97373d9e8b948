# Copyright 2026 linkage_ros contributors
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the
# License is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either
# express or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""Say how many lines the tests run, and of which modules few; fail where they are too few."""

import json
import sys

# Parts of the lines [%]: what all together must have, a few points below what they have, and what
# a module must have not to be named. What tests start as a process of its own is not counted.
FLOOR, NAMED = 87.0, 60.0

with open(sys.argv[1], encoding='utf-8') as file:
    measured = json.load(file)
for name, module in sorted(measured['files'].items()):
    if module['summary']['percent_covered'] < NAMED:
        print(f'{module["summary"]["percent_covered"]:5.1f} % of {name}')
total = measured['summary']['percent_covered']
print(f'{total:5.1f} % of the lines of linkage_ros are run by the tests.')
if total < FLOOR:
    sys.exit(f'They must run {FLOOR:g} %.')
