"""The ROS 2 bridge without ROS: its logic, and its node on stubs of ROS."""
import array
import importlib.util
import json
import math
import pathlib
import random
import runpy
import shutil
import socket
import subprocess
import sys
import tempfile
import threading
import time
import types
import unittest
import unittest.mock
import xml.etree.ElementTree as xml

import numpy as np
import ros_stubs
from scipy.spatial.transform import Rotation

ROOT = pathlib.Path(__file__).resolve().parent.parent.parent
PACKAGE = ROOT / "examples/ros2/gelslam_bridge"
sys.path.insert(0, str(PACKAGE))
sys.dont_write_bytecode = True
from gelslam_bridge import stream  # noqa: E402
from gelslam_bridge.stream import PoseItem, StatusItem, SurfaceItem, TransformItem, Warn  # noqa: E402

IDENTITY = np.eye(4)


def turn(axis, angle, shift=(0, 0, 0)):
    pose = np.eye(4)
    pose[:3, :3], pose[:3, 3] = Rotation.from_rotvec(angle * np.eye(3)[axis]).as_matrix(), shift
    return pose


def any_pose(chance):
    pose = np.eye(4)
    pose[:3, :3] = Rotation.from_euler("xyz", [chance.uniform(-3, 3) for _ in range(3)]).as_matrix()
    pose[:3, 3] = [chance.uniform(-1, 1) for _ in range(3)]
    return pose


def numbers(values):
    """Arrays as the stream has them: row by row."""
    return {name: value.ravel().tolist() if isinstance(value, np.ndarray) else value for name, value in values.items()}


def frame(pose, **more):
    covariance = [0.0] * 36
    for axis in range(6):
        covariance[7 * axis] = axis + 1.0
    return json.dumps(numbers({"type": "frame", "scan": 0, "status": "tracked", "trial": 2, "time_s": 1.5, "time_unix_s": 100.25,
                               "pose": pose, "map_pose": pose, "component": 0, "covariance": covariance, "map_covariance": covariance, **more}))


def keyframe(number, points, scan=0):
    return json.dumps({"type": "keyframe", "scan": scan, "keyframe": number, "points": points})


def map_of(poses, scan=0, shown=0):
    return json.dumps({"type": "map", "scan": scan, "shown_component": shown, "keyframes": [
        {"keyframe": number, "component": component, "map_pose": pose.ravel().tolist()} for number, component, pose in poses]})


def points(cloud):
    return [tuple(round(float(n), 6) for n in point) for point in np.frombuffer(bytes(cloud), np.float32).reshape(-1, 3)]


class Motions(unittest.TestCase):
    def test_a_quarter_turn_about_z_exchanges_x_and_y_of_a_covariance(self):
        covariance = [0.0] * 36
        for axis in range(6):
            covariance[7 * axis] = axis + 1.0
        covariance[5] = covariance[30] = 0.5  # x with rz
        turned = stream.fixed_axes(covariance, turn(2, math.pi / 2)).ravel()
        for got, wanted in zip([turned[7 * axis] for axis in range(6)], [2, 1, 3, 5, 4, 6]):
            self.assertAlmostEqual(got, wanted)
        self.assertAlmostEqual(turned[6 + 5], 0.5)  # y with rz
        self.assertAlmostEqual(turned[5], 0)


def items(machine, kind, *lines):
    return [item for line in lines for item in machine.handle(line) if isinstance(item, kind)]


def tree(machine, line):
    """{child: (parent, pose)} of one frame."""
    return {item.child: (item.parent, item.pose) for item in items(machine, TransformItem, line)}


def way(found, child):
    """Pose of a frame in the root of the tree, and the names on the way."""
    names, pose = [child], IDENTITY
    while names[-1] in found:
        parent, step = found[names[-1]]
        names, pose = [*names, parent], step @ pose
    return names, pose


