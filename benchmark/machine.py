# Copyright 2026 linkage_ros contributors
# SPDX-License-Identifier: Apache-2.0

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
