# SPDX-FileCopyrightText: 2026 linkage_ros contributors
# SPDX-License-Identifier: Apache-2.0

from glob import glob
import os
from pathlib import Path
import subprocess
import sys

from setuptools import setup

# What else there is to say of the package is in setup.cfg.
package_name = 'linkage_ros'
interfaces = Path(__file__).resolve().with_name('linkage_interfaces')
commands = {
    'c_code': 'c_code.cli:main', 'crank_driver': 'executables:crank_driver',
    'from_robot': 'robot_files.cli:main', 'kinematics': 'executables:kinematics',
    'render': 'render.cli:main', 'scene': 'executables:scene',
    'servo_inverse': 'executables:servo_inverse', 'transmission': 'c_code.transmission:main',
    'urdf': 'nodes.urdf_cli:main', 'viewer': 'executables:viewer'}
# colcon and bloom put commands where `ros2 run` looks for them; pip would put them on everybody's
# PATH, where names like `render` have no business.
for_ros = sys.argv[1:2] != ['--help'] and {'install', 'develop'} & set(sys.argv)


def build_interfaces():
    """Have colcon build the nested package too: it does not look below a package it has found."""
    paths = os.environ.get('PYTHONPATH', '').split(os.pathsep)
    # How colcon tells setup.py where to install to; it is not for the colcon that is run here.
    override = next((path for path in paths if Path(path).name == 'prefix_override'), None)
    if override is None or '--uninstall' in sys.argv:
        return
    prefix, build = Path(sys.prefix), Path(override).parent.parent
    layout = (['--install-base', prefix.parent] if prefix.name == package_name
              else ['--merge-install', '--install-base', prefix])
    colcon = [sys.executable, '-c', 'from colcon_core import command; exit(command.main())']
    known = {**os.environ, 'PYTHONPATH': os.pathsep.join(p for p in paths if p != override)}
    if subprocess.run([*colcon, '--log-base', os.devnull, 'build', '--base-paths', interfaces,
                       '--build-base', build, *layout], cwd=build, env=known).returncode:
        sys.exit(f'{interfaces.name}, which is nested in {package_name}, could not be built; '
                 f'rosdep installs what it needs: rosdep install --from-paths {interfaces}')


if for_ros:
    build_interfaces()

setup(
    # Of setup.cfg colcon cannot read it.
    python_requires='>=3.10',
    data_files=[
        ('share/ament_index/resource_index/packages', [f'resource/{package_name}']),
        (f'share/{package_name}', ['package.xml']),
        (f'share/{package_name}/config', glob('config/*')),
        (f'share/{package_name}/launch', glob('launch/*.launch.py')),
        (f'share/{package_name}/examples', glob('examples/*.*'))],
    entry_points={'console_scripts': [
        f'{name} = {package_name}.{function}' for name, function in commands.items()
    ] if for_ros else []})