class Lines(unittest.TestCase):
    def assert_pose(self, got, wanted):
        np.testing.assert_allclose(got, wanted, atol=1e-9)

    def test_a_frame_is_a_pose_and_its_transforms_lead_to_the_map(self):
        chance = random.Random(3)
        pose, map_pose = any_pose(chance), any_pose(chance)
        machine = stream.Bridge()
        found = list(machine.handle(frame(pose, map_pose=map_pose, component=0)))
        published, = [item for item in found if isinstance(item, PoseItem)]
        self.assertEqual((published.stamp_s, published.frame), (100.25, "map"))
        self.assert_pose(published.pose, map_pose)
        names, place = way({i.child: (i.parent, i.pose) for i in found if isinstance(i, TransformItem)},
                           "sensor")
        self.assertEqual(names, ["sensor", "trial", "map"])
        self.assert_pose(place, map_pose)

    def test_the_object_hangs_under_the_sensor_with_names_of_ones_own(self):
        chance = random.Random(4)
        pose, map_pose = any_pose(chance), any_pose(chance)
        names = stream.Frames(map="bolt", trial="bolt_odom", sensor="finger_optical", root="sensor")
        found = tree(stream.Bridge(names), frame(pose, map_pose=map_pose, component=0))
        chain, place = way(found, "bolt")
        self.assertEqual(chain, ["bolt", "bolt_odom", "finger_optical"])
        self.assert_pose(place @ map_pose, IDENTITY)

    def test_a_new_trial_stays_in_the_tree_where_the_sensor_was_until_a_loop_joins_it(self):
        chance = random.Random(5)
        last, begin, later, joined = (any_pose(chance) for _ in range(4))
        machine = stream.Bridge()
        list(machine.handle(frame(any_pose(chance), trial=0, map_pose=last, component=0)))
        # A component of its own has a frame of its own, which is not the map's.
        found = list(machine.handle(frame(begin, trial=1, component=7)))
        self.assertEqual(len([item for item in found if isinstance(item, Warn)]), 1)
        published, = [item for item in found if isinstance(item, PoseItem)]
        self.assertEqual(published.frame, "trial")
        self.assert_pose(published.pose, begin)
        names, place = way({i.child: (i.parent, i.pose) for i in found if isinstance(i, TransformItem)},
                           "sensor")
        self.assertEqual(names[-1], "map")
        self.assert_pose(place, last)
        found = tree(machine, frame(later, trial=1, map_pose=any_pose(chance), component=7))
        self.assert_pose(way(found, "sensor")[1],
                         last @ np.linalg.inv(begin) @ later)
        found = tree(machine, frame(later, trial=1, map_pose=joined, component=0))
        self.assert_pose(way(found, "sensor")[1], joined)

    def test_the_map_is_the_component_that_the_surface_shows(self):
        machine, place = stream.Bridge(), turn(0, 1, (1, 2, 3))
        list(machine.handle(frame(IDENTITY, trial=0, map_pose=IDENTITY, component=0)))
        list(machine.handle(map_of([(4, 4, IDENTITY)], shown=4)))
        found = tree(machine, frame(IDENTITY, trial=1, map_pose=place, component=4))
        self.assert_pose(way(found, "sensor")[1], place)

    def test_a_pose_in_a_known_map_is_one_of_the_map(self):
        place, machine = turn(1, 0.5, (1, 0, 2)), stream.Bridge()
        line = frame(any_pose(random.Random(6)), status="localized", map_pose=place, in_map=True)
        published, = items(machine, PoseItem, line)
        self.assertEqual(published.frame, "map")
        self.assert_pose(way(tree(machine, line), "sensor")[1], place)

    def test_frames_without_pose_have_a_status_and_a_contact(self):
        line = frame(None, status="lost", covariance=None, reason="too fast", contact={"area_mm2": 2e6, "center_mm": [1000, -2000]})
        self.assertEqual(list(stream.Bridge().handle(line)), [StatusItem(100.25, "sensor", "lost: too fast", 2, [1, -2])])
        line = frame(None, status="background", covariance=None, reason="", contact=None)
        self.assertEqual(list(stream.Bridge().handle(line)), [StatusItem(100.25, "sensor", "background", 0, None)])

    def test_stamps_are_capture_times_or_begin_now(self):
        machine = stream.Bridge()
        with unittest.mock.patch("time.time", lambda: 5000.0):
            for capture, time_s, stamp in ((1764268461.123457, 1.5, 1764268461.123457), (None, 1.5, 5000), (None, 2, 5000.5)):
                published, = items(machine, PoseItem, frame(IDENTITY, time_unix_s=capture, time_s=time_s))
                self.assertEqual(published.stamp_s, stamp)

    def test_the_surface_is_the_shown_component_where_the_map_puts_it(self):
        machine = stream.Bridge()
        for number in (0, 1, 2):
            self.assertEqual(list(machine.handle(keyframe(number, [[1, 0, number]]))), [])
        self.assertEqual(len(items(machine, SurfaceItem, map_of([(0, 0, IDENTITY), (1, 0, turn(2, math.pi / 2, (0, 0, 5))),
                                                                 (2, 2, IDENTITY), (3, 0, IDENTITY)]))), 1)  # 3 was dropped
        self.assertEqual(points(machine.surface()), [(1, 0, 0), (0, 1, 6)])
        # The next line names what has moved.
        self.assertEqual(len(items(machine, SurfaceItem, map_of([(0, 0, turn(0, 0, (2, 0, 0)))]))), 1)
        self.assertEqual(points(machine.surface()), [(3, 0, 0), (0, 1, 6)])

    def test_a_new_scan_forgets_the_surface_before(self):
        machine = stream.Bridge()
        list(machine.handle(keyframe(0, [[1, 0, 0]])))
        list(machine.handle(keyframe(1, [[2, 0, 0]], scan=1)))
        list(machine.handle(map_of([(0, 0, IDENTITY), (1, 0, IDENTITY)], scan=1)))
        self.assertEqual(points(machine.surface()), [(2, 0, 0)])

    def test_lost_lines_are_said_once(self):
        machine = stream.Bridge()
        self.assertEqual(len(items(machine, Warn, *2 * ['{"type": "dropped", "lines": 12}'])), 1)


