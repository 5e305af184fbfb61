"""Installs the C++ library, builds its examples as a project of their own, and compares them with the program."""
import json
import os
import pathlib
import re
import subprocess
import tempfile
import unittest

import numpy as np

ROOT = pathlib.Path(__file__).resolve().parents[2]
PROGRAM = os.environ["GELSLAM_PROGRAM"]
LOG = pathlib.Path(os.environ["GELSLAM_LOG"])
MODEL = str(LOG / "scan/model.json")


def run(*command):
    done = subprocess.run([str(word) for word in command], capture_output=True, text=True)
    if done.returncode:
        raise AssertionError(f"{command}: exit code {done.returncode}\n{done.stdout}{done.stderr}")
    return done.stdout


class InstalledLibrary(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.temporary = tempfile.TemporaryDirectory()
        cls.addClassCleanup(cls.temporary.cleanup)
        cls.folder = pathlib.Path(cls.temporary.name)
        cls.prefix = cls.folder / "prefix"
        run("cmake", "--install", os.environ["GELSLAM_BUILD"], "--component", "development", "--prefix", cls.prefix)
        run(*cls.configure(ROOT / "tests/package/consumer", f"-DGELSLAM_EXAMPLES={ROOT / 'examples/cpp'}"))
        run("cmake", "--build", cls.folder / "build", "--parallel", "2")

    @classmethod
    def configure(cls, project, *options):
        return ["cmake", "-S", project, "-B", cls.folder / "build", f"-DCMAKE_PREFIX_PATH={cls.prefix}",
                "-DCMAKE_BUILD_TYPE=Debug", "-DCMAKE_CXX_FLAGS=-O0 -g0", *options]

    def example(self, name, *arguments):
        return run(self.folder / "build/examples" / name, *arguments)

    def test_tracks_as_the_program_does(self):
        lines = np.loadtxt(self.example("track_video", LOG / "scan", MODEL).splitlines())
        self.assertGreater(len(lines), 30)
        frames = map(json.loads, run(PROGRAM, "track", LOG / "scan", "--model", MODEL).splitlines())
        tracked = [(frame["time_s"], *frame["pose"][3:12:4]) for frame in frames if frame["pose"]]
        np.testing.assert_allclose(lines[:, :4], tracked, atol=1e-11)

    def test_reconstructs_as_the_program_does(self):
        self.example("reconstruct_to_ply", LOG / "scan", self.folder / "mesh.ply", MODEL)
        run(PROGRAM, "reconstruct", LOG / "scan", "--model", MODEL, "-o", self.folder / "run", "-q")
        self.assertEqual((self.folder / "mesh.ply").read_bytes(), (self.folder / "run/mesh.ply").read_bytes())

    def test_registers_two_touches_as_they_were_simulated(self):
        background_frames, a, b = 10, 20, 24
        run(self.folder / "build/write_frames", LOG / "scan", self.folder)
        text = self.example("register_two_touches", MODEL, self.folder / "0.png", self.folder / f"{a}.png",
                            self.folder / f"{b}.png")
        found = np.array(re.findall(r"-?\d[\d.e+-]*", text.split(":", 1)[1])[:16], float).reshape(4, 4)
        start_T = np.load(LOG / "scan/true_start_T_currs.npy")
        truth = np.linalg.inv(start_T[b - background_frames]) @ start_T[a - background_frames]
        self.assertGreater(1000 * np.linalg.norm(truth[:3, 3]), 0.1)  # a motion worth the name
        np.testing.assert_allclose(found[:3, 3], 1000 * truth[:3, 3], atol=0.1)
        np.testing.assert_allclose(found[:3, :3], truth[:3, :3], atol=0.03)

    def test_refuses_other_versions_and_components(self):
        for asked, words in [("0.2 REQUIRED", "0.3"), ("0.3 REQUIRED COMPONENTS viewer", "has no components")]:
            project = self.folder / asked.replace(" ", "-")
            project.mkdir()
            (project / "CMakeLists.txt").write_text("cmake_minimum_required(VERSION 3.25)\nproject(mine CXX)\n"
                                                    f"find_package(gelslam {asked})\n")
            done = subprocess.run(["cmake", "-S", project, "-B", project / "build", f"-DCMAKE_PREFIX_PATH={self.prefix}"],
                                  capture_output=True, text=True)
            self.assertNotEqual(done.returncode, 0)
            self.assertIn(words, " ".join(done.stderr.split()))

    def test_installs_no_internal_header(self):
        installed = {path.parent.name for path in (self.prefix / "include/gelslam").rglob("*.hpp")}
        self.assertEqual(installed & {"viewer", "simulation", "calibration", "evaluation"}, set())
        self.assertFalse((self.prefix / "include/gelslam/slam/live_slam.hpp").exists())


if __name__ == "__main__":
    unittest.main()
