"""Runs the commands and snippets of README.md and docs/*.md on simulated data, page by page.

NOT_RUN names the blocks that cannot run, and why. Of a block that needs a camera every line is run: it does what it says,
or ends because there is no camera.
"""
import glob
import json
import os
import pathlib
import re
import shutil
import subprocess
import sys
import tempfile
import unittest

import gelslam
import matplotlib.pyplot as plt
import numpy as np

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[2] / "scripts"))
import results  # noqa: E402

ROOT = pathlib.Path(__file__).resolve().parents[2]
LOG = pathlib.Path(os.environ["GELSLAM_LOG"])
PROGRAM = pathlib.Path(os.environ["GELSLAM_PROGRAM"])
# Page and beginning of a block that does not run as it stands. elsewhere: another test runs it.
NOT_RUN = {
    ("README.md", "./scripts/build_wheel.sh"): "minutes",
    ("README.md", "./scripts/demo.sh"): "minutes",
    ("README.md", "gelslam devices"): "camera",
    ("architecture.md", "SurfaceStream stream(log, config);"): "elsewhere",
    ("calibration.md", "gelslam calibrate scale ball.mkv"): "data",
    ("calibration.md", "gelslam calibrate collect -o PRESSES"): "camera",
    ("calibration.md", "gelslam calibrate optics slide.mkv"): "data",
    ("cameras-and-logs.md", "$ gelslam devices"): "output",
    ("cameras-and-logs.md", "gelslam record --model"): "camera",
    ("cpp.md", "cmake --preset library"): "minutes",
    ("cpp.md", "find_package(gelslam"): "elsewhere",
    ("getting-started.md", "./scripts/build_wheel.sh"): "minutes",
    ("getting-started.md", "./scripts/demo.sh"): "minutes",
    ("getting-started.md", "./scripts/package.sh"): "minutes",
    ("getting-started.md", "399 of 410 frames tracked"): "output",
    ("live.md", "gelslam scan --model nnmodel.pth -o runs"): "camera",
    ("live.md", "gelslam scan --continue"): "camera",
    ("live.md", "gelslam scan --headless"): "camera",
    ("localization.md", "gelslam reconstruct scan.mkv"): "camera",
    ("localization.md", "gelslam map part.stl"): "camera",
    ("localization.md", "gelslam track --camera --map"): "camera",
    ("localization.md", "gelslam-lab localize"): "minutes",
    ("streaming.md", "gelslam scan --model nnmodel.pth --headless"): "camera",
    ("streaming.md", "cd ~/ros2_ws"): "ros",
}
NO_CAMERA = re.compile(r"no GelSight|no camera|/dev/video|--camera")
DOCS = pathlib.Path(os.environ.get("GELSLAM_DOCS", ROOT))  # another checkout's
PAGES = [DOCS / "README.md", *sorted((DOCS / "docs").glob("*.md"))]

# What runs instead: smaller data, no window, no path of its own.
INSTEAD = [
    (r"--frames \d+", "--frames 30"),
    (r"--size 3.3", "--size 1"),
    (r"(calibrate train \S+)", r"\1 --steps 300"),
    (r"(gelslam view (?!.*--snapshot).*)", r"\1 --snapshot window.png --overwrite"),
    (r"(gelslam (scan|calibrate collect) (?!.*--headless).*)", r"\1 --headless"),
    (r"track --camera(.*) --window", r"track --camera\1"),
    (r"/tmp/pose", "pose"),
    (r'gelslam\.Camera\("auto"\)', 'gelslam.Log("scan.avi")'),
]
BEFORE_PYTHON = """
import gelslam as _g
bgr = image = next(iter(_g.Log("scan.avi")))[0]
_touches = [image for image, _ in _g.Log("scan.avi")]
surface_a, surface_b = map(_g.Sensor("nnmodel.pth", background=bgr), (_touches[20], _touches[24]))
"""


def run(*command, **options):
    return subprocess.run([str(word) for word in command], capture_output=True, text=True, timeout=200, **options)


class Block:
    def __init__(self, page, line, language, lines):
        self.name, self.language, self.text = f"{page.name}:{line}", language, "\n".join(lines)
        self.entry = next((entry for entry in NOT_RUN if entry[0] == page.name and self.text.startswith(entry[1])), None)
        self.mark = NOT_RUN.get(self.entry)


