# Copyright 2026 linkage_ros contributors
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the
# License is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either
# express or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""What the numbers were made on."""

from datetime import datetime, timezone
from importlib.metadata import PackageNotFoundError, version
import platform
import subprocess


def machine(methods):
    """Return the CPU, the date and the versions of everything that was measured."""
    packages = {'numpy', 'mpmath', *(m.package for m in methods if m.package)}
    return {
        'date': datetime.now(timezone.utc).strftime('%Y-%m-%d'),
        'cpu': _cpu(),
        'system': platform.platform(),
        'python': platform.python_version(),
        'compiler': _output('gcc', '--version').splitlines()[0],
        'commit': _output('git', 'describe', '--always', '--dirty').strip(),
        'packages': {name: _version(name) for name in sorted(packages)},
    }


def _cpu():
    try:
        with open('/proc/cpuinfo') as lines:
            fields = dict(line.strip().partition(':')[::2] for line in lines if ':' in line)
        fields = {name.strip(): value.strip() for name, value in fields.items()}
        return f'{fields["model name"]}, family {fields["cpu family"]} model {fields["model"]}'
    except (OSError, KeyError):
        return platform.processor() or platform.machine()


def _output(*command):
    try:
        return subprocess.run(command, capture_output=True, text=True).stdout or '?'
    except OSError:
        return '?'


def _version(package):
    try:
        return version(package)
    except PackageNotFoundError:
        return '?'
