#!/usr/bin/env python3
"""Publishes the poses and the growing surface of a GelSLAM scan in ROS 2.

    gelslam scan --model nnmodel.pth --headless --stream tcp:5555 --stream-surface
    python3 gelslam_bridge.py --ros-args -p port:=5555

/gelslam/pose     geometry_msgs/PoseWithCovarianceStamped: the sensor in the frame of its trial
/gelslam/surface  sensor_msgs/PointCloud2: the contact points of all keyframes of the shown map, in gelslam_map
/tf               gelslam_map -> gelslam_trial_N (once the map knows the trial; moves when loops close) -> gelslam_sensor

`Bridge` turns lines of the stream into plain tuples and needs no ROS; main() publishes them.
"""
import array
import json
import math
import socket
import struct
import time


def multiply(a, b):
    """Of 4x4 matrices as 16 numbers, row by row."""
    return [sum(a[4 * r + k] * b[4 * k + c] for k in range(4)) for r in range(4) for c in range(4)]


def inverse(a):
    """Of a rigid motion."""
    rotation = [a[4 * c + r] for r in range(3) for c in range(3)]
    shift = [-sum(rotation[3 * r + k] * a[4 * k + 3] for k in range(3)) for r in range(3)]
    return [*rotation[0:3], shift[0], *rotation[3:6], shift[1], *rotation[6:9], shift[2], 0, 0, 0, 1]


def quaternion(a):
    """(x, y, z, w) of the rotation, w >= 0."""
    m = [a[0:3], a[4:7], a[8:11]]
    w = math.sqrt(max(0.0, 1 + m[0][0] + m[1][1] + m[2][2])) / 2
    if w > 0.5:
        return ((m[2][1] - m[1][2]) / (4 * w), (m[0][2] - m[2][0]) / (4 * w), (m[1][0] - m[0][1]) / (4 * w), w)
    i = max(range(3), key=lambda axis: m[axis][axis])
    j, k = (i + 1) % 3, (i + 2) % 3
    q = [0.0] * 4
    q[i] = math.sqrt(max(0.0, 1 + m[i][i] - m[j][j] - m[k][k])) / 2
    q[j], q[k] = (m[i][j] + m[j][i]) / (4 * q[i]), (m[i][k] + m[k][i]) / (4 * q[i])
    q[3] = (m[k][j] - m[j][k]) / (4 * q[i])
    return tuple(-value for value in q) if q[3] < 0 else tuple(q)


def fixed_axes(covariance, pose):
    """ROS states covariances along the axes of the header's frame; the stream's are along the sensor's."""
    def turn(block):  # R block R^T
        r = [pose[0:3], pose[4:7], pose[8:11]]
        half = [[sum(r[i][k] * block[k][j] for k in range(3)) for j in range(3)] for i in range(3)]
        return [[sum(half[i][k] * r[j][k] for k in range(3)) for j in range(3)] for i in range(3)]

    result = [0.0] * 36
    for top in (0, 3):
        for left in (0, 3):
            block = [[covariance[6 * (top + i) + left + j] for j in range(3)] for i in range(3)]
            for i, row in enumerate(turn(block)):
                result[6 * (top + i) + left:6 * (top + i) + left + 3] = row
    return result


class Bridge:
    """Lines of the stream in, what is to be published out."""

    def __init__(self):
        self.scan, self.points, self.map = 0, {}, None
        self.dropped = 0

    def handle(self, line):
        """Yields ("pose", stamp_s, frame, pose, covariance), ("transform", stamp_s, parent, child, pose) and
        ("surface", bytes of x y z float32)."""
        message = json.loads(line)
        kind = message["type"]
        if message.get("scan", self.scan) != self.scan:
            self.scan, self.points, self.map = message["scan"], {}, None
        if kind == "frame" and message["status"] == "tracked":
            yield from self._frame(message)
        elif kind == "keyframe":
            self.points[message["keyframe"]] = message["points"]
        elif kind == "map":
            self.map = message
            yield ("surface", self._surface())
        elif kind == "dropped":
            self.dropped += message["lines"]

    @staticmethod
    def _frame(frame):
        stamp_s = frame["arrived_s"] if frame["arrived_s"] is not None else frame["time_s"]
        trial = "gelslam_trial_%d" % frame["trial"]
        yield ("pose", stamp_s, trial, frame["pose"], fixed_axes(frame["covariance"], frame["pose"]))
        yield ("transform", stamp_s, trial, "gelslam_sensor", frame["pose"])
        if frame["map_pose"] is not None:
            yield ("transform", stamp_s, "gelslam_map", trial,
                   multiply(frame["map_pose"], inverse(frame["pose"])))

    def _surface(self):
        cloud = array.array("f")
        for keyframe in self.map["keyframes"]:
            if keyframe["component"] != self.map["shown_component"]:
                continue
            p = keyframe["pose"]
            for x, y, z in self.points.get(keyframe["keyframe"], ()):
                cloud.extend(p[4 * r] * x + p[4 * r + 1] * y + p[4 * r + 2] * z + p[4 * r + 3] for r in range(3))
        return cloud.tobytes()