def blocks_of(page):
    """Fenced blocks, and those that are indented by four after an empty line."""
    lines, blocks, i = page.read_text().splitlines(), [], 0
    while i < len(lines):
        begin, language, body = i + 1, "", []
        if lines[i].startswith("```"):
            language, i = lines[i][3:], i + 1
            while not lines[i].startswith("```"):
                body.append(lines[i])
                i += 1
            i += 1
        elif re.match(r" {4,}\S", lines[i]) and not lines[i - 1].strip():
            depth = len(lines[i]) - len(lines[i].lstrip())
            while i < len(lines) and (lines[i].startswith(depth * " ") or not lines[i].strip()):
                body.append(lines[i][depth:])
                i += 1
        if body:
            blocks.append(Block(page, begin, language, body))
            continue
        i += 1
    return blocks


class Inputs:
    """The files that the pages name, in a folder of their own for each page. What a command writes is made room for."""

    def __init__(self, store):
        self.store = store
        scan, made = store / "scan", {"RUN": store / "run"}
        model = LOG / "scan/model.json"
        self.files = {
            "nnmodel.pth": model, "nnmini.pt": model, "scan.avi": scan / "gelsight.avi", "gelsight.avi": scan / "gelsight.avi",
            "scan.mkv": store / "log.mkv", "log.mkv": store / "log.mkv", "more.mkv": store / "log.mkv",
            "other_scan.mkv": store / "log.mkv", "LOG": scan, "DATA": scan,
            "demo/log": scan, "data/a": scan,
            "data/b": scan, "PRESSES": LOG / "presses", "part.stl": store / "part.stl",
            "bolt_x.png": store / "bolt_x.png", "bolt_y.png": store / "bolt_y.png",
            "scripts": ROOT / "scripts", "configs": ROOT / "configs",
            **{name: made["RUN"] for name in ["RUN", "OTHER", "demo/run", "runs/shell", "runs/top", "runs/bottom",
                                              "runs/whole", "runs/part", "part_map", "LONG.run"]}}
        self.make()

    def make(self):
        shutil.copytree(LOG / "scan", self.store / "scan")
        config = self.store / "scan/config.yaml"
        config.write_text(re.sub(r"calibration_model_path: .*", f'calibration_model_path: "{LOG}/scan/model.json"',
                                 config.read_text()))
        gelslam.reconstruct(LOG / "scan", LOG / "scan/model.json").save(self.store / "run")
        checked("record", "--from", LOG / "scan", "--model", LOG / "scan/model.json", "-o",
                self.store / "log.mkv", "-q")
        shutil.copy(self.store / "log.mkv", self.store / "run/log.mkv")
        checked("export", self.store / "run", "-o", self.store / "part.stl", "-q")
        bare = plt.imread(LOG / "presses/background.png")[..., :3]
        for name, axis in [("bolt_x.png", 1), ("bolt_y.png", 0)]:  # marks at 0.8 mm
            along = np.arange(bare.shape[axis]) * 0.0634 * 2 * np.pi / 0.8
            marks = 0.15 * np.sin(along)[None, :, None] if axis == 1 else 0.15 * np.sin(along)[:, None, None]
            plt.imsave(self.store / name, np.clip(bare + marks, 0, 1))

    def put(self, folder, line):
        for name, source in self.files.items():
            path = folder / name
            if path.exists() or not re.search(rf"(^|[\s\"'=/]){re.escape(name.split('/')[0])}\b", line):
                continue
            path.parent.mkdir(parents=True, exist_ok=True)
            (shutil.copytree if source.is_dir() else shutil.copy)(source, path)
        for name in re.findall(r"(?:-o|--pth|save\() ?[\"']?([\w./-]+)", line):
            path = folder / name
            if path.is_dir() and "--overwrite" not in line:
                shutil.rmtree(path)
            path.unlink(missing_ok=True)


def checked(*words):
    done = run(PROGRAM, *words)
    assert done.returncode == 0, f"{words}: {done.stderr}"