class Served(unittest.TestCase):
    """Poses of a service on this machine."""

    def setUp(self):
        stream.WAIT_S = 0.1
        self.server = socket.socket()
        self.addCleanup(self.server.close)
        self.server.bind(("127.0.0.1", 0))
        self.target = "http://127.0.0.1:%d/?token=7" % self.server.getsockname()[1]

    def listen(self):
        self.server.listen()

    def serve(self, *lines):
        """Sends the lines to the first reader and ends, in the background; to a second one, who wants pictures, first."""
        pictures = [line for line in lines if '"image"' in line]

        def answer(lines):
            connection, _ = self.server.accept()
            self.asked.append(connection.recv(10000).split(b"\r\n")[0])
            connection.sendall(b"HTTP/1.1 200 OK\r\nTransfer-Encoding: chunked\r\n\r\n")
            yield
            with connection:
                for line in lines:
                    connection.sendall(b"%x\r\n%s\n\r\n" % (len(line.encode()) + 1, line.encode()))
                yield
                connection.sendall(b"0\r\n\r\n")

        def send():
            first = answer([line for line in lines if line not in pictures])
            next(first)
            if pictures:
                second = answer(["{}", *pictures])
                list(second)
                time.sleep(0.2)
            list(first)
        self.asked = []
        self.listen()
        thread = threading.Thread(target=send)
        thread.start()
        self.addCleanup(thread.join)


