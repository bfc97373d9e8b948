# SPDX-FileCopyrightText: 2026 linkage_ros contributors
# SPDX-License-Identifier: Apache-2.0

"""`python -m linkage_ros.robot_model`."""

import sys

from .cli import main

sys.exit(main())
