"""Every mistake is one exception with one line; the interpreter lives on."""
import itertools
import os
import pathlib
import pickle
import subprocess
import sys
import tempfile
import unittest

import gelslam
import numpy as np

import simulated


class Misuse(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.images = [image for image, _ in simulated.frames()]
        cls.sensor = simulated.sensor(cls.images)

    def refused(self, kind, words, function, *arguments, **named):
        with self.assertRaises(kind) as caught:
            function(*arguments, **named)
        self.assertIn(words, str(caught.exception))
        if kind is gelslam.Error:
            self.assertNotIn("\n", str(caught.exception))

    def test_pictures(self):
        image = self.images[20]
        for words, wrong in [("NumPy array, got list", image.tolist()), ("got NoneType", None), ("got str", "touch.png"),
                             ("got float64", image.astype(float)), ("got int8", image.view(np.int8))]:
            self.refused(TypeError, words, self.sensor, wrong)
        for words, wrong in [("(240, 320)", image[..., 0]), ("(320, 3)", image[0]), ("(3, 240, 320)", image.transpose(2, 0, 1)),
                             ("(240, 320, 4)", np.zeros((240, 320, 4), np.uint8)), ("(0, 320, 3)", image[:0]),
                             ("image", image[:100]), ("image", np.zeros((320, 240, 3), np.uint8)),
                             ("this size", np.broadcast_to(image[:1], (10 ** 6, 320, 3)))]:
            self.refused(gelslam.Error, words, self.sensor, wrong)
        self.sensor(image)  # still works

    def test_sensors(self):
        background = self.images[0]
        self.refused(gelslam.Error, "no-model", gelslam.Sensor, "no-model.pth", background=background)
        self.refused(gelslam.Error, "give model", gelslam.Sensor, background=background)
        self.refused(gelslam.Error, "background", gelslam.Sensor, simulated.MODEL, background=[])
        self.refused(gelslam.Error, "background", gelslam.Sensor, simulated.MODEL, background=background[:90])
        self.refused(gelslam.Error, "no-image", gelslam.Sensor, simulated.MODEL, background="no-image.png")
        self.refused(TypeError, "background", gelslam.Sensor, simulated.MODEL, background=7)
        self.refused(TypeError, "", gelslam.Sensor, simulated.MODEL)
        self.refused(gelslam.Error, "", gelslam.Sensor, simulated.SCAN / "gelsight.avi", background=background)
        with self.assertWarnsRegex(UserWarning, "dark") as told:  # what is wrong with it is a warning
            gelslam.Sensor(simulated.MODEL, background=np.ascontiguousarray(background // 8))
        self.assertEqual(told.filename, __file__)

    def test_wrong_arguments_are_refused_with_those_that_are_taken(self):
        surface = self.sensor(self.images[20])
        slam = gelslam.Slam(self.sensor)
        for words, function, arguments, named in [
                ("gelslam._core.Sensor(model: ", gelslam.Sensor, (5,), {"background": "x.png"}),
                ("(reference: gelslam._core.Surface, target: ", gelslam.register, (surface,), {}),
                ("(self: gelslam._core.Slam, surface: ", slam.process, (surface, "now"), {}),
                ("(log: ", gelslam.reconstruct, ("scan.avi",), {"stride": 2})]:
            self.refused(TypeError, words, function, *arguments, **named)

    def test_registrations(self):
        surface = self.sensor(self.images[20])
        self.refused(TypeError, "", gelslam.register, surface, self.images[20])
        self.refused(TypeError, "", gelslam.register, surface, None)
        self.refused(gelslam.Error, "4x4", gelslam.register, surface, surface, initial=np.eye(3))
        self.refused(gelslam.Error, "rigid", gelslam.register, surface, surface, initial=2 * np.eye(4))
        self.refused(gelslam.Error, "rigid", gelslam.register, surface, surface, initial=np.full((4, 4), np.nan))
        self.refused(TypeError, "numbers", gelslam.register, surface, surface, initial=np.array([["a"] * 4] * 4))
        bare = self.sensor(self.images[0])
        result = gelslam.register(bare, surface)  # nothing touches: a result, not an exception
        self.assertFalse(result.ok)
        self.assertTrue(result.reason)

    def test_surfaces_of_another_sensor(self):
        with tempfile.TemporaryDirectory() as folder:
            config = pathlib.Path(folder) / "wide.yaml"
            config.write_text("device_config:\n  ppmm: 0.1\n")
            wide = gelslam.Sensor(simulated.MODEL, background=self.images[:10], config=config)(self.images[20])
        self.refused(gelslam.Error, "0.1 mm", gelslam.register, self.sensor(self.images[20]), wide)
        self.refused(gelslam.Error, "0.1 mm", gelslam.Slam(self.sensor).process, wide, 1.0)

    def test_surfaces_of_other_software(self):
        flat, contact = np.dstack([np.zeros((60, 80)), np.zeros((60, 80)), np.ones((60, 80))]), np.zeros((60, 80), bool)
        of_normals, of_height = gelslam.Surface.from_normals, gelslam.Surface.from_height
        of_normals(flat, contact, 0.1)
        self.refused(gelslam.Error, "height x width x 3", of_normals, flat[..., 0], contact, 0.1)
        self.refused(gelslam.Error, "height x width, got", of_height, flat, contact, 0.1)
        self.refused(gelslam.Error, "contact: is 80x59", of_normals, flat, contact[:59], 0.1)
        self.refused(gelslam.Error, "out of the gel", of_normals, -flat, contact, 0.1)
        self.refused(gelslam.Error, "no sensor has", of_normals, flat[:8], contact[:8], 0.1)
        self.refused(gelslam.Error, "slope_sigma_rad", of_normals, flat, contact, 0.1, slope_sigma_rad=0)
        for pitch in [0, -1, float("nan"), 50]:
            self.refused(gelslam.Error, "no sensor has", of_normals, flat, contact, pitch)
            self.refused(gelslam.Error, "no sensor has", gelslam.Sensor.of_surfaces, 80, 60, pitch)
        self.refused(gelslam.Error, "no sensor has", gelslam.Sensor.of_surfaces, -80, 60, 0.1)
        holes = flat[..., 0].copy()
        holes[3, 4] = np.nan
        self.refused(gelslam.Error, "not finite", of_height, holes, contact, 0.1)
        self.refused(gelslam.Error, "negative heights", of_height, flat[..., 2], np.ones((60, 80), bool), 0.1)
        with self.assertWarnsRegex(UserWarning, "is it in meters?"):
            of_height(np.full((60, 80), -0.0005), np.ones((60, 80), bool), 0.1)
        self.refused(TypeError, "from_height(): incompatible", of_height, "deep", contact, 0.1)
        self.refused(gelslam.Error, "no model", gelslam.Slam(gelslam.Sensor.of_surfaces(320, 240, 0.0634)).process,
                     self.images[20], 1.0)

    def test_frames_out_of_order(self):
        slam = gelslam.Slam(self.sensor)
        slam.process(self.images[20], 1.0)
        for time_s in [1.0, 0.5, float("nan"), float("inf"), 1.7e12]:  # the last: milliseconds, which no run can hold
            self.refused(gelslam.Error, "time_s", slam.process, self.images[20], time_s)
        self.refused(TypeError, "", slam.process, self.images[20], "now")
        self.refused(TypeError, "", gelslam.Slam, None)
        slam.process(self.images[20], 1.5)

    def test_what_no_constructor_has_made_is_refused(self):
        words = "was not made by its constructor"
        for kind in vars(gelslam).values():
            if not isinstance(kind, type) or not kind.__module__.startswith("gelslam") or issubclass(kind, Exception):
                continue
            for name, attribute in vars(kind).items():
                if isinstance(attribute, property):
                    self.refused(TypeError, words, getattr, kind.__new__(kind), name)
                elif name in ("__repr__", "__next__", "__len__", "__getstate__"):
                    self.refused(TypeError, words, attribute, kind.__new__(kind))
        surface, sensor, log = (kind.__new__(kind) for kind in (gelslam.Surface, gelslam.Sensor, gelslam.Log))
        self.refused(TypeError, words, gelslam.register, surface, surface)
        self.refused(TypeError, words, sensor, self.images[20])
        self.refused(TypeError, words, list, log)

    def test_what_is_not_to_be_pickled(self):
        for protocol in range(pickle.HIGHEST_PROTOCOL + 1):
            for what in (gelslam.Log(simulated.SCAN), gelslam.Slam(self.sensor)):
                self.refused(TypeError, "cannot pickle", pickle.dumps, what, protocol)

    def test_a_pickle_of_anything_else(self):
        for whole in (self.sensor(self.images[20]), gelslam.Slam(self.sensor).finish().mesh):
            state = whole.__getstate__()
            for wrong in [(), (1,), tuple(reversed(state)), (None,) * len(state), ("x",) * len(state), state[:-1]]:
                self.refused(gelslam.Error, "no pickled", type(whole).__new__(type(whole)).__setstate__, wrong)

    def test_a_thread_that_works_while_the_interpreter_ends(self):
        script = f"""
import threading, time, sys
sys.path[:0] = {sys.path!r}
import gelslam, simulated
threading.Thread(target=gelslam.reconstruct, args=(simulated.SCAN, simulated.MODEL), kwargs={{"progress": %s}}, daemon=True).start()
time.sleep(%s)
"""
        for progress in ("False", "lambda *told: None"):
            for wait_s in (0.05, 0.3, 0.6):
                done = subprocess.run([sys.executable, "-c", script % (progress, wait_s)], capture_output=True, text=True)
                self.assertEqual((done.returncode, done.stderr), (0, ""))

    def test_times_of_a_recorder(self):
        with tempfile.TemporaryDirectory() as folder, gelslam.Recorder(pathlib.Path(folder) / "log.mkv") as log:
            for wrong in (float("nan"), float("inf"), -float("inf"), -1, 1.7e9):  # the last: Unix time
                self.refused(gelslam.Error, "time_s is not between 0 and 1e9; count the seconds from the first",
                             log.write, self.images[0], wrong)

    def test_a_forged_pickle(self):
        function, arguments, *rest = self.sensor(self.images[20]).__reduce_ex__(2)
        state = rest[0]
        for k in range(5):  # a map of another size than the others
            forged = list(state)
            forged[k] = np.ones((3, 4) + np.shape(state[k])[2:], dtype=np.asarray(state[k]).dtype)
            self.refused(gelslam.Error, "no pickled", function(*arguments).__setstate__, tuple(forged))
        for pitch in [0.0, float("nan"), 1e9]:
            forged = list(state)
            forged[5] = pitch
            self.refused(gelslam.Error, "no pickled", function(*arguments).__setstate__, tuple(forged))

    def test_a_map_of_nothing(self):
        run = gelslam.Slam(self.sensor).finish()
        self.assertEqual(run.trajectory.shape, (0, 4, 4))
        self.assertEqual(run.mesh.vertices.shape, (0, 3))
        self.assertEqual(run.mesh.triangles.shape, (0, 3))

    def test_files(self):
        with tempfile.TemporaryDirectory() as name:
            folder = pathlib.Path(name)
            (folder / "text.avi").write_text("no video")
            self.refused(gelslam.Error, "none.avi", gelslam.reconstruct, "none.avi", simulated.MODEL)
            self.refused(gelslam.Error, "text.avi", gelslam.reconstruct, folder / "text.avi", simulated.MODEL)
            self.refused(gelslam.Error, "none.avi", gelslam.Log, "none.avi")
            self.refused(gelslam.Error, "no?.avi", gelslam.Log, os.fsdecode(b"no\xe9.avi"))  # not UTF-8
            self.refused(gelslam.Error, "none", gelslam.read_run, folder / "none")
            self.refused(TypeError, "progress", gelslam.reconstruct, simulated.SCAN, progress=3)
            self.refused(TypeError, "", gelslam.reconstruct, 5)
            run = gelslam.Slam(self.sensor).finish()
            run.save(folder / "run")
            self.refused(gelslam.Error, "run", run.save, folder / "run")
            run.save(folder / "run", overwrite=True)
            self.refused(gelslam.Error, ".ply", run.mesh.save, folder / "mesh.abc")
            self.refused(gelslam.Error, "none", gelslam.calibrate, folder / "none", folder / "model.json")
            self.refused(gelslam.Error, "steps", gelslam.calibrate, folder, folder / "model.json", steps=0)

    @unittest.skipUnless(hasattr(gelslam, "Camera"), "built without cameras")
    def test_cameras(self):
        self.refused(gelslam.Error, "video987", gelslam.Camera, "/dev/video987")
        if "GELSLAM_OTHER_FLAGS" in os.environ:  # .ci/sanitize builds no simulation
            return
        with gelslam.Camera("simulated") as camera:
            times = [time_s for _, time_s in itertools.islice(camera, 5)]
            self.assertEqual(camera.read()[0].shape, (240, 320, 3))
        np.testing.assert_allclose(np.diff(times), 0.04)


if __name__ == "__main__":
    unittest.main()