class Connections(Served):
    def test_a_scan_that_starts_later_is_waited_for(self):
        waits = []

        def goes_on():
            waits.append(True)
            if len(waits) == 2:  # the first attempt has failed
                self.serve("hello", "world")
            return True
        found = [line for line in stream.lines(self.target, goes_on) if line is not None]
        self.assertEqual(found, [b"hello", b"world"])
        self.assertEqual(self.asked, [b"GET /poses?surface=1&token=7 HTTP/1.1"])

    def test_no_thread_is_left_of_streams_whose_queue_is_full(self):
        before = threading.active_count()
        for _ in range(5):
            with socket.create_server(("127.0.0.1", 0)) as self.server:
                self.target = "http://127.0.0.1:%d/" % self.server.getsockname()[1]
                self.serve(*["line"] * 1000)
                found = stream.lines(self.target, lambda: True, lambda: False)
                while next(found) is None:
                    pass
                time.sleep(0.1)  # until it is full
                found.close()
        for _ in range(100):
            if threading.active_count() == before:
                break
            time.sleep(0.05)
        self.assertEqual(threading.active_count(), before)

    def test_who_wants_pictures_later_loses_no_line(self):
        wants, picture = [], json.dumps({"type": "image"}, separators=(",", ":"))
        self.serve("hello", "world", picture)
        found = []
        for line in stream.lines(self.target, lambda: True, lambda: bool(wants)):
            wants.append(True)
            found.append(line)
        self.assertEqual([line for line in found if line], [picture.encode(), b"hello", b"world"])
        self.assertEqual(self.asked, [b"GET /poses?surface=1&token=7 HTTP/1.1", b"GET /poses?images=1&token=7 HTTP/1.1"])

    def test_waiting_ends_when_asked_with_and_without_a_scan(self):
        for listens in (False, True):
            if listens:
                self.listen()
            left = iter(range(4))
            self.assertEqual(set(stream.lines(self.target, lambda: next(left, None) is not None)), {None})

    def test_a_wrong_target_is_named(self):
        for target in ("5555", "tcp:5555", "http://", "http://host:0/", "http://host:70000/", "http://host:x/", ""):
            with self.assertRaisesRegex(ValueError, "give the address"):
                stream.check_target(target)
        for target in ("http://127.0.0.1:5555/", "http://10.0.0.1:5555/?token=ab", "http://[::1]:5555"):
            stream.check_target(target)


