"""
Starts the bridge with the object under a robot's flange, or with the sensor in the map.

    ros2 launch gelslam_bridge gelslam_bridge.launch.py root:=sensor flange_frame:=tool0
"""
from launch import LaunchDescription
from launch.actions import DeclareLaunchArgument, LogInfo
from launch.conditions import IfCondition
from launch.substitutions import LaunchConfiguration, PythonExpression
from launch_ros.actions import Node
from launch_ros.parameter_descriptions import ParameterValue

PARAMETERS = [
    ('target', 'http://127.0.0.1:5555/', 'the address that --serve prints, with its token'),
    ('root', 'map', 'map: the sensor moves in the map; sensor: the object is its child'),
    ('map_frame', 'map', 'frame of the object'),
    ('trial_frame', 'trial', 'frame in which poses are continuous'),
    ('sensor_frame', 'sensor', 'x right, y down, z out of the gel (REP 103)'),
]
MOUNT = [
    ('flange_frame', '', 'with root:=sensor: frame of the robot that carries the sensor'),
    ('flange_xyz', '0 0 0', 'place of the sensor in it, meters'),
    ('flange_rpy', '0 0 0', 'roll, pitch, yaw of the sensor in it, radians'),
]


def _when(root):
    """Whether there is a flange, and the tree has this root."""
    return IfCondition(PythonExpression(['"', LaunchConfiguration('flange_frame'), '" != "" and "',
                                         LaunchConfiguration('root'), '" == "', root, '"']))


def _mount():
    arguments = ['--frame-id', LaunchConfiguration('flange_frame'),
                 '--child-frame-id', LaunchConfiguration('sensor_frame')]
    for group, options in (('flange_xyz', ('x', 'y', 'z')),
                           ('flange_rpy', ('roll', 'pitch', 'yaw'))):
        for index, option in enumerate(options):
            number = ['"', LaunchConfiguration(group), '".split()[%d]' % index]
            arguments += ['--' + option, PythonExpression(number)]
    return Node(package='tf2_ros', executable='static_transform_publisher', arguments=arguments,
                condition=_when('sensor'))


def generate_launch_description():
    declared = [DeclareLaunchArgument(name, default_value=value, description=text)
                for name, value, text in PARAMETERS + MOUNT]
    bridge = Node(package='gelslam_bridge', executable='gelslam_bridge', output='screen',
                  parameters=[{name: ParameterValue(LaunchConfiguration(name), value_type=str)
                               for name, _, _ in PARAMETERS}])
    # A frame has one parent: with root:=map that of the sensor is the trial.
    refusal = LogInfo(msg='flange_frame is left out: it needs root:=sensor',
                      condition=_when('map'))
    return LaunchDescription([*declared, bridge, _mount(), refusal])
