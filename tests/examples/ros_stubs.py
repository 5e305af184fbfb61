"""What the ROS 2 bridge needs of ROS 2: messages by their definitions, and a node that notes what it publishes.

Definitions are those of Debian's ros-*-msgs and ros-std-srvs (ROS 1), with the time and header of ROS 2. Messages refuse
unknown fields and wrong types, as those that rosidl generates do.
"""
import array
import pathlib
import re
import sys
import types

SHARE = pathlib.Path("/usr/share")
FOUND = all((SHARE / package).exists() for package in ("geometry_msgs", "sensor_msgs", "std_msgs", "std_srvs"))
USED = ["geometry_msgs/Point", "geometry_msgs/Vector3", "geometry_msgs/Quaternion", "geometry_msgs/Pose",
        "geometry_msgs/PoseWithCovariance", "geometry_msgs/PoseWithCovarianceStamped", "geometry_msgs/Transform",
        "geometry_msgs/PointStamped", "geometry_msgs/TransformStamped", "sensor_msgs/PointField", "sensor_msgs/PointCloud2",
        "sensor_msgs/CompressedImage", "std_msgs/String", "std_msgs/Float64"]
OF_ROS2 = {"builtin_interfaces/Time": "int32 sec\nuint32 nanosec", "std_msgs/Header": "builtin_interfaces/Time stamp\nstring frame_id"}
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
    kinds, constants = {}, {}
    for kind, field, value in re.findall(r"^(\S+)\s+(\w+)(?:\s*=\s*(\d+))?\s*(?:#.*)?$", definition, re.M):
        base = kind.partition("[")[0]
        if base not in SIMPLE and base not in INTEGERS and "/" not in kind:
            kind = ("std_msgs/" if kind == "Header" else name.partition("/")[0] + "/") + kind
        if value:
            constants[field] = int(value)
        else:
            kinds[field] = kind

    class Message:
        __slots__ = tuple(kinds)

        def __init__(self, **values):
            for field, kind in kinds.items():
                setattr(self, field, values.pop(field) if field in values else default(kind))
            assert not values, f"{name} has no {list(values)}"

        def __setattr__(self, field, value):
            assert accepts(kinds[field], value), f"{name}.{field} is no {kinds[field]}: {value!r}"
            super().__setattr__(field, value)

    for constant, value in constants.items():
        setattr(Message, constant, value)
    return Message


if FOUND:
    for name, definition in OF_ROS2.items():
        messages[name] = message_class(name, definition)
    for name in USED:
        package, kind = name.split("/")
        messages[name] = message_class(name, (SHARE / package / "msg" / (kind + ".msg")).read_text())
    answer = (SHARE / "std_srvs/srv/Trigger.srv").read_text().split("---")[1]
    Trigger = types.SimpleNamespace(Request=object, Response=message_class("std_srvs/Trigger_Response", answer))


class Ros:
    """One process of ROS: parameters in, what was published and said out. `ok` is what rclpy.ok() says."""

    def __init__(self, **parameters):
        self.parameters, self.published, self.said, self.latched, self.ok = parameters, [], [], set(), True
        self.services = {}
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

            def create_service(self, kind, name, answer):
                assert kind is Trigger
                ros.services[name] = lambda: answer(kind.Request(), kind.Response())

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
            "std_srvs": {},
            "std_srvs.srv": {"Trigger": Trigger},
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
