# Copyright 2026 linkage_ros contributors
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the
# License is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either
# express or implied. See the License for the specific language governing permissions and
# limitations under the License.

import filecmp
from glob import glob
import os
from pathlib import Path
import subprocess
import sys

from setuptools import find_packages, setup

package_name = 'linkage_ros'
interfaces = Path(__file__).resolve().with_name('linkage_interfaces')

# colcon and bloom put commands where `ros2 run` looks for them; pip would put them on everybody's
# PATH, where names like `render` have no business.
for_ros = sys.argv[1:2] != ['--help'] and {'install', 'develop'} & set(sys.argv)
commands = {
    'c_code': 'c_code.command:main', 'crank_driver': 'executables:crank_driver',
    'from_robot': 'robot_files.command:main', 'kinematics': 'executables:kinematics',
    'render': 'render:main', 'scene': 'executables:scene',
    'servo_inverse': 'executables:servo_inverse', 'transmission': 'c_code.transmission:main',
    'urdf': 'nodes.urdf_command:main', 'viewer': 'executables:viewer'}


def build_interfaces():
    """Have colcon build the nested package too: it does not look below a package it has found."""
    paths = os.environ.get('PYTHONPATH', '').split(os.pathsep)
    # How colcon tells setup.py where to install to; it is not for the colcon that is run here.
    override = next((path for path in paths if Path(path).name == 'prefix_override'), None)
    if override is None or '--uninstall' in sys.argv or built():
        return
    prefix, build = Path(sys.prefix), Path(override).parent.parent
    layout = ['--install-base', prefix.parent]
    if prefix.name != package_name:
        layout = ['--merge-install', '--install-base', prefix]
    colcon = [sys.executable, '-c', 'from colcon_core import command; exit(command.main())']
    ended = subprocess.run(
        [*colcon, '--log-base', os.devnull, 'build', '--base-paths', interfaces,
         '--build-base', build, *layout], cwd=build,
        env={**os.environ, 'PYTHONPATH': os.pathsep.join(p for p in paths if p != override)})
    if ended.returncode:
        sys.exit(f'{interfaces.name}, which is nested in {package_name}, could not be built; '
                 f'rosdep installs what it needs: rosdep install --from-paths {interfaces}')


def built():
    """Return whether the nested package, as it is here, is there for this build already."""
    services = [f'srv/{file.name}' for file in interfaces.glob('srv/*.srv')]
    return any(not any(filecmp.cmpfiles(Path(prefix, 'share', interfaces.name), interfaces,
                                        services, shallow=False)[1:])
               for prefix in os.environ.get('AMENT_PREFIX_PATH', '').split(os.pathsep))


if for_ros:
    build_interfaces()

setup(
    name=package_name,
    version='1.0.0',
    packages=find_packages(include=[f'{package_name}*']),
    package_data={package_name: ['py.typed'], f'{package_name}.c_code': ['templates/*'],
                  f'{package_name}.web': ['page/*', 'page/vendor/*']},
    data_files=[
        ('share/ament_index/resource_index/packages', [f'resource/{package_name}']),
        (f'share/{package_name}', ['package.xml']),
        (f'share/{package_name}/config', glob('config/*')),
        (f'share/{package_name}/launch', glob('launch/*.launch.py')),
        (f'share/{package_name}/examples', glob('examples/*.*')),
    ],
    python_requires='>=3.10',
    install_requires=['setuptools', 'numpy'],
    extras_require={
        'fast': ['llvmlite>=0.44'],
        'mjcf': ['mujoco>=3'],
        'render': ['matplotlib>=3.6', 'pyyaml', 'tqdm'],
        'test': ['gmpy2', 'hypothesis', 'mpmath', 'mujoco>=3', 'pytest', 'pyyaml'],
        'viewer': ['aiohttp>=3.9'],
    },
    zip_safe=True,
    maintainer='linkage_ros contributors',
    maintainer_email='maintainers@linkage-ros.example',
    description='Closed-loop kinematics of linkages, in closed form.',
    license='Apache-2.0',
    entry_points={
        'console_scripts': [f'{name} = {package_name}.{function}'
                            for name, function in commands.items()] if for_ros else [],
    },
)
