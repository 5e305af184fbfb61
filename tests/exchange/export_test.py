"""What `gelslam export` writes of a simulated run, read back by readers of our own and compared with the run folder; what
`gelslam info` says of such files."""
import base64
import collections
import contextlib
import fcntl
import json
import math
import os
import pathlib
import re
import shutil
import sqlite3
import subprocess
import unittest

import numpy as np
import readers

PROGRAM = os.environ["GELSLAM_PROGRAM"]
SCAN = pathlib.Path(os.environ["GELSLAM_LOG"]) / "scan"
WORK = pathlib.Path(os.environ["GELSLAM_WORK"])
RUN = WORK / "run"
needs_open3d = unittest.skipUnless(os.environ["GELSLAM_OPEN3D"] == "1", "built without Open3D")


def gelslam(*arguments):
    return subprocess.run([PROGRAM, *map(str, arguments)], capture_output=True, text=True)


def export(name, *options, source=RUN, exit_code=0):
    """The exported file's bytes and what the program said."""
    result = gelslam("export", source, "-o", WORK / name, "--overwrite", *options)
    assert result.returncode == exit_code, result.stderr
    return (WORK / name).read_bytes(), result.stderr


def corners_of(stl):
    """Mx3x3: of the triangles of a binary STL."""
    return np.frombuffer(stl[84:], np.dtype([("normal", "<f4", 3), ("corners", "<f4", (3, 3)), ("rest", "<u2")]))["corners"]


def matrix(tum):
    _, x, y, z, qx, qy, qz, qw = tum
    q = np.array([qx, qy, qz])
    cross = np.array([[0, -qz, qy], [qz, 0, -qx], [-qy, qx, 0]])
    pose = np.eye(4)
    pose[:3, :3] = (qw * qw - q @ q) * np.eye(3) + 2 * np.outer(q, q) + 2 * qw * cross
    pose[:3, 3] = x, y, z
    return pose


def setUpModule():
    shutil.rmtree(WORK, ignore_errors=True)
    WORK.mkdir(parents=True)
    result = gelslam("reconstruct", SCAN, "-o", RUN, "-q")
    assert result.returncode == 0, result.stderr


class Info(unittest.TestCase):
    def info(self, path, exit_code=0):
        result = gelslam("info", path)
        self.assertEqual(result.returncode, exit_code, result.stderr)
        return result.stdout + result.stderr

    def test_a_mesh_can_be_evaluated(self):
        self.assertRegex(self.info(RUN / "mesh.ply"), r"use +gelslam .*, evaluate,")

    def test_a_map_of_a_mesh_is_no_run(self):
        folder = WORK / "map"
        self.assertEqual(gelslam("map", SCAN / "gt_mesh.ply", "-o", folder, "--touches", "20", "-q").returncode, 1)
        for path in folder, folder / "session.db", folder / "map.json":
            said = self.info(path)
            self.assertRegex(said, r"map: a map of a mesh \(gelslam map\)\n  mesh .*\n  touches +20\n  use +gelslam track --map, view, export\n")

    def test_a_run_that_somebody_writes_is_not_called_unfinished(self):
        scan = WORK / "writing"
        scan.mkdir()
        shutil.copy(RUN / "session.db", scan)
        with contextlib.closing(sqlite3.connect(scan / "session.db")) as session, session:
            session.execute("DELETE FROM map")
        self.assertIn("the scan was not finished", self.info(scan, 1))
        lock = os.open(scan, os.O_RDONLY)
        fcntl.flock(lock, fcntl.LOCK_EX)
        try:
            for said in self.info(scan, 1), gelslam("view", scan, "--snapshot", WORK / "no.png").stderr:
                self.assertRegex(said, rf"another program \(.*process {os.getpid()}\) is writing to '.*writing'")
                self.assertNotIn("not finished", said)
        finally:
            os.close(lock)

    def test_a_background_shorter_than_asked_for_has_nothing_before_it(self):
        config = WORK / "eleven.yaml"
        config.write_text("contact_mask_config:\n  background_frames: 11\n")
        made = gelslam("reconstruct", SCAN, "--config", config, "--model", SCAN / "model.json", "-o", WORK / "eleven", "-q")
        self.assertEqual(made.returncode, 0, made.stderr)
        self.assertIn("the background is that of frames 0 to 9: of the 11 asked for, only these show the bare gel\n",
                      self.info(WORK / "eleven"))

    def test_optics_are_no_configuration(self):
        shutil.copy(SCAN / "optics.yaml", WORK / "opt.yaml")
        for file in SCAN / "optics.yaml", WORK / "opt.yaml":
            self.assertRegex(self.info(file), r": the optics of .*\n  optics +camera at 22 mm, lens k1 0.037, dome")

    def test_files_that_are_only_written_are_no_videos(self):
        export("only.glb"), export("only.html")
        for file in WORK / "only.glb", WORK / "only.html", RUN / "pose_graph.g2o", SCAN / "touched.npy":
            self.assertEqual(self.info(file, 2), f"gelslam: error: {file}: written for other programs, or part of a folder; give the run or folder that it is of\n")
        self.assertIn(": calibration presses\n", self.info(SCAN.parent / "presses/catalog.csv"))

    def test_an_empty_mesh_has_a_reason_and_few_uses(self):
        fused = gelslam("fuse", RUN, "--voxel-size-mm", "10", "-o", WORK / "coarse", "-q")
        self.assertEqual(fused.returncode, 1)
        self.assertIn("no mesh: its cells are larger than the touches", fused.stderr)
        self.assertRegex(self.info(WORK / "coarse"), r"use +gelslam evaluate, fuse, scan --continue, track --map\n")
        self.assertEqual(gelslam("evaluate", WORK / "coarse", "--truth", SCAN).returncode, 0)