@unittest.skipUnless(ros_stubs.FOUND, "no ros-geometry-msgs, ros-sensor-msgs, ros-std-msgs, ros-std-srvs")
class Nodes(Served):
    def node(self, **parameters):
        ros = ros_stubs.Ros(target=self.target, **parameters)
        for name in [*ros.install(), "gelslam_bridge.node"]:
            self.addCleanup(sys.modules.pop, name, None)
        sys.modules.pop("gelslam_bridge.node", None)
        return ros, importlib.import_module("gelslam_bridge.node")

    def run_node(self, *lines, reads=None, **parameters):
        """Until the stream has ended."""
        ros, node = self.node(**parameters)
        if reads is not None:
            ros.read = reads
        self.serve(*lines)
        follow = node.GelslamBridge.follow

        def once(self):
            follow(self)
            ros.ok = False
        node.GelslamBridge.follow = once
        self.assertEqual(node.main(), 0)
        return ros

    def test_what_is_published_has_the_types_of_the_definitions(self):
        pose = turn(2, math.pi / 2, (1, 2, 3))
        ros = self.run_node(keyframe(0, [[1, 0, 0], [0, 1, 0]]), map_of([(0, 0, pose)]),
                            frame(pose, map_pose=pose, component=0, time_unix_s=12.9999999999))
        published, = ros.sent("gelslam/pose")
        self.assertEqual((published.header.frame_id, published.header.stamp.sec, published.header.stamp.nanosec),
                         ("map", 13, 0))
        self.assertEqual((published.pose.pose.position.y, len(published.pose.covariance)), (2, 36))
        self.assertAlmostEqual(published.pose.pose.orientation.z, math.sqrt(0.5))
        self.assertEqual([(t.header.frame_id, t.child_frame_id) for t in ros.sent("/tf")],
                         [("map", "trial"), ("trial", "sensor")])
        surface, = ros.sent("gelslam/surface")
        self.assertEqual((surface.width, surface.header.frame_id), (2, "map"))
        self.assertEqual(points(surface.data), [(1, 3, 3), (0, 2, 3)])
        self.assertEqual(ros.latched, {"gelslam/surface"})

    def test_status_and_contact_are_published(self):
        ros = self.run_node(frame(None, status="no_contact", covariance=None, contact={"area_mm2": 0, "center_mm": None}),
                            frame(IDENTITY, contact={"area_mm2": 2e6, "center_mm": [500, 250]}))
        self.assertEqual([message.data for message in ros.sent("gelslam/status")], ["no_contact", "tracked"])
        self.assertEqual([message.data for message in ros.sent("gelslam/contact_area")], [0, 2])
        contact, = ros.sent("gelslam/contact")
        self.assertEqual((contact.header.frame_id, contact.header.stamp.sec, contact.point.x, contact.point.y), ("sensor", 100, 0.5, 0.25))

    def test_services_stop_a_scan_and_begin_a_new_one(self):
        ros, node = self.node()
        node.GelslamBridge()
        self.assertEqual(set(ros.services), {"gelslam/stop", "gelslam/new"})
        self.server.listen()

        def answer():
            for status in (b"200 OK", b"403 Forbidden"):
                connection, _ = self.server.accept()
                with connection:
                    asked.append(connection.recv(10000).split(b"\r\n")[0])
                    connection.sendall(b"HTTP/1.1 %s\r\nContent-Length: 3\r\n\r\nso\n" % status)
        asked = []
        thread = threading.Thread(target=answer)
        thread.start()
        self.addCleanup(thread.join)
        answers = [ros.services["gelslam/" + what]() for what in ("stop", "new")]
        self.assertEqual(asked, [b"POST /stop?token=7 HTTP/1.1", b"POST /new?token=7 HTTP/1.1"])
        self.assertEqual([(a.success, a.message) for a in answers], [(True, "so"), (False, "so")])
        self.server.close()
        self.assertFalse(ros.services["gelslam/stop"]().success)

    def test_a_picture_has_the_stamp_of_its_frame(self):
        image = {"type": "image", "scan": 0, "time_s": 1.5, "time_unix_s": 100.25, "jpeg": "/9j/2Q=="}
        ros = self.run_node(frame(IDENTITY), json.dumps(image, separators=(",", ":")))
        published, = ros.sent("gelslam/image/compressed")
        pose, = ros.sent("gelslam/pose")
        self.assertEqual(bytes(published.data), b"\xff\xd8\xff\xd9")
        self.assertEqual((published.header.stamp.sec, published.header.stamp.nanosec),
                         (pose.header.stamp.sec, pose.header.stamp.nanosec))
        self.assertEqual((published.format, published.header.frame_id), ("jpeg", "sensor"))

    def test_what_nobody_reads_is_neither_asked_for_nor_made(self):
        ros = self.run_node(keyframe(0, [[1, 0, 0]]), map_of([(0, 0, IDENTITY)]), frame(IDENTITY), reads=set())
        self.assertEqual(len(self.asked), 1)
        self.assertEqual((len(ros.sent("gelslam/surface")), len(ros.sent("gelslam/pose"))), (0, 1))

    def test_parameters_name_frames_and_turn_the_tree(self):
        ros = self.run_node(frame(IDENTITY), root="sensor", map_frame="bolt", trial_frame="t", sensor_frame="s_optical")
        self.assertEqual({(t.header.frame_id, t.child_frame_id) for t in ros.sent("/tf")},
                         {("s_optical", "t"), ("t", "bolt")})

    def test_wrong_parameters_end_the_node(self):
        for parameters in ({"root": "world"}, {"target": "5555"}):
            ros, node = self.node()
            ros.parameters.update(parameters)
            self.assertEqual(node.main(), 2)

    def test_a_shutdown_ends_a_node_that_waits(self):
        for listens in (False, True):
            if listens:
                self.listen()  # a scan that says nothing
            ros, node = self.node()
            spins = iter(range(50))

            def spun():
                ros.ok = next(spins) < 3  # StopIteration: it would wait for ever
            ros.spun = spun
            self.assertEqual(node.main(), 0)


