# SPDX-FileCopyrightText: 2026 linkage_ros contributors
# SPDX-License-Identifier: Apache-2.0

"""Run time, error and stability measured; run its modules from the repository's root with -m."""

from pathlib import Path
import sys

# The truth that is measured against is that of the tests: test/truth/.
sys.path.append(str(Path(__file__).parents[1] / 'test'))