class Docs(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        temporary = tempfile.TemporaryDirectory()
        cls.addClassCleanup(temporary.cleanup)
        cls.folder = pathlib.Path(temporary.name)
        (cls.folder / "inputs").mkdir()
        cls.inputs = Inputs(cls.folder / "inputs")
        cls.environment = {**os.environ, "PATH": f"{PROGRAM.parent}:{os.environ['PATH']}"}
        cls.environment.pop("DISPLAY", None)

    def test_pages(self):
        entries = set()
        for page in PAGES:
            blocks, ran = blocks_of(page), 0
            folder = self.folder / page.stem
            folder.mkdir()
            for block in blocks:
                with self.subTest(block=block.name):
                    entries.add(block.entry)
                    ran += block.mark == "elsewhere"
                    if block.mark and (block.mark != "camera" or glob.glob("/dev/video*")):
                        continue
                    ran += 1
                    self.run_block(block, folder)
            with self.subTest(page=page.name):
                self.assertTrue(ran or not blocks, "no block of the page is run")
        self.assertEqual(set(NOT_RUN) - entries, set(), "no page has these blocks")

    def run_block(self, block, folder):
        if block.language in ("", "bash", "sh"):
            return self.run_commands(block, folder)
        if block.language == "python":
            code = self.instead(block.text)
            self.inputs.put(folder, code + BEFORE_PYTHON)
            (folder / "snippet.py").write_text(BEFORE_PYTHON + code)
            done = run(sys.executable, "snippet.py", cwd=folder, env=self.environment)
            return self.assertEqual(done.returncode, 0, done.stderr)
        if block.language == "yaml":
            return self.check_defaults(block)
        self.fail(f"the language {block.language} is not known")

    @staticmethod
    def instead(text):
        for pattern, replacement in INSTEAD:
            text = re.sub(pattern, replacement, text)
        return text

    def run_commands(self, block, folder):
        camera = 0
        for line in block.text.replace("\\\n", " ").splitlines():
            if not line.strip() or "--watertight" in line:  # tests/exchange/export_test.py runs that one
                continue
            line = self.instead(re.sub(r"\s+# .*", "", line))
            self.inputs.put(folder, line)
            done = run("bash", "-c", line, cwd=folder, env=self.environment)
            if done.returncode and block.mark == "camera" and NO_CAMERA.search(done.stderr + done.stdout):
                camera += 1
                continue
            self.assertEqual(done.returncode, 0, f"{line}\n{done.stdout[-500:]}{done.stderr[-1500:]}")
        self.assertEqual(camera > 0, block.mark == "camera", "the mark says camera, and no line needs one")

    def check_defaults(self, block):
        """What a run without a configuration writes, is what the page says; and no key is missing."""
        def entries(text):
            lines = [re.sub(r"\s*#.*", "", line).strip() for line in text.splitlines() if re.match(r"\s*\w+:", line)]
            return sorted(line for line in lines if "calibration_model_path" not in line)
        self.assertEqual(entries(block.text), entries((self.inputs.store / "run/config.yaml").read_text()))

    def test_figures(self):
        """README and results are what their templates give with results.json, in which nobody types a figure with decimals."""
        measured = json.loads((DOCS / "docs/results.json").read_text())
        for page, template in results.PAGES.items():
            with self.subTest(page=page):
                text = (DOCS / template).read_text()
                self.assertEqual((DOCS / page).read_text(), results.filled(text, measured), "scripts/results.py renders it")
                prose = re.sub(r"```.*?```|^ {4,}.*$|`[^`]*`|\]\([^)]*\)|Ubuntu \d\d\.04", "", results.FIELD.sub("", text), flags=re.M | re.S)
                self.assertEqual(re.findall(r"\d+\.\d+.*", prose), [])

    def test_the_summary_in_getting_started(self):
        """The words of the example are those of the program."""
        line = re.search(r"^    (\d+ of \d+ frames tracked.*)\n    (.* in the mesh)\n    (mesh of .*)$",
                         (DOCS / "docs/getting-started.md").read_text(), re.M)
        folder = self.folder / "summary"
        folder.mkdir()
        done = run(PROGRAM, "reconstruct", LOG / "scan", "--model", LOG / "scan/model.json", "-o", "RUN",
                   cwd=folder)

        def words(text):
            return re.sub(r"\d[\d.]*", "N", text)
        for said in line.groups():
            self.assertIn(words(said), words(done.stderr))


if __name__ == "__main__":
    unittest.main()
