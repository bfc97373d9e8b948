# SPDX-FileCopyrightText: 2026 linkage_ros contributors
# SPDX-License-Identifier: Apache-2.0

"""Command that writes a scene as a package of transmissions for ros2_control; it needs no ROS."""

from pathlib import Path
import sys
from typing import Sequence

from . import limits
from .cli import parser, with_joints
from .package import PACKAGE, package
from .. import cli, scene
from ..scene import SceneMechanism

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
            print('\n'.join(line for each in mechanisms for line in limits.lines(*each)))
        else:
            write_package(options.out, Path(options.scene).name, mechanisms)
    except ValueError as error:
        raise cli.RequestError(str(error)) from None


def write_package(folder: str, scene_file: str,
                  mechanisms: Sequence[tuple[SceneMechanism, Sequence[str]]]) -> None:
    """Write the package of mechanisms with their commanded joints."""
    out = Path(folder).absolute()
    if not PACKAGE.fullmatch(out.name):
        raise cli.RequestError(
            "--out must end in the package's name: 2 to 64 lower-case letters, digits and single "
            f'underscores, a letter first, not {out.name!r}')
    if out.exists() and any(out.iterdir()) and not is_ours(out):
        raise cli.RequestError('--out must be a new folder, or one written by this command, '
                               f'but {out} has other files')
    for path, text in package(out.name, scene_file, mechanisms).items():
        (out / path).parent.mkdir(parents=True, exist_ok=True)
        (out / path).write_text(text, encoding='utf-8')
    print(f'{out}: {", ".join(mechanism.name for mechanism, _ in mechanisms)}; see urdf/transmissions.xml')


def is_ours(folder: Path) -> bool:
    """Return whether a folder is a package of this command."""
    xml = folder / 'package.xml'
    return xml.is_file() and 'written by linkage_ros' in xml.read_text(errors='replace')


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
