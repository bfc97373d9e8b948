# SPDX-FileCopyrightText: 2026 linkage_ros contributors
# SPDX-License-Identifier: Apache-2.0

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
