# Copyright 2026 linkage_ros contributors
#
# Licensed under the Apache License, Version 2.0 (the "License");
# you may not use this file except in compliance with the License.
# You may obtain a copy of the License at
#
#     http://www.apache.org/licenses/LICENSE-2.0
#
# Unless required by applicable law or agreed to in writing, software
# distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied.
# See the License for the specific language governing permissions and
# limitations under the License.

from glob import glob

from setuptools import find_packages, setup

package_name = 'linkage_ros'

setup(
    name=package_name,
    version='0.1.0',
    packages=find_packages(include=[f'{package_name}*']),
    package_data={f'{package_name}.web': ['page/*']},
    data_files=[
        ('share/ament_index/resource_index/packages', [f'resource/{package_name}']),
        (f'share/{package_name}', ['package.xml']),
        (f'share/{package_name}/config', glob('config/*')),
        (f'share/{package_name}/launch', glob('launch/*.launch.py')),
    ],
    python_requires='>=3.10',
    install_requires=['setuptools', 'numpy'],
    extras_require={
        'fast': ['llvmlite>=0.44'],
        'render': ['matplotlib>=3.6', 'pyyaml', 'tqdm'],
        'test': ['gmpy2', 'hypothesis', 'mpmath', 'pytest', 'pyyaml'],
        'viewer': ['aiohttp>=3.9'],
    },
    zip_safe=True,
    maintainer='linkage_ros contributors',
    maintainer_email='maintainers@linkage-ros.example',
    description='Closed planar linkages moved exactly, in closed form.',
    license='Apache-2.0',
    entry_points={
        'console_scripts': [
            f'{name} = {package_name}.{name}:main'
            for name in ('crank_driver', 'kinematics', 'render', 'servo_inverse', 'viewer')
        ] + [f'urdf = {package_name}.print_urdf:main'],
    },
)