class Export(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.corners = corners_of(export("run.stl", "--units", "m")[0])
        cls.trajectory = readers.read_tum((RUN / "trajectory.tum").read_text())

    def test_height_colors_follow_the_height(self):
        parts = [m["entities"][0]["triangles"][0] for _, m in readers.Mcap(export("height.mcap", "--any-log")[0]).of("/surface")]
        z = [point["z"] for part in parts for point in part["points"]]
        red = [color["r"] for part in parts for color in part["colors"]]
        self.assertLess(red[np.argmax(z)], 0.12)  # -z is out of the object
        self.assertGreater(red[np.argmin(z)], 0.86)
        self.assertIn(b"uchar red", export("height.ply", "--color", "height")[0][:1000])
        self.assertNotIn(b"uchar red", export("plain.ply")[0][:1000])
        self.assertIn(b"COLOR_0", export("height.glb")[0])
        self.assertNotIn(b"COLOR_0", export("plain.glb", "--color", "none")[0])

    def test_a_simplified_mesh_says_its_error(self):
        stl, said = export("small.stl", "--max-error-mm", "0.02")
        self.assertRegex(said, r"simplified to \d+ of \d+ triangles, error 0\.0[0-2]\d* mm")
        self.assertLess(len(corners_of(stl)), len(self.corners) / 3)

    @needs_open3d
    def test_a_closed_body_is_closed_in_every_file(self):
        stl, said = export("body.stl", "--watertight", "--close", "--max-error-mm", "0.02")
        self.assertRegex(said, r"made watertight: a closed body of [\d.]+ mm3, \d+ % of its surface touched")
        corners = corners_of(stl)
        places = [tuple(map(tuple, t)) for t in corners.tolist()]
        edges = collections.Counter((t[k], t[(k + 1) % 3]) for t in places for k in range(3))
        self.assertEqual({edges[edge] - edges[edge[::-1]] for edge in edges}, {0}, "as many triangles each way")
        volume = np.einsum("ij,ij->i", corners[:, 0], np.cross(corners[:, 1], corners[:, 2])).sum(dtype=float) / 6
        self.assertAlmostEqual(volume / float(re.search(r"body of ([\d.]+)", said)[1]), 1, places=1)

    @needs_open3d
    def test_a_watertight_surface_ends_where_nothing_was_touched(self):
        stl, said = export("open.stl", "--watertight", exit_code=1)
        self.assertRegex(said, r"warning: not watertight: .* open beyond \(--close makes a closed body\)")
        self.assertNotIn("made watertight", said)
        reach_mm = float(re.search(r"gaps up to ([\d.]+) mm wide", said)[1]) / 2
        made, touched = corners_of(stl).reshape(-1, 3), 1000 * self.corners.reshape(-1, 3)
        longest = 1000 * np.linalg.norm(self.corners - np.roll(self.corners, 1, axis=1), axis=2).max()
        for vertex in made[::593]:
            self.assertLess(np.linalg.norm(touched - vertex, axis=1).min(), math.hypot(1.05 * reach_mm, longest))
        for vertex in touched[::593]:  # and goes through what was touched
            self.assertLess(np.linalg.norm(made - vertex, axis=1).min(), longest)
        with_one_core = subprocess.run(
            ["taskset", "-c", str(min(os.sched_getaffinity(0))), PROGRAM, "export", RUN, "-o", WORK / "one_core.stl", "--watertight", "-q"], capture_output=True, text=True)
        self.assertEqual(with_one_core.returncode, 1)
        self.assertIn("not watertight", with_one_core.stderr)
        self.assertEqual((WORK / "one_core.stl").read_bytes(), stl)

    @unittest.skipIf(os.environ["GELSLAM_OPEN3D"] == "1", "built with Open3D")
    def test_without_open3d_it_says_so(self):
        said = gelslam("export", RUN, "-o", WORK / "no.stl", "--watertight")
        self.assertEqual((said.returncode, said.stderr),
                         (2, "gelslam: error: watertight meshes need Open3D, and this program was built without it\n"))

    def test_a_run_with_reservations_says_them(self):
        doubtful = WORK / "doubtful"
        shutil.copytree(RUN, doubtful, dirs_exist_ok=True)
        report = json.loads((doubtful / "report.json").read_text())
        report["result_warnings"], report["warnings"] = ["2 components not joined"], ["the gel may be dirty"]
        (doubtful / "report.json").write_text(json.dumps(report))
        ply, said = export("doubtful.ply", source=doubtful)
        self.assertIn("warning: 2 components not joined\n", said)
        self.assertNotIn("dirty", said, "was said when the run was made")
        self.assertIn("2 components not joined", gelslam("info", doubtful).stdout)

    def test_mcap_holds_poses_pictures_and_surface(self):
        mcap = readers.Mcap(export("run.mcap", "--any-log")[0])
        for key in ("/sensor", "/tf"):
            self.assertEqual([t for t, _ in mcap.of(key)], [round(p[0] * 1e9) for p in self.trajectory])
        covariances = np.load(RUN / "covariances.npy")
        for (_, message), pose, covariance in zip(mcap.of("/sensor"), self.trajectory, covariances):
            np.testing.assert_allclose(message["covariance"], covariance.ravel(), rtol=1e-12)
            position, q = message["pose"]["position"], message["pose"]["orientation"]
            again = matrix((0, position["x"], position["y"], position["z"], q["x"], q["y"], q["z"], q["w"]))
            np.testing.assert_allclose(again, matrix(pose), atol=1e-8)
        keyframes = readers.read_tum((RUN / "keyframes.tum").read_text())
        self.assertEqual(len(mcap.of("/keyframe")), len(keyframes))
        self.assertEqual(len(mcap.of("/keyframes")[0][1]["poses"]), len(keyframes))
        parts = [m["entities"][0] for _, m in mcap.of("/surface")]
        self.assertEqual(len({part["id"] for part in parts}), len(parts))
        corners = []
        for triangles in (part["triangles"][0] for part in parts):
            self.assertLessEqual(len(triangles["indices"]), 3 * 5000)
            self.assertEqual(len(set(triangles["indices"])), len(triangles["points"]))
            points = np.array([(p["x"], p["y"], p["z"]) for p in triangles["points"]])
            corners.append(points[triangles["indices"]].reshape(-1, 3, 3))
        np.testing.assert_allclose(np.concatenate(corners), self.corners, atol=2e-9)
        line = mcap.of("/path")[0][1]["entities"][0]["lines"][0]
        self.assertEqual(set(line), {"type", "pose", "thickness", "scale_invariant", "points", "color", "colors", "indices"})
        frames = json.loads((RUN / "report.json").read_text())["frames"]["total"]
        pictures = mcap.of("/tactile")
        self.assertEqual(len(pictures), frames)
        self.assertEqual([t for t, _ in pictures], [round(i / 25 * 1e9) for i in range(frames)])
        self.assertEqual(base64.b64decode(pictures[0][1]["data"])[:3], b"\xff\xd8\xff")
        self.assertEqual({s for s, _ in mcap.schemas.values()}, {s for _, s in mcap.channels.values()})
        for _, (name, schema) in sorted(mcap.schemas.items()):
            self.assertEqual(schema["title"], name)

    def test_mcap_without_the_log_says_so(self):
        moved = WORK / "moved"
        shutil.copytree(RUN, moved, dirs_exist_ok=True)
        report = json.loads((moved / "report.json").read_text())
        (moved / "report.json").write_text(json.dumps({**report, "log": "/nowhere/\x1b[31m\a/log.avi"}))
        data, said = export("moved.mcap", "--any-log", source=moved)
        self.assertIn("no pictures: ", said)
        self.assertIn("/nowhere/ [31m /log.avi", said)
        mcap = readers.Mcap(data)
        self.assertEqual(mcap.of("/tactile"), [])
        self.assertEqual(len(mcap.of("/sensor")), len(self.trajectory))
        (moved / "report.json").write_text(json.dumps({**report, "log": str(SCAN)}))
        data, said = export("moved.mcap", source=moved)
        self.assertIn("is not beside the run; --any-log takes it all the same", said)
        self.assertEqual(readers.Mcap(data).of("/tactile"), [])
        shutil.copytree(SCAN, WORK / "beside")
        (moved / "report.json").write_text(json.dumps({**report, "log": str(WORK / "beside")}))
        self.assertEqual(len(readers.Mcap(export("moved.mcap", source=moved)[0]).of("/tactile")), report["frames"]["total"])
        (moved / "report.json").write_text(json.dumps(report))
        (moved / "config.yaml").write_text("device_config: [")  # says at what size pictures were tracked
        data, said = export("moved.mcap", "--any-log", source=moved)
        self.assertIn("config.yaml", said)
        self.assertEqual(len(readers.Mcap(data).of("/sensor")), len(self.trajectory))
        (moved / "mesh.ply").unlink()
        data, said = export("moved.mcap", "--any-log", source=moved)
        self.assertIn("no mesh: the run has none", said)
        self.assertEqual(readers.Mcap(data).of("/surface"), [])

    def test_a_log_that_knows_its_time_lies_beside_a_robots_bag(self):
        pictures = readers.Mcap(export("run.mcap", "--any-log")[0]).of("/tactile")
        start_us = 1764268461123457
        times_us = [start_us + t // 1000 for t, _ in pictures]
        named = WORK / "named"
        named.mkdir()
        for time_us, (_, message) in zip(times_us, pictures):
            (named / f"cam_{time_us}.jpg").write_bytes(base64.b64decode(message["data"]))
        shutil.copy(SCAN / "config.yaml", named)
        timed, run, again, zero = WORK / "timed.mkv", WORK / "timed", WORK / "timed_again", WORK / "timed_zero"
        for arguments in (("record", "--from", named, "-o", timed, "--model", SCAN / "model.json"), ("reconstruct", timed, "-o", run),
                          ("reconstruct", named, "-o", again, "--model", SCAN / "model.json"), ("reconstruct", timed, "-o", zero, "--time", "start")):
            result = gelslam(*arguments, "-q")
            self.assertEqual(result.returncode, 0, result.stderr)
        text = (run / "trajectory.tum").read_text()
        self.assertEqual(text, (again / "trajectory.tum").read_text(), "a folder and its log")
        self.assertRegex(text, r"\A1764268\d{3}\.\d{6} ")
        at_us = [round(float(line.split()[0]) * 1e6) for line in text.splitlines()]
        self.assertLessEqual(set(at_us), set(times_us))
        from_start = readers.read_tum((zero / "trajectory.tum").read_text())
        self.assertEqual([round(p[0] * 1e6) + start_us for p in from_start], at_us)
        self.assertEqual([line.split()[1:] for line in text.splitlines()],
                         [line.split()[1:] for line in (zero / "trajectory.tum").read_text().splitlines()], "only times differ")
        self.assertEqual(json.loads((run / "report.json").read_text())["start_unix_us"], start_us)
        self.assertNotIn("start_unix_us", json.loads((zero / "report.json").read_text()))
        self.assertRegex(gelslam("info", timed).stdout, r"times +from 2025-11-27 18:34:21\.123457 UTC")
        self.assertRegex(gelslam("info", SCAN).stdout, r"times +from 0; it does not say when it was recorded")

        data, said = export("timed.mcap", "--any-log", source=run)
        self.assertNotIn("times from 0", said)
        self.assertIn("times from 0: the log does not say when it was recorded", export("zero.mcap", "--any-log", source=zero)[1])
        ours = readers.Mcap(data)
        self.assertEqual([t for t, _ in ours.of("/tactile")], [1000 * t for t in times_us])
        self.assertEqual([t for t, _ in ours.of("/sensor")], [1000 * t for t in at_us])
        self.assertEqual({t for topic in ("/surface", "/trajectory", "/path") for t, _ in ours.of(topic)}, {1000 * start_us})
        robot = WORK / "robot.mcap"
        robot.write_bytes(readers.robot_bag("/joints", [1000 * t for t in times_us]))
        self.assertEqual(gelslam("evaluate", run, "--truth", SCAN).returncode, 0, "times on the clock are frames of the truth")

    def test_mcap_of_a_continued_run_has_the_pictures_of_each_log_at_its_time(self):
        both = WORK / "both"
        result = gelslam("reconstruct", SCAN, "--continue", RUN, "-o", both, "-q")
        self.assertEqual(result.returncode, 0, result.stderr)
        frames = json.loads((RUN / "report.json").read_text())["frames"]["total"]
        once = [i / 25 for i in range(frames)]
        times = [round(t * 1e9) for t in once + [once[-1] + 1 + t for t in once]]
        mcap = readers.Mcap(export("both.mcap", "--any-log", source=both)[0])
        pictures = mcap.of("/tactile")
        self.assertEqual([t for t, _ in pictures], times)
        self.assertEqual([m["data"] for _, m in pictures[:frames]], [m["data"] for _, m in pictures[frames:]])
        poses = [t for t, _ in mcap.of("/sensor")]
        self.assertLessEqual(set(poses), set(times))
        self.assertGreater(max(poses), times[frames])
        report = json.loads((both / "report.json").read_text())
        report["logs"][0]["file"] = "/nowhere/log.avi"
        (both / "report.json").write_text(json.dumps(report))
        data, said = export("half.mcap", "--any-log", source=both)
        self.assertIn("not all pictures: ", said)
        self.assertIn("/nowhere/log.avi", said)
        self.assertEqual([t for t, _ in readers.Mcap(data).of("/tactile")], times[frames:])

    def test_the_page_holds_the_run(self):
        text = export("run.html")[0].decode()
        data, ply = readers.read_page(text)
        self.assertEqual(ply, export("plain.ply")[0])
        self.assertEqual(sum(len(s) for s in data["strips"]), 3 * len(self.trajectory))
        np.testing.assert_allclose(data["strips"][0][:3], self.trajectory[0][1:4], atol=1e-8)
        figures = dict(data["figures"])
        report = json.loads((RUN / "report.json").read_text())
        self.assertEqual(figures["Keyframes"], str(report["keyframes"]))
        self.assertIn(f"{report['frames']['tracked']} of {report['frames']['total']} tracked", figures["Frames"])
        self.assertIn(f"{len(self.corners)} triangles", figures["Mesh"])
        self.assertNotIn(str(SCAN.parent), json.dumps(data), "where the log lies is nobody's business")
        for word in ("http:", "https:", "src=", "import("):
            self.assertNotIn(word, text, "the page needs no network")

    @unittest.skipUnless(shutil.which("chromium"), "needs chromium")
    def test_a_browser_draws_the_page(self):
        export("run.html", "--max-error-mm", "0.02")
        picture = WORK / "page.png"
        subprocess.run(
            ["chromium", "--headless", "--no-sandbox", "--disable-quic", "--no-first-run", "--disable-background-networking",
             "--disable-component-update", "--disable-sync", "--use-angle=swiftshader", "--enable-unsafe-swiftshader",
             f"--user-data-dir={WORK}/chromium", "--window-size=900,600", "--virtual-time-budget=3000",
             f"--screenshot={picture}", (WORK / "run.html").as_uri()], capture_output=True, timeout=60, check=True)
        import matplotlib.image
        pixels = matplotlib.image.imread(picture)[100:500, 50:500, :3]
        background = np.array([0.047, 0.055, 0.067])
        self.assertGreater((np.abs(pixels - background).max(axis=2) > 0.05).mean(), 0.03, "the surface is there")

    def test_mistakes_are_one_line(self):
        mesh = RUN / "mesh.ply"
        (WORK / "there.glb").write_text("mine")
        export("one.stl")
        for arguments, words in [
            ((RUN, "-o", WORK / "a.abc"), "has to end in .ply"),
            ((RUN, "-o", WORK / "noending"), "has to end in .ply"),
            ((RUN,), "--output is required"),
            ((RUN, "-o", WORK / "there.glb"), "--overwrite"),
            ((RUN, "-o", WORK / "a.stl", "--color", "height"), "--color has no meaning for .stl files"),
            ((RUN, "-o", WORK / "a.glb", "--units", "mm"), "--units has no meaning for .glb files"),
            ((RUN, "-o", WORK / "a.tum", "--max-error-mm", "0.1"), "--max-error-mm has no meaning for .tum files"),
            ((RUN, "-o", WORK / "a.tum", "--watertight"), "--watertight has no meaning for .tum files"),
            ((RUN, "-o", WORK / "a.stl", "--close"), "--close requires --watertight"),
            ((RUN, "-o", WORK / "a.ply", "--max-error-mm", "0,1"), "write a point"),
            ((RUN, "-o", WORK / "a.ply", "--max-error-mm", "-1"), "is no number from"),
            ((RUN, "-o", WORK / "nowhere/a.glb"), "there is no folder"),
            ((mesh, "-o", WORK / "a.mcap"), "give a run folder"),
            ((WORK / "one.stl", "-o", WORK / "a.html", "--color", "confidence"), "no confidence to color it by"),
            ((mesh, "-o", WORK / "a.tum"), "give a run folder"),
            ((SCAN, "-o", WORK / "a.glb"), "no run folder"),
            ((WORK / "there.glb", "-o", WORK / "a.ply"), ".stl (GLB is written only)"),
            ((WORK / "missing", "-o", WORK / "a.glb"), "no such file or folder"),
        ]:
            result = gelslam("export", *arguments)
            self.assertEqual(result.returncode, 2, arguments)
            self.assertEqual(result.stderr.count("\n"), 1, result.stderr)
            self.assertIn(words, result.stderr)
        self.assertEqual((WORK / "there.glb").read_text(), "mine")
        self.assertEqual(list(WORK.glob("a.*")) + list(WORK.glob(".tmp*")), [], "nothing is left behind")


if __name__ == "__main__":
    unittest.main()