def connect(target):
    """tcp:PORT, tcp:HOST:PORT or unix:PATH; waits until the scan runs."""
    while True:
        try:
            if target.startswith("unix:"):
                connection = socket.socket(socket.AF_UNIX)
                connection.connect(target[5:])
                return connection
            host, _, port = target[4:].rpartition(":")
            return socket.create_connection((host or "127.0.0.1", int(port)))
        except OSError:
            time.sleep(0.5)


def main():
    import rclpy
    from builtin_interfaces.msg import Time
    from geometry_msgs.msg import Point, Pose, PoseWithCovarianceStamped, Quaternion, TransformStamped, Vector3
    from sensor_msgs.msg import PointCloud2, PointField
    from tf2_ros import TransformBroadcaster

    rclpy.init()
    node = rclpy.create_node("gelslam_bridge")
    target = node.declare_parameter("target", "").value
    target = target or "tcp:%d" % node.declare_parameter("port", 5555).value
    poses = node.create_publisher(PoseWithCovarianceStamped, "gelslam/pose", 10)
    surfaces = node.create_publisher(PointCloud2, "gelslam/surface", 1)
    transforms = TransformBroadcaster(node)

    def stamp(seconds):
        return Time(sec=int(seconds), nanosec=int((seconds - int(seconds)) * 1e9))

    def publish(kind, *values):
        if kind == "pose":
            stamp_s, frame, pose, covariance = values
            message = PoseWithCovarianceStamped()
            message.header.stamp, message.header.frame_id = stamp(stamp_s), frame
            x, y, z, w = quaternion(pose)
            message.pose.pose = Pose(position=Point(x=pose[3], y=pose[7], z=pose[11]),
                                     orientation=Quaternion(x=x, y=y, z=z, w=w))
            message.pose.covariance = covariance
            poses.publish(message)
        elif kind == "transform":
            stamp_s, parent, child, pose = values
            message = TransformStamped(child_frame_id=child)
            message.header.stamp, message.header.frame_id = stamp(stamp_s), parent
            x, y, z, w = quaternion(pose)
            message.transform.translation = Vector3(x=pose[3], y=pose[7], z=pose[11])
            message.transform.rotation = Quaternion(x=x, y=y, z=z, w=w)
            transforms.sendTransform(message)
        else:
            data, = values
            fields = [PointField(name=name, offset=4 * k, datatype=PointField.FLOAT32, count=1)
                      for k, name in enumerate("xyz")]
            message = PointCloud2(height=1, width=len(data) // 12, fields=fields, point_step=12, row_step=len(data),
                                  is_bigendian=struct.pack("=H", 1) == struct.pack(">H", 1), is_dense=True, data=data)
            message.header.stamp, message.header.frame_id = node.get_clock().now().to_msg(), "gelslam_map"
            surfaces.publish(message)

    try:
        while rclpy.ok():
            bridge, lost = Bridge(), False
            with connect(target) as connection:
                for line in connection.makefile():
                    for item in bridge.handle(line):
                        publish(*item)
                    if bridge.dropped and not lost:
                        node.get_logger().warning("too slow: some lines of the stream were dropped")
                        lost = True
            node.get_logger().info("the stream has ended; waiting for the next")
    except KeyboardInterrupt:
        pass
    node.destroy_node()


if __name__ == "__main__":
    main()
