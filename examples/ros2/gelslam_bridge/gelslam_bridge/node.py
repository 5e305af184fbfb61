"""Publishes the poses and the growing surface of a GelSLAM scan."""
import array
import sys

from builtin_interfaces.msg import Time
from gelslam_bridge.motion import quaternion
from gelslam_bridge.stream import (Bridge, check_target, Frames, ImageItem, lines, PoseItem,
                                   SurfaceItem, TransformItem, Warn)
from geometry_msgs.msg import (Point, Pose, PoseWithCovarianceStamped, Quaternion,
                               TransformStamped, Vector3)
import rclpy
from rclpy.executors import ExternalShutdownException
from rclpy.node import Node
from rclpy.qos import DurabilityPolicy, QoSProfile
from sensor_msgs.msg import CompressedImage, PointCloud2, PointField
from tf2_ros import TransformBroadcaster


def _time(seconds):
    whole, nanoseconds = divmod(round(seconds * 1e9), 10**9)
    return Time(sec=whole, nanosec=nanoseconds)


def _rotation(pose):
    x, y, z, w = quaternion(pose)
    return Quaternion(x=x, y=y, z=z, w=w)


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
        self.transforms = TransformBroadcaster(self)
        self.publish = {PoseItem: self._pose, TransformItem: self._transform,
                        SurfaceItem: self._surface, ImageItem: self._image, Warn: self._warn}

    def follow(self):
        """Publish one stream."""
        self.bridge, self.surface_waits, images = Bridge(self.frames), False, None
        while images != self._wants_images():  # somebody came, or the last has gone
            images = self._wants_images()

            def goes_on():
                return rclpy.ok() and images == self._wants_images()
            for line in lines(self.target, goes_on, images):
                if line is None:
                    rclpy.spin_once(self, timeout_sec=0.0)  # answers questions for parameters
                    self._publish_surface()
                    continue
                for item in self.bridge.handle(line):
                    self.publish[type(item)](item)

    def _wants_images(self):
        return self.images.get_subscription_count() > 0

    def _pose(self, item):
        message = PoseWithCovarianceStamped()
        message.header.stamp, message.header.frame_id = _time(item.stamp_s), item.frame
        place = Point(x=item.pose[3], y=item.pose[7], z=item.pose[11])
        message.pose.pose = Pose(position=place, orientation=_rotation(item.pose))
        message.pose.covariance = item.covariance
        self.poses.publish(message)

    def _transform(self, item):
        message = TransformStamped(child_frame_id=item.child)
        message.header.stamp, message.header.frame_id = _time(item.stamp_s), item.parent
        shift = Vector3(x=item.pose[3], y=item.pose[7], z=item.pose[11])
        message.transform.translation, message.transform.rotation = shift, _rotation(item.pose)
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
