"""Localization, continued scans, merging and fusing again: against the program."""
import json
import os
import pathlib
import re
import subprocess
import tempfile
import unittest

import gelslam
import numpy as np

import simulated

SAME_FLAGS = "GELSLAM_OTHER_FLAGS" not in os.environ  # .ci/sanitize: the program is compiled with other flags
LIBRARIES = pathlib.Path(__file__).resolve().parents[2] / "libs"


def program(*words, code=0):
    done = subprocess.run([simulated.PROGRAM, *map(str, words)], capture_output=True, text=True)
    assert done.returncode == code, done.stderr
    return done.stdout


class Maps(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.temporary = tempfile.TemporaryDirectory()
        cls.addClassCleanup(cls.temporary.cleanup)
        cls.folder = pathlib.Path(cls.temporary.name)
        cls.run_ = gelslam.reconstruct(simulated.SCAN, simulated.MODEL)
        cls.run_folder = cls.folder / "run"
        cls.run_.save(cls.run_folder)
        cls.frames = simulated.frames()
        cls.touches = cls.frames[simulated.BARE_FRAMES:]
        cls.images = [image for image, _ in cls.frames]

    def same_file(self, name, *folders):
        a, b = [(self.folder / folder / name).read_bytes() for folder in folders]
        self.assertTrue(a == b or not SAME_FLAGS, name)

    def test_locates_as_the_program_does(self):
        lines = program("track", simulated.SCAN, "--model", simulated.MODEL, "--map", self.run_folder, "--format", "ndjson")
        told = {line["time_s"]: line for line in map(json.loads, lines.splitlines())}
        localizer = gelslam.Localizer(simulated.sensor(self.images), gelslam.Map(self.run_folder))
        seen = {}
        for image, time_s in self.touches:
            frame, line = localizer.process(image, time_s), told[time_s]
            self.assertEqual((frame.status, frame.reason), (line["status"], line["reason"]))
            seen[frame.status] = frame
            self.assertEqual(len(frame.places), len(line["hypotheses"]))
            for place, other in zip(frame.places, line["hypotheses"]):
                np.testing.assert_allclose(place.map_T_sensor.ravel(), other["map_pose"], atol=1e-6)
                np.testing.assert_allclose(place.sigma_mm, other["sigma_mm"], rtol=1e-3)
                self.assertAlmostEqual(place.probability, other["probability"], delta=1e-3)
            if frame.status != "localized":
                self.assertIsNone(frame.map_T_sensor)
                continue
            np.testing.assert_allclose(frame.map_T_sensor.ravel(), line["map_pose"], atol=1e-6)
            np.testing.assert_allclose(frame.covariance.ravel(), line["map_covariance"], rtol=1e-3, atol=1e-15 if SAME_FLAGS else 1e-7)
            np.testing.assert_allclose(frame.sigma_rad, np.sqrt(np.diag(frame.covariance))[3:], rtol=1e-9)
            np.testing.assert_allclose(frame.sigma_mm, 1e3 * np.sqrt(np.diag(frame.covariance))[:3], rtol=1e-9)
            k = np.flatnonzero(self.run_.times == time_s)[0]
            self.assertLess(np.linalg.norm(frame.map_T_sensor[:3, 3] - self.run_.trajectory[k, :3, 3]), 0.2e-3)
            self.assertEqual(list(frame.tracked.registration.observable), ["x", "y", "z", "rx", "ry", "rz"])
        self.assertGreaterEqual(set(seen), {"not in the map", "localized"})

    def test_a_map_is_for_its_pixel_pitch(self):
        wide = self.folder / "wide.yaml"
        wide.write_text("device_config:\n  ppmm: 0.1\n")
        sensor = gelslam.Sensor(simulated.MODEL, background=self.images[:10], config=wide)
        with self.assertRaisesRegex(gelslam.Error, "not of 0.1 mm"):
            gelslam.Localizer(sensor, gelslam.Map(self.run_folder))

    @unittest.skipUnless(hasattr(gelslam.Map, "from_mesh"), "built without the simulation")
    def test_maps_of_meshes_are_those_of_the_program(self):
        mesh = simulated.SCAN / "gt_mesh.ply"
        program("map", mesh, "--touches", 20, "-o", self.folder / "map", "-q", code=1)
        with self.assertWarnsRegex(UserWarning, r"20 touches cover; allow more touches"):
            made = gelslam.Map.from_mesh(mesh, touches=20)
        made.save(self.folder / "saved")
        for name in ["session.db", "mesh.ply", "keyframes.tum", "map.json"]:
            self.same_file(name, "map", "saved")
        read = gelslam.Map(self.folder / "map")
        self.assertEqual(len(read), 20)
        np.testing.assert_allclose(read.poses, made.poses, atol=1e-9)
        with self.assertRaisesRegex(gelslam.Error, "overwrite it"):
            made.save(self.folder / "saved")
        with self.assertRaisesRegex(gelslam.Error, "copy that folder"):
            read.save(self.folder / "again")
        with self.assertRaisesRegex(gelslam.Error, "mm, cm, in or m"):
            gelslam.Map.from_mesh(mesh, unit="ft")

    def test_goes_on_with_a_run(self):
        more = ["--model", simulated.MODEL, "--continue", self.run_folder, "-o", self.folder / "more", "-q"]
        program("reconstruct", simulated.SCAN, *more)
        run = gelslam.reconstruct(simulated.SCAN, simulated.MODEL, continue_from=self.run_folder)
        run.save(self.folder / "continued")
        for name in ["mesh.ply", "trajectory.tum"]:
            self.same_file(name, "more", "continued")
        self.assertTrue(not SAME_FLAGS or simulated.rows_of(self.folder / "more/session.db")
                        == simulated.rows_of(self.folder / "continued/session.db"))
        self.assertEqual(len(run.trajectory), 2 * len(self.run_.trajectory))
        slam = gelslam.Slam(simulated.sensor(self.images), continue_from=self.run_folder)
        frames = [slam.process(image, time_s) for image, time_s in self.touches]
        self.assertEqual({frame.trial for frame in frames} - {None}, {1})
        live = slam.finish()
        np.testing.assert_array_equal(live.trajectory, run.trajectory)
        np.testing.assert_array_equal(live.times, run.times)
        np.testing.assert_array_equal(live.mesh.vertices, run.mesh.vertices)
        with self.assertRaisesRegex(gelslam.Error, "none: no such run folder"):
            gelslam.Slam(simulated.sensor(self.images), continue_from=self.folder / "none")

    def test_merges_and_fuses_as_the_program_does(self):
        run = gelslam.fuse(self.run_folder, self.folder / "coarse", voxel_size_mm=0.15)
        program("fuse", self.run_folder, "--voxel-size-mm", 0.15, "-o", self.folder / "coarse2", "-q")
        self.same_file("mesh.ply", "coarse", "coarse2")
        self.assertLess(len(run.mesh.vertices), len(self.run_.mesh.vertices) / 2)
        both = [self.run_folder, self.folder / "coarse"]
        merged = gelslam.fuse(both, self.folder / "merged")
        program("fuse", *both, "-o", self.folder / "merged2", "-q")
        self.same_file("mesh.ply", "merged", "merged2")
        self.assertEqual(len(merged.trajectory), 2 * len(self.run_.trajectory))
        gelslam.fuse(self.folder / "coarse", voxel_size_mm=0.3)  # in place
        self.assertLess(len(gelslam.read_run(self.folder / "coarse").mesh.vertices), len(run.mesh.vertices))
        for size_mm in [50.0, float("nan")]:
            with self.assertRaisesRegex(gelslam.Error, "voxel_size_mm"):
                gelslam.fuse(self.run_folder, voxel_size_mm=size_mm, truncation_mm=100.0)

    def test_messages_of_the_libraries_name_no_option_of_the_program(self):
        without_python = ["viewer", "exchange", "evaluation", "slam/src/stream"]
        for path in LIBRARIES.rglob("*.?pp"):
            if not any(path.is_relative_to(LIBRARIES / part) for part in without_python):
                for text in re.findall(r'"(?:[^"\\\n]|\\.)*"', path.read_text()):
                    self.assertNotRegex(text, r"(?<!\w)--(?!ros-args)[a-z]", path)


if __name__ == "__main__":
    unittest.main()
