"""The ROS 2 bridge's logic, without ROS."""
import array
import json
import math
import pathlib
import random
import socket
import sys
import tempfile
import threading
import unittest

ROOT = pathlib.Path(__file__).resolve().parent.parent.parent
sys.path.insert(0, str(ROOT / "examples/ros2"))
import gelslam_bridge as bridge  # noqa: E402

IDENTITY = [1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1]


def turn(axis, angle, shift=(0, 0, 0)):
    i, j = (axis + 1) % 3, (axis + 2) % 3
    pose = [float(number) for number in IDENTITY]
    pose[5 * i] = pose[5 * j] = math.cos(angle)
    pose[4 * i + j], pose[4 * j + i] = -math.sin(angle), math.sin(angle)
    pose[3], pose[7], pose[11] = shift
    return pose


def any_pose(chance):
    pose = turn(0, chance.uniform(-3, 3), [chance.uniform(-1, 1) for _ in range(3)])
    return bridge.multiply(bridge.multiply(pose, turn(1, chance.uniform(-3, 3))), turn(2, chance.uniform(-3, 3)))


def frame(pose, **more):
    covariance = [0.0] * 36
    for axis in range(6):
        covariance[7 * axis] = axis + 1.0
    return json.dumps({"type": "frame", "scan": 0, "status": "tracked", "trial": 2, "time_s": 1.5, "arrived_s": 100.25,
                       "pose": pose, "map_pose": None, "covariance": covariance, **more})


def keyframe(number, points, scan=0):
    return json.dumps({"type": "keyframe", "scan": scan, "keyframe": number, "points": points})


def map_of(poses, scan=0, shown=0):
    return json.dumps({"type": "map", "scan": scan, "shown_component": shown, "keyframes": [
        {"keyframe": number, "component": component, "pose": pose} for number, component, pose in poses]})


def points(cloud):
    numbers = array.array("f", cloud)
    return [tuple(round(n, 6) for n in numbers[k:k + 3]) for k in range(0, len(numbers), 3)]


class Motions(unittest.TestCase):
    def test_inverse_undoes(self):
        chance = random.Random(1)
        for _ in range(20):
            pose = any_pose(chance)
            for got, wanted in zip(bridge.multiply(pose, bridge.inverse(pose)), IDENTITY):
                self.assertAlmostEqual(got, wanted)

    def test_quaternions_rotate_as_the_matrix_does(self):
        chance = random.Random(2)
        poses = [any_pose(chance) for _ in range(50)] + [turn(axis, math.pi) for axis in range(3)] + [IDENTITY]
        for pose in poses:
            x, y, z, w = bridge.quaternion(pose)
            self.assertGreaterEqual(w, 0)
            matrix = [1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w),
                      2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w),
                      2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)]
            for got, wanted in zip(matrix, pose[0:3] + pose[4:7] + pose[8:11]):
                self.assertAlmostEqual(got, wanted)

    def test_a_quarter_turn_about_z_exchanges_x_and_y_of_a_covariance(self):
        covariance = [0.0] * 36
        for axis in range(6):
            covariance[7 * axis] = axis + 1.0
        covariance[5] = covariance[30] = 0.5  # x with rz
        turned = bridge.fixed_axes(covariance, turn(2, math.pi / 2))
        for got, wanted in zip([turned[7 * axis] for axis in range(6)], [2, 1, 3, 5, 4, 6]):
            self.assertAlmostEqual(got, wanted)
        self.assertAlmostEqual(turned[6 + 5], 0.5)  # y with rz
        self.assertAlmostEqual(turned[5], 0)


class Lines(unittest.TestCase):
    def test_a_frame_is_a_pose_and_its_transforms_lead_to_the_map(self):
        chance = random.Random(3)
        pose, map_pose = any_pose(chance), any_pose(chance)
        found = list(bridge.Bridge().handle(frame(pose, map_pose=map_pose)))
        self.assertEqual([item[0] for item in found], ["pose", "transform", "transform"])
        self.assertEqual(found[0][1:4], (100.25, "gelslam_trial_2", pose))
        self.assertEqual(found[1][2:4], ("gelslam_trial_2", "gelslam_sensor"))
        self.assertEqual(found[2][2:4], ("gelslam_map", "gelslam_trial_2"))
        for got, wanted in zip(bridge.multiply(found[2][4], found[1][4]), map_pose):
            self.assertAlmostEqual(got, wanted)

    def test_frames_without_pose_say_nothing_and_a_log_has_the_sensors_time(self):
        machine = bridge.Bridge()
        self.assertEqual(list(machine.handle(json.dumps({"type": "frame", "scan": 0, "status": "lost"}))), [])
        found = list(machine.handle(frame(IDENTITY, arrived_s=None)))
        self.assertEqual([item[0] for item in found], ["pose", "transform"])
        self.assertEqual(found[0][1], 1.5)

    def test_the_surface_is_the_shown_component_where_the_map_puts_it(self):
        machine = bridge.Bridge()
        for number in (0, 1, 2):
            self.assertEqual(list(machine.handle(keyframe(number, [[1, 0, number]]))), [])
        (kind, cloud), = machine.handle(map_of([(0, 0, IDENTITY), (1, 0, turn(2, math.pi / 2, (0, 0, 5))),
                                                (2, 2, IDENTITY), (3, 0, IDENTITY)]))  # 3 was dropped
        self.assertEqual(kind, "surface")
        self.assertEqual(points(cloud), [(1, 0, 0), (0, 1, 6)])
        (_, moved), = machine.handle(map_of([(0, 0, turn(0, 0, (2, 0, 0)))]))
        self.assertEqual(points(moved), [(3, 0, 0)])

    def test_a_new_scan_forgets_the_surface_before(self):
        machine = bridge.Bridge()
        list(machine.handle(keyframe(0, [[1, 0, 0]])))
        list(machine.handle(keyframe(1, [[2, 0, 0]], scan=1)))
        (_, cloud), = machine.handle(map_of([(0, 0, IDENTITY), (1, 0, IDENTITY)], scan=1))
        self.assertEqual(points(cloud), [(2, 0, 0)])

    def test_lost_lines_are_counted(self):
        machine = bridge.Bridge()
        list(machine.handle('{"type": "dropped", "lines": 12}'))
        self.assertEqual(machine.dropped, 12)


class Connections(unittest.TestCase):
    def test_a_scan_that_starts_later_is_waited_for(self):
        with tempfile.TemporaryDirectory() as folder:
            path = folder + "/poses"
            server = socket.socket(socket.AF_UNIX)

            def start():
                server.bind(path)
                server.listen()
            threading.Timer(0.2, start).start()
            with bridge.connect("unix:" + path) as connection, server.accept()[0] as other:
                other.sendall(b"hello\n")
                self.assertEqual(connection.makefile().readline(), "hello\n")
            server.close()


if __name__ == "__main__":
    unittest.main()
