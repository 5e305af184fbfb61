"""Publishes the poses and the growing surface of a GelSLAM scan."""
import array
from functools import partial
import sys

from builtin_interfaces.msg import Time
from gelslam_bridge.stream import (ask, Bridge, check_target, Frames, ImageItem, lines, PoseItem,
                                   StatusItem, SurfaceItem, TransformItem, Warn)
from geometry_msgs.msg import (Point, PointStamped, Pose, PoseWithCovarianceStamped, Quaternion,
                               TransformStamped, Vector3)
import rclpy
from rclpy.executors import ExternalShutdownException
from rclpy.node import Node
from rclpy.qos import DurabilityPolicy, QoSProfile
from scipy.spatial.transform import Rotation
from sensor_msgs.msg import CompressedImage, PointCloud2, PointField
from std_msgs.msg import Float64, String
from std_srvs.srv import Trigger
from tf2_ros import TransformBroadcaster


def _time(seconds):
    whole, nanoseconds = divmod(round(seconds * 1e9), 10**9)
    return Time(sec=whole, nanosec=nanoseconds)


def _rotation(pose):
    x, y, z, w = map(float, Rotation.from_matrix(pose[:3, :3]).as_quat())
    return Quaternion(x=x, y=y, z=z, w=w)


def _place(kind, pose):
    x, y, z = map(float, pose[:3, 3])
    return kind(x=x, y=y, z=z)


class GelslamBridge(Node):

    def __init__(self):
        super().__init__('gelslam_bridge')
        self.target = self.declare_parameter('target', 'http://127.0.0.1:5555/').value
        check_target(self.target)
        self.frames = Frames(**{
            name: self.declare_parameter(name + '_frame', default).value
            for name, default in (('map', Frames.map), ('trial', Frames.trial),
                                  ('sensor', Frames.sensor))})
        self.frames.root = self.declare_parameter('root', Frames.root).value
        if self.frames.root not in ('map', 'sensor'):
            raise ValueError("root '%s': give map or sensor" % self.frames.root)
        self.poses = self.create_publisher(PoseWithCovarianceStamped, 'gelslam/pose', 10)
        # Who comes later gets the surface, too.
        latched = QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL)
        self.surfaces = self.create_publisher(PointCloud2, 'gelslam/surface', latched)
        self.images = self.create_publisher(CompressedImage, 'gelslam/image/compressed', 10)
        self.states = self.create_publisher(String, 'gelslam/status', 10)
        self.contacts = self.create_publisher(PointStamped, 'gelslam/contact', 10)
        self.areas = self.create_publisher(Float64, 'gelslam/contact_area', 10)
        for what in ('stop', 'new'):
            self.create_service(Trigger, 'gelslam/' + what, partial(self._ask, what))
        self.transforms = TransformBroadcaster(self)
        self.publish = {PoseItem: self._pose, TransformItem: self._transform,
                        SurfaceItem: self._surface, ImageItem: self._image,
                        StatusItem: self._status, Warn: self._warn}

    def follow(self):
        """Publish one stream."""
        self.bridge, self.surface_waits = Bridge(self.frames), False
        for line in lines(self.target, rclpy.ok, self._wants_images):
            if line is None:
                rclpy.spin_once(self, timeout_sec=0.0)  # answers services
                self._publish_surface()
                continue
            for item in self.bridge.handle(line):
                self.publish[type(item)](item)

    def _wants_images(self):
        return self.images.get_subscription_count() > 0

    def _pose(self, item):
        message = PoseWithCovarianceStamped()
        message.header.stamp, message.header.frame_id = _time(item.stamp_s), item.frame
        message.pose.pose = Pose(position=_place(Point, item.pose),
                                 orientation=_rotation(item.pose))
        message.pose.covariance = item.covariance.ravel().tolist()
        self.poses.publish(message)

    def _transform(self, item):
        message = TransformStamped(child_frame_id=item.child)
        message.header.stamp, message.header.frame_id = _time(item.stamp_s), item.parent
        message.transform.translation = _place(Vector3, item.pose)
        message.transform.rotation = _rotation(item.pose)
        self.transforms.sendTransform(message)

    def _surface(self, item):
        self.surface_waits = True

    def _publish_surface(self):
        """Publish the newest surface, once somebody reads it."""
        if not self.surface_waits or self.surfaces.get_subscription_count() == 0:
            return
        self.surface_waits = False
        fields = [PointField(name=name, offset=4 * k, datatype=PointField.FLOAT32, count=1)
                  for k, name in enumerate('xyz')]
        data = array.array('B', self.bridge.surface().tobytes())
        message = PointCloud2(height=1, width=len(data) // 12, fields=fields, point_step=12,
                              row_step=len(data), is_bigendian=sys.byteorder == 'big',
                              is_dense=True, data=data)
        message.header.stamp = self.get_clock().now().to_msg()
        message.header.frame_id = self.frames.map
        self.surfaces.publish(message)

    def _image(self, item):
        message = CompressedImage(format='jpeg', data=item.jpeg)
        message.header.stamp, message.header.frame_id = _time(item.stamp_s), item.frame
        self.images.publish(message)

    def _status(self, item):
        self.states.publish(String(data=item.text))
        self.areas.publish(Float64(data=item.area_m2))
        if item.center is not None:
            message = PointStamped(point=Point(x=item.center[0], y=item.center[1], z=0.0))
            message.header.stamp, message.header.frame_id = _time(item.stamp_s), item.frame
            self.contacts.publish(message)

    def _ask(self, what, request, response):
        response.success, response.message = ask(self.target, what)
        return response

    def _warn(self, item):
        self.get_logger().warning(item.text)


def main(args=None):
    rclpy.init(args=args)
    try:
        node = GelslamBridge()
        while rclpy.ok():
            node.follow()
            if rclpy.ok():
                node.get_logger().info('the stream has ended; waiting for the next')
    except ValueError as error:
        print('gelslam_bridge: %s' % error, file=sys.stderr)
        return 2
    except (KeyboardInterrupt, ExternalShutdownException):
        pass
    finally:
        rclpy.try_shutdown()
    return 0


if __name__ == '__main__':
    sys.exit(main())
