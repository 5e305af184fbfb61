from setuptools import setup

NAME = 'gelslam_bridge'

setup(
    name=NAME,
    version='0.3.0',
    packages=[NAME],
    data_files=[
        ('share/ament_index/resource_index/packages', ['resource/' + NAME]),
        ('share/' + NAME, ['package.xml']),
        ('share/' + NAME + '/launch', ['launch/gelslam_bridge.launch.py']),
    ],
    install_requires=['setuptools'],
    zip_safe=True,
    maintainer='The GelSLAM authors',
    maintainer_email='gelslam@users.noreply.github.com',
    description='Publishes the poses and the growing surface of a GelSLAM scan.',
    license='MIT',
    tests_require=['pytest'],
    entry_points={'console_scripts': ['gelslam_bridge = gelslam_bridge.node:main']},
)
