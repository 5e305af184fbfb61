"""What the ROS 2 bridge needs of ROS 2: messages by their definitions, and a node that notes what it publishes.

Messages refuse unknown fields and wrong types, as those that rosidl generates do.
"""
import array
import sys
import types

DEFINITIONS = {
    "builtin_interfaces/Time": "int32 sec, uint32 nanosec",
    "std_msgs/Header": "builtin_interfaces/Time stamp, string frame_id",
    "geometry_msgs/Point": "float64 x, float64 y, float64 z",
    "geometry_msgs/Vector3": "float64 x, float64 y, float64 z",
    "geometry_msgs/Quaternion": "float64 x, float64 y, float64 z, float64 w",
    "geometry_msgs/Pose": "geometry_msgs/Point position, geometry_msgs/Quaternion orientation",
    "geometry_msgs/PoseWithCovariance": "geometry_msgs/Pose pose, float64[36] covariance",
    "geometry_msgs/PoseWithCovarianceStamped": "std_msgs/Header header, geometry_msgs/PoseWithCovariance pose",
    "geometry_msgs/Transform": "geometry_msgs/Vector3 translation, geometry_msgs/Quaternion rotation",
    "geometry_msgs/TransformStamped": "std_msgs/Header header, string child_frame_id, geometry_msgs/Transform transform",
    "sensor_msgs/PointField": "string name, uint32 offset, uint8 datatype, uint32 count",
    "sensor_msgs/PointCloud2": "std_msgs/Header header, uint32 height, uint32 width, sensor_msgs/PointField[] fields, "
                               "bool is_bigendian, uint32 point_step, uint32 row_step, uint8[] data, bool is_dense",
    "sensor_msgs/CompressedImage": "std_msgs/Header header, string format, uint8[] data",
}
CONSTANTS = {"sensor_msgs/PointField": {"FLOAT32": 7}}
INTEGERS = {"uint8": (0, 2**8), "uint32": (0, 2**32), "int32": (-2**31, 2**31)}
SIMPLE = {"string": str, "bool": bool, "float64": float}
messages = {}


def accepts(kind, value):
    if kind == "uint8[]":
        return isinstance(value, array.array) and value.typecode == "B"  # anything else is checked byte by byte
    if kind.endswith("]"):
        element, _, count = kind[:-1].partition("[")
        return isinstance(value, (list, tuple)) and len(value) == int(count or len(value)) and all(
            accepts(element, each) for each in value)
    if kind in INTEGERS:
        low, high = INTEGERS[kind]
        return isinstance(value, int) and low <= value < high
    return isinstance(value, SIMPLE.get(kind) or messages[kind])


def default(kind):
    if kind == "uint8[]":
        return array.array("B")
    if kind.endswith("]"):
        element, _, count = kind[:-1].partition("[")
        return [default(element)] * int(count or 0)
    if kind in INTEGERS:
        return 0
    return SIMPLE[kind]() if kind in SIMPLE else messages[kind]()


def message_class(name, definition):
    kinds = {field: kind for kind, field in (part.split() for part in definition.split(", "))}

    class Message:
        __slots__ = tuple(kinds)

        def __init__(self, **values):
            for field, kind in kinds.items():
                setattr(self, field, values.pop(field) if field in values else default(kind))
            assert not values, f"{name} has no {list(values)}"

        def __setattr__(self, field, value):
            assert accepts(kinds[field], value), f"{name}.{field} is no {kinds[field]}: {value!r}"
            super().__setattr__(field, value)

    for constant, value in CONSTANTS.get(name, {}).items():
        setattr(Message, constant, value)
    return Message


for name, definition in DEFINITIONS.items():
    messages[name] = message_class(name, definition)


class Ros:
    """One process of ROS: parameters in, what was published and said out. `ok` is what rclpy.ok() says."""

    def __init__(self, **parameters):
        self.parameters, self.published, self.said, self.latched, self.ok = parameters, [], [], set(), True
        self.spun = lambda: None  # called in every spin_once()
        self.read = {"gelslam/surface", "gelslam/image/compressed"}  # topics that somebody subscribes to

    def sent(self, topic):
        return [message for to, message in self.published if to == topic]

    def install(self):
        """Lets `import rclpy` and the messages find this. Returns the names that were added to sys.modules."""
        ros = self

        class Parameter:
            def __init__(self, value):
                self.value = value

        class Publisher:
            def __init__(self, kind, topic):
                self.kind, self.topic = kind, topic

            def get_subscription_count(self):
                return int(self.topic in ros.read)

            def publish(self, message):
                assert isinstance(message, self.kind)
                ros.published.append((self.topic, message))

        class Logger:
            def info(self, text):
                ros.said.append(text)
            warning = info

        class Clock:
            def now(self):
                return types.SimpleNamespace(to_msg=lambda: messages["builtin_interfaces/Time"](sec=7))

        class QoSProfile:
            def __init__(self, depth, durability):
                self.durability = durability

        class Node:
            def __init__(self, name):
                pass

            def declare_parameter(self, name, value):
                return Parameter(ros.parameters.get(name, value))

            def create_publisher(self, kind, topic, qos):
                if isinstance(qos, QoSProfile) and qos.durability == "transient local":
                    ros.latched.add(topic)
                return Publisher(kind, topic)

            def get_logger(self):
                return Logger()

            def get_clock(self):
                return Clock()

        class TransformBroadcaster:
            def __init__(self, node):
                pass

            def sendTransform(self, message):
                assert isinstance(message, messages["geometry_msgs/TransformStamped"])
                ros.published.append(("/tf", message))

        contents = {
            "rclpy": {"init": lambda args=None: None, "ok": lambda: ros.ok, "try_shutdown": lambda: None,
                      "spin_once": lambda node, timeout_sec: ros.spun()},
            "rclpy.executors": {"ExternalShutdownException": type("ExternalShutdownException", (Exception,), {})},
            "rclpy.node": {"Node": Node},
            "rclpy.qos": {"QoSProfile": QoSProfile,
                          "DurabilityPolicy": types.SimpleNamespace(TRANSIENT_LOCAL="transient local")},
            "tf2_ros": {"TransformBroadcaster": TransformBroadcaster},
        }
        for name, kind in messages.items():
            package, name = name.split("/")
            contents.setdefault(package, {})
            contents.setdefault(package + ".msg", {})[name] = kind
        for name, members in contents.items():
            sys.modules[name] = types.ModuleType(name)
            vars(sys.modules[name]).update(members)
        return list(contents)
