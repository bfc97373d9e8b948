# SPDX-FileCopyrightText: 2026 linkage_ros contributors
# SPDX-License-Identifier: Apache-2.0

"""Runs the command `render` as `python -m linkage_ros.render`."""

import sys

from .cli import main

sys.exit(main())
