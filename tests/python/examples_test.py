"""Runs every example as a user would."""
import json
import os
import pathlib
import shutil
import socket
import subprocess
import sys
import tempfile
import threading
import unittest
import unittest.mock

import matplotlib.pyplot as plt
import numpy as np

import simulated

EXAMPLES = pathlib.Path(__file__).resolve().parents[2] / "examples/python"


class Examples(unittest.TestCase):
    def setUp(self):
        temporary = tempfile.TemporaryDirectory()
        self.addCleanup(temporary.cleanup)
        self.folder = pathlib.Path(temporary.name)

    def example(self, name, *words):
        done = subprocess.run([sys.executable, EXAMPLES / name, *map(str, words)], capture_output=True, text=True,
                              cwd=self.folder, env=os.environ)
        self.assertEqual(done.returncode, 0, done.stdout + done.stderr)
        return done.stdout

    def test_height_map(self):
        images = [image for image, _ in simulated.frames()]
        for name, frame in [("bare", 0), ("touch", 20)]:
            plt.imsave(self.folder / f"{name}.png", np.ascontiguousarray(images[frame][..., ::-1]))
        out = self.example("height_map.py", "touch.png", "--background", "bare.png", "--model", simulated.MODEL, "-o", "h.png")
        self.assertIn(f"{simulated.sensor([images[0]])(images[20]).contact_pixels} pixels in contact", out)
        self.assertGreater((self.folder / "h.png").stat().st_size, 5000)

    def test_reconstruct_video(self):
        out = self.example("reconstruct_video.py", simulated.SCAN, "--model", simulated.MODEL, "-o", "mesh.ply")
        self.assertIn("vertices", out)
        self.assertTrue((self.folder / "mesh.ply").read_bytes().startswith(b"ply"))

    @unittest.skipUnless(shutil.which("jupyter-nbconvert"), "no jupyter-nbconvert (scripts/setup.sh --tests)")
    @unittest.skipIf("GELSLAM_OTHER_FLAGS" in os.environ, "the notebook runs the program of the module (.ci/sanitize has none)")
    def test_first_touch(self):
        environment = {name: value for name, value in os.environ.items() if name != "MPLBACKEND"}  # the notebook's own
        done = subprocess.run(["jupyter-nbconvert", "--to", "notebook", "--execute", "--output-dir", self.folder,
                               EXAMPLES / "first_touch.ipynb"], capture_output=True, text=True, env=environment)
        self.assertEqual(done.returncode, 0, done.stderr)
        for folder in (EXAMPLES, self.folder):  # as it is read, and as it was run now
            cells = json.loads((folder / "first_touch.ipynb").read_text())["cells"]
            outputs = [output for cell in cells for output in cell.get("outputs", [])]
            self.assertEqual(sum("image/png" in output.get("data", {}) for output in outputs), 4)
        text = "".join("".join(output.get("text", [])) for output in outputs)
        self.assertLess(float(text.split("mean pose error ")[1].split()[0]), 0.1)

    def test_live(self):
        out = self.example("live.py", "--model", simulated.MODEL, "--log", simulated.SCAN, "-o", "run")
        self.assertGreater(out.count("trial 0"), 30)
        self.assertTrue((self.folder / "run/report.json").exists())

    def test_viewers(self):
        """With what stands in for their modules: what is logged under which name, and how much of it."""
        (self.folder / "stand_in.py").write_text("""
class Thing:
    def __init__(self, *words, **named):
        self.words, self.named = words, named
def size(thing):
    return sum(map(size, (*thing.words, *thing.named.values()))) if isinstance(thing, Thing) else (
        sum(map(size, thing)) if isinstance(thing, list) else getattr(thing, "size", 1))
def log(name, thing):
    print(name, size(thing))
def __getattr__(name):
    if name.startswith("__"):
        raise AttributeError(name)
    return Thing
""")
        (self.folder / "rerun.py").write_text("from stand_in import __getattr__, log\n")
        (self.folder / "foxglove").mkdir()
        (self.folder / "foxglove/__init__.py").write_text("from stand_in import __getattr__, log\n")
        (self.folder / "foxglove/schemas.py").write_text("from stand_in import __getattr__\n")
        with unittest.mock.patch.dict(os.environ, {"PYTHONPATH": f"{self.folder}:{os.environ['PYTHONPATH']}"}):
            for name, surface, path in [("rerun_live.py", "map/surface", "map/path"), ("foxglove_live.py", "/surface", "/path")]:
                logged = [line.split() for line in self.example(name, simulated.MODEL, simulated.SCAN).splitlines()]
                for topic in (surface, path):
                    sizes = [int(size) for topic_of_line, size in logged if topic_of_line == topic]
                    self.assertGreater(len(sizes), 2, name)
                    self.assertGreater(sizes[-1], sizes[0], f"{name}: {topic} grows")
                self.assertEqual(sum("picture" in topic for topic, _ in logged), 50)

    def test_compare_registrations(self):
        out = self.example("compare_registrations.py", simulated.SCAN, 20, 22, 24, "--model", simulated.MODEL)
        self.assertEqual(out.count("ok"), 2)
        self.assertEqual(out.count("sigma"), 12)
        out = self.example("compare_registrations.py", simulated.SCAN, 20, 2, 22, "--model", simulated.MODEL)  # 2: bare gel
        self.assertIn("frame 20 to 2: failed: ", out)
        self.assertEqual(out.count("sigma"), 6)
        wrong = subprocess.run([sys.executable, EXAMPLES / "compare_registrations.py", simulated.SCAN, "20", "22", "9999", "--model",
                                simulated.MODEL], capture_output=True, text=True, cwd=self.folder)
        self.assertEqual((wrong.returncode, wrong.stderr.count("\n")), (1, 1), wrong.stderr)
        self.assertIn("no frame 9999", wrong.stderr)

    def test_calibrate(self):
        out = self.example("calibrate.py", simulated.FOLDER / "presses", "-o", "model.json", "--steps", "300")
        self.assertIn("presses, slopes are off by", out)
        self.assertTrue((self.folder / "model.json").exists())

    @staticmethod
    def start_client(port):
        return subprocess.Popen([sys.executable, EXAMPLES / "stream_client.py", f"http://127.0.0.1:{port}/?token=7"], stdout=subprocess.PIPE,
                                stderr=subprocess.PIPE, text=True)

    @staticmethod
    def serve(server, lines):
        with server.accept()[0] as reader:
            reader.recv(10000)
            text = "".join(json.dumps(line) + "\n" for line in lines).encode()
            reader.sendall(b"HTTP/1.1 200 OK\r\nTransfer-Encoding: chunked\r\n\r\n%x\r\n%s\r\n0\r\n\r\n" % (len(text), text))

    def test_stream_client_without_a_scan_or_a_reader(self):
        with socket.create_server(("127.0.0.1", 0)) as server:
            port = server.getsockname()[1]
            client = self.start_client(port)
            client.stdout.close()
            frame = {"type": "frame", "status": "tracked", "time_s": 1.5, "trial": 2, "map_pose": 16 * [0]}
            self.serve(server, [frame])
            self.assertEqual((client.stderr.read(), client.wait()), ("", 0))
            client.stderr.close()
        client = self.start_client(port)
        _, errors = client.communicate()
        self.assertEqual(errors.count("\n"), 1, errors)
        self.assertIn("--serve PORT", errors)

    def test_stream_client(self):
        pose = [1, 0, 0, 0.001, 0, 1, 0, -0.002, 0, 0, 1, 0.0035, 0, 0, 0, 1]
        lines = [{"type": "dropped", "lines": 3}, {"type": "frame", "status": "lost"},
                 {"type": "frame", "status": "tracked", "time_s": 1.5, "trial": 2, "map_pose": pose}]
        with socket.create_server(("127.0.0.1", 0)) as server:
            threading.Thread(target=self.serve, args=(server, lines)).start()
            out = self.example("stream_client.py", f"http://127.0.0.1:{server.getsockname()[1]}/?token=7")
        self.assertEqual(out.split(), "1.50 s trial 2 x 1.00 y -2.00 z 3.50 mm".split())

    def test_each_has_help(self):
        for path in EXAMPLES.glob("*.py"):
            done = subprocess.run([sys.executable, path, "--help"], capture_output=True, text=True)
            self.assertEqual((done.returncode, done.stderr), (0, ""), path.name)
            self.assertIn("usage: ", done.stdout.lower())
        wrong = subprocess.run([sys.executable, EXAMPLES / "stream_client.py", "here"], capture_output=True, text=True)
        self.assertNotIn("Traceback", wrong.stderr)

    def test_all_are_tested(self):
        tested = {name.removeprefix("test_") for name in dir(self) if name.startswith("test_")}
        viewers = {"rerun_live", "foxglove_live"}  # test_viewers
        self.assertEqual({path.stem for path in EXAMPLES.glob("*.py")} - tested - viewers, set())


if __name__ == "__main__":
    unittest.main()
