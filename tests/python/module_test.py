"""The Python module against the program, the simulated truth, and itself."""
import contextlib
import gc
import json
import os
import pathlib
import pickle
import shutil
import signal
import sqlite3
import subprocess
import tempfile
import threading
import time
import types
import unittest
import unittest.mock

import gelslam
import matplotlib.pyplot as plt
import numpy as np

import simulated

A, B = 20, 24  # frames of two touches that overlap
SAME_FLAGS = "GELSLAM_OTHER_FLAGS" not in os.environ  # .ci/sanitize: the program is compiled with other flags


class Module(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.temporary = tempfile.TemporaryDirectory()
        cls.addClassCleanup(cls.temporary.cleanup)
        cls.folder = pathlib.Path(cls.temporary.name)
        subprocess.run([simulated.PROGRAM, "reconstruct", simulated.SCAN, "--model", simulated.MODEL, "-o",
                        cls.folder / "program", "-q"], check=True)
        cls.run_ = gelslam.reconstruct(simulated.SCAN, simulated.MODEL)
        cls.run_.save(cls.folder / "module")
        cls.frames = simulated.frames()
        cls.images = [image for image, _ in cls.frames]

    @unittest.skipUnless(SAME_FLAGS, "the program is compiled with other flags")
    def test_writes_the_files_that_the_program_writes(self):
        for name in ["mesh.ply", "trajectory.tum", "keyframes.tum", "pose_graph.g2o", "config.yaml"]:
            self.assertEqual((self.folder / "module" / name).read_bytes(),
                             (self.folder / "program" / name).read_bytes(), name)
        self.assertEqual(*(simulated.rows_of(self.folder / run / "session.db") for run in ["module", "program"]))

    def test_arrays_are_what_the_files_say(self):
        tum = np.loadtxt(self.folder / "module/trajectory.tum")
        np.testing.assert_allclose(self.run_.times, tum[:, 0], atol=1e-9)
        np.testing.assert_allclose(self.run_.trajectory[:, :3, 3], tum[:, 1:4], atol=1e-9)
        x, y, z, w = tum[:, 4:].T
        np.testing.assert_allclose(self.run_.trajectory[:, 0, 1], 2 * (x * y - z * w), atol=1e-9)
        np.testing.assert_allclose(self.run_.trajectory[:, 2, 0], 2 * (x * z - y * w), atol=1e-9)
        saved = gelslam.Run(self.folder / "module")
        for name in ["vertices", "normals", "triangles"]:
            np.testing.assert_allclose(getattr(saved.mesh, name), getattr(self.run_.mesh, name), atol=1e-7)
        self.assertEqual(saved.report["frames"], self.run_.report["frames"])
        np.testing.assert_allclose(saved.trajectory, self.run_.trajectory, atol=1e-9)

    def test_the_covariance_of_a_frame_is_that_of_the_stream(self):
        lines = subprocess.run([simulated.PROGRAM, "track", simulated.SCAN, "--model", simulated.MODEL, "--format", "ndjson",
                                "-q"], check=True, capture_output=True, text=True).stdout.splitlines()
        streamed = {line["frame"]: line for line in map(json.loads, lines)}
        slam, compared = gelslam.Slam(simulated.sensor(self.images)), 0
        for number, (image, time_s) in list(enumerate(self.frames))[10:]:
            frame = slam.process(image, time_s)
            if frame.covariance is None:
                self.assertIsNone(streamed[number]["covariance"])
                continue
            self.assertEqual(frame.covariance.shape, (6, 6))
            np.testing.assert_allclose(1e6 * np.diag(frame.covariance)[:3], frame.sigma_mm ** 2, rtol=1e-9)
            np.testing.assert_allclose(np.diag(frame.covariance)[3:], frame.sigma_rad ** 2, rtol=1e-9)
            if frame.trial == 0 and streamed[number]["trial"] == 0:
                of_stream = np.reshape(streamed[number]["covariance"], (6, 6))
                np.testing.assert_allclose(frame.covariance, of_stream, rtol=1e-3 if SAME_FLAGS else 0.1, atol=1e-12 if SAME_FLAGS else 1e-8)
                compared += 1
        self.assertGreater(compared, 10)

    def test_the_map_of_a_run(self):
        truth = np.array([simulated.true_start_T_sensor(number) for number in self.run_.frames])
        found = np.linalg.inv(self.run_.trajectory[0]) @ self.run_.trajectory
        exact = np.linalg.inv(truth[0]) @ truth
        np.testing.assert_allclose(found[:, :3, 3], exact[:, :3, 3], atol=0.3e-3)  # so the numbers are right
        read = gelslam.read_run(self.folder / "module")
        np.testing.assert_array_equal(read.frames, self.run_.frames)
        self.assertEqual((self.run_.folder, read.folder), (None, self.folder / "module"))
        noise = self.run_.covariances
        self.assertEqual(noise.shape, (len(truth), 6, 6))
        np.testing.assert_allclose(read.covariances, noise, rtol=1e-12, atol=0)
        np.testing.assert_array_equal(np.load(self.folder / "module/covariances.npy"), noise)
        self.assertTrue((np.linalg.eigvalsh(noise) > -1e-15).all())
        error = (np.linalg.inv(found) @ exact)[:, :3, 3]
        self.assertTrue((np.abs(error) < 5 * np.sqrt(np.diagonal(noise, axis1=1, axis2=2)[:, :3] + noise[0].diagonal()[:3])).all())
        made, saved = self.run_.keyframes, read.keyframes
        tum = np.loadtxt(self.folder / "module/keyframes.tum")
        self.assertEqual(len(made), len(tum))
        self.assertGreater(len(made), 2)
        for line, a, b in zip(tum, made, saved):
            self.assertEqual(a.frame, b.frame)
            np.testing.assert_allclose([a.time_s, *a.map_T_sensor[:3, 3]], line[:4], atol=1e-9)
            np.testing.assert_allclose(b.map_T_sensor, a.map_T_sensor, atol=1e-9)
            np.testing.assert_array_equal(b.surface.height_mm, a.surface.height_mm)
            self.assertIsNone(b.covariance)
        sigma = np.array([np.sqrt(np.diag(keyframe.covariance)) for keyframe in made])
        is_anchor = np.array([np.allclose(keyframe.map_T_sensor, np.eye(4)) for keyframe in made])
        self.assertEqual((is_anchor.sum(), sigma[is_anchor].max()), (1, 0), "the map's frame is a keyframe's")
        self.assertTrue((sigma[~is_anchor, :3] > 1e-6).all() and (sigma[~is_anchor, :3] < 2e-4).all(), "meters come first")
        self.assertTrue((sigma[~is_anchor, 3:] > 3e-4).all() and (sigma[~is_anchor, 3:] < 0.3).all(), "then radians")

    def test_runs_are_evaluated_and_exported_as_by_the_program(self):
        with unittest.mock.patch("gelslam._find_program", lambda: simulated.PROGRAM):
            told = subprocess.run([simulated.PROGRAM, "evaluate", self.folder / "program", "--truth", simulated.SCAN, "--json"],
                                  check=True, capture_output=True, text=True).stdout
            made, read = self.run_.evaluate(simulated.SCAN), gelslam.read_run(self.folder / "module").evaluate(simulated.SCAN)
            if SAME_FLAGS:
                self.assertEqual((made, read), (json.loads(told), json.loads(told)))
            self.run_.export(self.folder / "coarse.ply", max_error_mm=0.05, units="mm")
            subprocess.run([simulated.PROGRAM, "export", self.folder / "program", "-o", self.folder / "coarse_program.ply",
                            "--max-error-mm", "0.05", "--units", "mm", "-q"], check=True)
            if SAME_FLAGS:
                self.assertEqual((self.folder / "coarse.ply").read_bytes(), (self.folder / "coarse_program.ply").read_bytes())
            with self.assertRaisesRegex(gelslam.Error, r"has to end in \.ply"):
                self.run_.export(self.folder / "mesh.doc")
        with unittest.mock.patch("gelslam._find_program", lambda: None), self.assertRaisesRegex(gelslam.Error, "not installed"):
            self.run_.evaluate(simulated.SCAN)

    def test_calibrates_as_the_program_does(self):
        presses, config = self.folder / "presses", self.folder / "near.yaml"
        shutil.copytree(simulated.FOLDER / "presses", presses)
        (presses / "optics.yaml").unlink()  # the configuration's count
        config.write_text("device_config:\n  ppmm: 0.064\n  optics:\n    lens_k1: 0.02\n    camera_distance_mm: 30\n")
        subprocess.run([simulated.PROGRAM, "calibrate", "train", presses, "-o", self.folder / "program.json", "--automatic", "--steps",
                        "200", "--config", config, "-q"], capture_output=True)
        gelslam.calibrate(presses, self.folder / "module.json", config=config, steps=200)
        made = (self.folder / "module.json").read_text()
        if SAME_FLAGS:
            self.assertEqual(made, (self.folder / "program.json").read_text())
        self.assertEqual(json.loads(made)["optics"]["camera_distance_mm"], 30)
        background = plt.imread(presses / "background.png")
        plt.imsave(presses / "background.png", np.ascontiguousarray(background[..., 2::-1]))
        with self.assertRaisesRegex(gelslam.Error, "red and blue"):
            gelslam.calibrate(presses, self.folder / "swapped.json", steps=200)

    def test_surfaces_of_other_software(self):
        """A sphere of 4 mm pressed in by 0.8 mm, from its normals and from its heights; a motion that is known."""
        pitch, radius, depth = 0.08, 4.0, 0.8

        def touch(x_mm, y_mm, kind):
            x, y = np.meshgrid((np.arange(200) - 99.5) * pitch - x_mm, (np.arange(160) - 79.5) * pitch - y_mm)
            bumps = 0.05 * np.cos(3 * x) * np.cos(2.5 * y)  # so that it is no ball, on which motions do not show
            height = np.minimum(radius - np.sqrt(np.maximum(radius ** 2 - x ** 2 - y ** 2, 0)) - depth + bumps, 0)
            height[np.hypot(x, y) > radius * 0.9] = 0
            contact = height < 0
            if kind == "height":
                return gelslam.Surface.from_height(height, contact, pitch), height, contact
            gy, gx = np.gradient(height, pitch)
            normals = np.dstack([-gx, -gy, np.ones_like(gx)])
            return gelslam.Surface.from_normals(normals / np.linalg.norm(normals, axis=2, keepdims=True), contact, pitch), height, contact

        for kind in ("normals", "height"):
            surface, height, contact = touch(0, 0, kind)
            self.assertEqual(surface.pixel_pitch_mm, pitch)
            self.assertLess(np.abs(surface.height_mm - height)[contact].mean(), 0.02)
            self.assertFalse((surface.contact & ~contact).any())
            np.testing.assert_allclose(surface.sigma[surface.contact], 0.05, rtol=1e-6)
            result = gelslam.register(surface, touch(0.4, -0.3, kind)[0])
            self.assertTrue(result.ok, result.reason)
            np.testing.assert_allclose(result.target_T_reference[:2, 3], [0.4e-3, -0.3e-3], atol=0.03e-3)
            slam = gelslam.Slam(gelslam.Sensor.of_surfaces(200, 160, pitch))
            for step in range(12):
                frame = slam.process(touch(0.1 * step, 0, kind)[0], step / 25)
                self.assertEqual(frame.status, "tracked", frame.reason)
            times, poses = slam.trajectory()
            np.testing.assert_allclose(times, np.arange(12) / 25)
            run = slam.finish()
            for found in (poses, run.trajectory):
                np.testing.assert_allclose((np.linalg.inv(found[0]) @ found)[:, 0, 3], -0.1e-3 * np.arange(12), atol=0.05e-3)
            run.save(self.folder / kind)
            localizer = gelslam.Localizer(gelslam.Sensor.of_surfaces(200, 160, pitch), gelslam.Map(self.folder / kind))
            self.assertNotEqual(localizer.process(touch(0.5, 0, kind)[0], 1.0).status, "no_contact")
        loud = gelslam.Surface.from_height(height, contact, pitch, slope_sigma_rad=0.2)
        np.testing.assert_allclose(loud.sigma[loud.contact], 0.2, rtol=1e-6)

    def test_surfaces_and_meshes_go_through_pickle(self):
        for protocol in range(pickle.HIGHEST_PROTOCOL + 1):
            mesh = pickle.loads(pickle.dumps(self.run_.mesh, protocol))
            for name in ["vertices", "normals", "triangles", "confidence"]:
                np.testing.assert_array_equal(getattr(mesh, name), getattr(self.run_.mesh, name))
        sensor = simulated.sensor(self.images)
        a, b = sensor(self.images[A]), sensor(self.images[B])
        again = pickle.loads(pickle.dumps(a, 0))
        for name in ["height_mm", "normals", "curvature", "contact", "sigma", "contact_pixels", "pixel_pitch_mm",
                     "zero_is_bare_gel"]:
            np.testing.assert_array_equal(getattr(again, name), getattr(a, name))
        np.testing.assert_array_equal(gelslam.register(again, b).target_T_reference,
                                      gelslam.register(a, b).target_T_reference)

    def test_a_mesh_for_other_packages(self):
        """Stubs: what is handed over is that of the arrays."""
        made = []
        trimesh = types.SimpleNamespace(Trimesh=lambda **arguments: made.append(arguments))
        open3d = types.SimpleNamespace(
            utility=types.SimpleNamespace(Vector3dVector=lambda rows: rows, Vector3iVector=lambda rows: rows),
            geometry=types.SimpleNamespace(TriangleMesh=lambda *rows: types.SimpleNamespace(rows=rows)))
        mesh = self.run_.mesh
        with unittest.mock.patch.dict("sys.modules", trimesh=trimesh, open3d=open3d):
            mesh.to_trimesh()
            other = mesh.to_open3d()
        for rows, name in [(made[0]["vertices"], "vertices"), (made[0]["faces"], "triangles"),
                           (made[0]["vertex_normals"], "normals"), (other.rows[0], "vertices"),
                           (other.rows[1], "triangles"), (other.vertex_normals, "normals")]:
            np.testing.assert_array_equal(rows, getattr(mesh, name))
        self.assertFalse(made[0]["process"])
        self.assertEqual(other.rows[0].dtype, np.float64)

    def test_a_log_is_read_as_often_as_wanted(self):
        with gelslam.Log(simulated.SCAN) as log:
            self.assertEqual(len(log), len(self.frames))
            first = iter(log)
            images = [next(first)[0] for _ in range(3)]
            again = list(log)
            np.testing.assert_array_equal([image for image, _ in again], self.images)
            np.testing.assert_array_equal(images, self.images[:3])
            np.testing.assert_array_equal(next(first)[0], self.images[3])  # not disturbed by the second reader
            begun = iter(log)
        with self.assertRaisesRegex(gelslam.Error, "closed"):
            next(begun)
        with self.assertRaisesRegex(gelslam.Error, "closed"):
            iter(log)
        log.close()

    def test_a_recorded_log_is_read_as_it_was_written(self):
        with gelslam.Recorder(self.folder / "own.mkv", model=simulated.MODEL) as log:
            for image, time_s in self.frames:
                log.write(image, time_s)
            with self.assertRaisesRegex(gelslam.Error, "before"):
                log.write(image, 0.0)
        with self.assertRaisesRegex(gelslam.Error, "closed"):
            log.write(image, time_s + 1)
        with self.assertRaisesRegex(gelslam.Error, "exists"):
            gelslam.Recorder(self.folder / "own.mkv")
        read = list(gelslam.Log(self.folder / "own.mkv"))
        np.testing.assert_array_equal([image for image, _ in read], self.images)
        np.testing.assert_allclose([time_s for _, time_s in read], [time_s for _, time_s in self.frames], atol=1e-6)
        np.testing.assert_array_equal(gelslam.reconstruct(self.folder / "own.mkv").trajectory, self.run_.trajectory)

    def test_frame_by_frame_gives_the_same_map(self):
        slam = gelslam.Slam(simulated.sensor(self.images))
        tracked = [slam.process(image, time_s) for image, time_s in self.frames[simulated.BARE_FRAMES:]]
        middle = slam.mesh()
        run = slam.finish()
        np.testing.assert_array_equal(run.mesh.vertices, self.run_.mesh.vertices)
        np.testing.assert_array_equal(run.trajectory, self.run_.trajectory)
        run.save(self.folder / "slam")
        models = []
        for folder in ("slam", "module"):
            with contextlib.closing(sqlite3.connect(self.folder / folder / "session.db")) as session:
                models += [row[0] for row in session.execute("SELECT model_crc32 FROM parts")]
                poses = session.execute("SELECT pose FROM poses WHERE in_map ORDER BY keyframe").fetchall()
            written = np.loadtxt(self.folder / folder / "keyframes.tum")[:, 1:4]
            places_mm = [np.frombuffer(pose, count=12).reshape(3, 4)[:, 3] for (pose,) in poses]
            np.testing.assert_allclose(np.array(places_mm) / 1000, written, atol=1e-9)
        self.assertEqual(models, 2 * models[:1], "only scans of one model are continued")
        self.assertNotEqual(models[0], 0)
        self.assertGreater(len(middle.vertices), 100)
        keyframes = [number for frame in tracked for number in frame.new_keyframes]
        self.assertIn(run.report["keyframes"] - len(keyframes), (0, 1))  # what is touched last comes at the end
        self.assertEqual(keyframes[0], next(frame.frame for frame in tracked if frame.trial is not None))
        seen = [frame for frame in tracked if frame.status == "tracked"]
        self.assertEqual(len(seen), len(run.trajectory))
        truth = [simulated.true_start_T_sensor(simulated.BARE_FRAMES + frame.frame) for frame in seen]
        error = [frame.trial_T_sensor[:3, 3] - (np.linalg.inv(truth[0]) @ pose)[:3, 3]
                 for frame, pose in zip(seen, truth)]
        self.assertLess(np.abs(error).max(), 0.3e-3)
        self.assertTrue(all((frame.sigma_mm > 0).all() for frame in seen[1:]))

    def test_registers_two_touches_as_they_were_simulated(self):
        sensor = simulated.sensor(self.images)
        result = gelslam.register(sensor(self.images[A]), sensor(self.images[B]))
        truth = np.linalg.inv(simulated.true_start_T_sensor(B)) @ simulated.true_start_T_sensor(A)
        self.assertTrue(result.ok, result.reason)
        np.testing.assert_allclose(result.target_T_reference[:3, 3], truth[:3, 3], atol=0.1e-3)
        np.testing.assert_allclose(result.target_T_reference[:3, :3], truth[:3, :3], atol=0.03)
        np.testing.assert_allclose(result.information, result.information.T, rtol=1e-6)
        weak = np.diag(3 * [1 / 0.02 ** 2] + [1, 1, 1])  # 20 mm, 1 rad
        np.testing.assert_allclose(result.covariance @ (result.information + weak), np.eye(6), atol=1e-6)
        self.assertEqual(list(result.observable), ["x", "y", "z", "rx", "ry", "rz"])
        again = gelslam.register(sensor(self.images[A]), sensor(self.images[B]),
                                 initial=result.target_T_reference)
        np.testing.assert_allclose(again.target_T_reference, result.target_T_reference, atol=1e-3)

    def test_searches_for_what_one_registration_does_not_bridge(self):
        sensor = simulated.sensor(self.images)
        a, b = sensor(self.images[A]), sensor(self.images[B])
        far = np.eye(4)
        far[0, 3] = 3e-3
        self.assertFalse(gelslam.register(a, b, initial=far).ok)
        found = gelslam.register(a, b, initial=far, search=True)
        self.assertTrue(found.ok, found.reason)
        np.testing.assert_allclose(found.target_T_reference, gelslam.register(a, b).target_T_reference, atol=2e-3)

    def test_a_surface_can_depend_on_its_picture_alone(self):
        dim = (self.images[A] * 0.9).astype(np.uint8)

        def heights(pictures, **options):
            sensor = gelslam.Sensor(simulated.MODEL, background=self.images[:simulated.BARE_FRAMES], **options)
            return [sensor(picture).height_mm.copy() for picture in pictures]

        with self.assertWarnsRegex(UserWarning, "image: the gel has not the background's light"):
            first, _, again = heights([self.images[A], dim, self.images[A]], follow_light=False)
        np.testing.assert_array_equal(first, again)
        bright, followed = heights([self.images[A], dim])
        _, not_followed = heights([self.images[A], dim], follow_light=False)
        self.assertLess(np.abs(followed - bright).max(), 0.5 * np.abs(not_followed - bright).max())

    def test_what_is_uncertain_is_said(self):
        self.assertEqual(self.run_.warnings, [])
        self.assertEqual(self.run_.report["result_warnings"], [])
        doubtful = self.folder / "doubtful"
        self.run_.save(doubtful)
        report = json.loads((doubtful / "report.json").read_text())
        report["warnings"], report["result_warnings"] = ["the log is cut off"], ["poses may be off by 2 mm"]
        (doubtful / "report.json").write_text(json.dumps(report))
        self.assertEqual(gelslam.Run(doubtful).warnings, ["the log is cut off", "poses may be off by 2 mm"])

    def test_surface_arrays(self):
        surface = simulated.sensor(self.images)(self.images[A])
        height, width = self.images[A].shape[:2]
        self.assertEqual(surface.height_mm.shape, (height, width))
        self.assertEqual(surface.normals.shape, (height, width, 3))
        self.assertEqual(surface.contact.dtype, bool)
        self.assertEqual(surface.contact.sum(), surface.contact_pixels)
        np.testing.assert_allclose(np.linalg.norm(surface.normals, axis=2), 1, atol=1e-4)
        self.assertLess(surface.height_mm[surface.contact].mean(), -0.1)
        self.assertTrue(np.isinf(surface.sigma[~surface.contact]).all())
        self.assertTrue((surface.sigma[surface.contact] > 0.005).all())
        # Normals are those of the heights: an independent difference quotient agrees inside the contact.
        slope = np.gradient(surface.height_mm, surface.pixel_pitch_mm, axis=1)
        read = -surface.normals[..., 0] / surface.normals[..., 2]
        self.assertLess(np.median(np.abs(slope - read)[surface.contact]), 0.05)

    def test_arrays_keep_their_memory_and_are_read_only(self):
        sensor = simulated.sensor(self.images)
        height = sensor(self.images[A]).height_mm
        copy = height.copy()
        vertices, vertices_copy = (lambda mesh: (mesh.vertices, mesh.vertices.copy()))(self.run_.mesh)
        gc.collect()
        for image in self.images[A:A + 5]:
            sensor(image)
        np.testing.assert_array_equal(height, copy)
        np.testing.assert_array_equal(vertices, vertices_copy)
        for array in [height, vertices]:
            with self.assertRaises(ValueError):
                array[0] = 0

    def test_any_strides_give_the_same_surface(self):
        image = self.images[A]
        expected = simulated.sensor(self.images)(image).height_mm
        larger = np.zeros((300, 400, 3), np.uint8)
        larger[7:7 + image.shape[0], 9:9 + image.shape[1]] = image
        for same in [np.asfortranarray(image), image[::-1].copy()[::-1], image[:, ::-1].copy()[:, ::-1],
                     image[..., ::-1].copy()[..., ::-1],
                     larger[7:7 + image.shape[0], 9:9 + image.shape[1]]]:
            np.testing.assert_array_equal(simulated.sensor(self.images)(same).height_mm, expected)

    def test_other_threads_run_meanwhile(self):
        worker = threading.Thread(target=gelslam.reconstruct, args=(simulated.SCAN, simulated.MODEL))
        worker.start()
        ticks = 0
        while worker.is_alive():
            time.sleep(0.001)
            ticks += 1
        self.assertGreater(ticks, 20)

    def test_threads_may_share_a_sensor_and_a_slam(self):
        slam = gelslam.Slam(simulated.sensor(self.images))
        sensor, lock, clock, done = simulated.sensor(self.images), threading.Lock(), iter(range(1000)), []

        def work():
            for image in self.images[A:A + 5]:
                surface = sensor(image)
                with lock:
                    done.append(slam.process(surface, float(next(clock))))

        workers = [threading.Thread(target=work) for _ in range(3)]
        [worker.start() for worker in workers]
        [worker.join() for worker in workers]
        self.assertEqual([frame.frame for frame in done], list(range(15)))

    def test_ctrl_c_interrupts(self):
        begin = time.monotonic()
        timer = threading.Timer(0.1, os.kill, (os.getpid(), signal.SIGINT))
        timer.start()
        with self.assertRaises(KeyboardInterrupt):
            for _ in range(20):
                gelslam.reconstruct(simulated.SCAN, simulated.MODEL)
        self.assertLess(time.monotonic() - begin, 10)

    def test_ctrl_c_interrupts_finish_and_frames_may_follow(self):
        slam = gelslam.Slam(simulated.sensor(self.images))
        for image, time_s in self.frames[simulated.BARE_FRAMES:]:
            slam.process(image, time_s)
        expected = slam.finish()
        signals = []

        def interrupt(*_):
            # Handled after finish() only, the pending signals would be one.
            signals.append(True)
            if len(signals) == 3:
                raise KeyboardInterrupt

        before = signal.signal(signal.SIGALRM, interrupt)
        self.addCleanup(signal.signal, signal.SIGALRM, before)
        self.addCleanup(signal.setitimer, signal.ITIMER_REAL, 0)
        with self.assertRaises(KeyboardInterrupt):
            signal.setitimer(signal.ITIMER_REAL, 0.001, 0.001)
            slam.finish()
        signal.setitimer(signal.ITIMER_REAL, 0)
        np.testing.assert_array_equal(slam.finish().mesh.vertices, expected.mesh.vertices)

    def test_progress_is_told(self):
        told = []
        gelslam.reconstruct(simulated.SCAN, simulated.MODEL, progress=lambda *words: told.append(words))
        self.assertEqual(told[0], ("tracking", 0, len(self.frames)))
        self.assertIn(("tracking", len(self.frames), len(self.frames)), told)
        self.assertEqual(told[-1][0], "fusing")

        def fail(*words):
            raise ZeroDivisionError

        with self.assertRaises(ZeroDivisionError):
            gelslam.reconstruct(simulated.SCAN, simulated.MODEL, progress=fail)


if __name__ == "__main__":
    unittest.main()
