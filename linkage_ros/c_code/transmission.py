# SPDX-FileCopyrightText: 2026 linkage_ros contributors
# SPDX-License-Identifier: Apache-2.0

"""Command that writes a scene as a package of transmissions for ros2_control; it needs no ROS."""

from pathlib import Path
import sys

from . import limits
from .cli import parser, with_joints
from .package import package
from .. import cli, scene

NAME = 'transmission'


def main(args: list[str] | None = None) -> int:
    """Write the package; return the exit code."""
    return cli.run(NAME, write, args)


def write(args: list[str] | None) -> None:
    """Write the package or print the limits that a command line requests."""
    options = arguments().parse_args(args)
    chosen = cli.chosen(scene.load(options.scene).mechanisms, options.mechanism)
    try:
        mechanisms = with_joints(chosen, options.joints)
        if options.limits:
            print('\n'.join(line for request in mechanisms for line in limits.lines(*request)))
            return
        out = Path(options.out).absolute()
        files = package(out.name, Path(options.scene).name, mechanisms)
    except ValueError as error:
        raise cli.RequestError(str(error)) from None
    if out.exists() and any(out.iterdir()) and not _is_ours(out / 'package.xml'):
        raise cli.RequestError('--out must be a new folder, or one written by this command, but '
                               f'{out} has other files')
    for path in filter(_is_ours, out.glob('src/*_linkage.h')):
        # Of a mechanism that may be chosen no longer.
        path.unlink()
    for path, text in files.items():
        (out / path).parent.mkdir(parents=True, exist_ok=True)
        (out / path).write_text(text, encoding='utf-8')
    names = ', '.join(mechanism.name for mechanism, _ in mechanisms)
    print(f'{out}: {names}; see urdf/transmissions.xml')


def _is_ours(path: Path) -> bool:
    """Return whether this command wrote a file."""
    return path.is_file() and 'written by linkage_ros' in path.read_text(errors='replace')


def arguments() -> cli.Parser:
    """Return the parser of the command line."""
    made = parser(NAME, 'Write the mechanisms of a scene as a ROS 2 package of transmissions for '
                        'ros2_control.')
    what = made.add_mutually_exclusive_group(required=True)
    what.add_argument('--out', metavar='DIR',
                      help='output folder; its name is the name of the package')
    what.add_argument('--limits', action='store_true', help='print the limits of the joints that '
                      'follow from sweeps and reach, for the URDF, and write nothing')
    return made


if __name__ == '__main__':
    sys.exit(main())