class Package(unittest.TestCase):
    @unittest.skipUnless(importlib.util.find_spec("setuptools"), "no setuptools")
    def test_what_setup_and_launch_name_is_there(self):
        manifest = xml.parse(PACKAGE / "package.xml").getroot()
        self.assertEqual(manifest.findtext("name"), PACKAGE.name)
        with tempfile.TemporaryDirectory() as folder:
            copy = shutil.copytree(PACKAGE, folder + "/package")
            subprocess.run([sys.executable, "setup.py", "-q", "install", "--root", folder + "/root", "--prefix", "/usr"],
                           cwd=copy, check=True, capture_output=True)
            installed = {path.name for path in pathlib.Path(folder, "root").rglob("*") if path.is_file()}
        self.assertLessEqual({"node.py", "stream.py", "package.xml", "gelslam_bridge.launch.py",
                              "gelslam_bridge"}, installed)
        imported = {line.split()[1].split(".")[0] for path in [*PACKAGE.glob("*/*.py")] if path.parent.name != "test"
                    for line in path.read_text().splitlines() if line.startswith(("import ", "from "))}
        needs = {element.text.removeprefix("python3-") for element in manifest.iter("exec_depend")}
        self.assertLessEqual(imported - set(sys.stdlib_module_names) - {PACKAGE.name}, needs)

    def test_the_launch_file_gives_the_node_its_parameters_and_mounts_the_sensor(self):
        """On stubs: a substitution becomes its text with the arguments that were given, else their defaults."""
        declared, given = {}, {"root": "sensor", "flange_frame": "tool0", "flange_xyz": "0 0 0.1"}

        def declare(name, default_value, description):
            declared[name] = given.get(name, default_value)

        def node(**arguments):
            return arguments
        stubs = {
            "launch": {"LaunchDescription": lambda entities: [each for each in entities if each]},
            "launch.actions": {"DeclareLaunchArgument": declare, "LogInfo": node},
            "launch.conditions": {"IfCondition": lambda expression: expression},
            "launch.substitutions": {"LaunchConfiguration": lambda name: declared[name],
                                     "PythonExpression": lambda parts: str(eval("".join(parts)))},
            "launch_ros.actions": {"Node": node},
            "launch_ros.parameter_descriptions": {"ParameterValue": lambda value, value_type: value_type(value)},
        }
        modules = {"launch_ros": types.ModuleType("launch_ros")}
        for name, members in stubs.items():
            modules[name] = types.ModuleType(name)
            vars(modules[name]).update(members)
        with unittest.mock.patch.dict(sys.modules, modules):
            launch = runpy.run_path(str(PACKAGE / "launch/gelslam_bridge.launch.py"))
            bridge, mount, refusal = launch["generate_launch_description"]()
            given["root"] = "map"  # where the trial is the sensor's parent
            _, no_mount, said = launch["generate_launch_description"]()
        names = stream.Frames()
        self.assertEqual(bridge["parameters"], [{
            "target": "http://127.0.0.1:5555/", "root": "sensor", "map_frame": names.map, "trial_frame": names.trial,
            "sensor_frame": names.sensor}])
        words = mount["arguments"]
        self.assertEqual(dict(zip(words[::2], words[1::2])), {
            "--frame-id": "tool0", "--child-frame-id": names.sensor, "--x": "0", "--y": "0", "--z": "0.1",
            "--roll": "0", "--pitch": "0", "--yaw": "0"})
        self.assertEqual([mount["condition"], refusal["condition"]], ["True", "False"])
        self.assertEqual([no_mount["condition"], said["condition"]], ["False", "True"])

    @unittest.skipUnless(shutil.which("ament_flake8") and shutil.which("ament_pep257"), "no python3-ament-flake8, -pep257")
    def test_style_is_that_of_ros(self):
        for linter in ("ament_flake8", "ament_pep257"):
            done = subprocess.run([linter, str(PACKAGE)], capture_output=True, text=True)
            self.assertEqual(done.returncode, 0, done.stdout + done.stderr)


if __name__ == "__main__":
    unittest.main()
