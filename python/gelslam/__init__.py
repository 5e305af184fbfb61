"""GelSLAM: surfaces, poses and maps from camera-based tactile sensors.

Pictures are NumPy arrays of height x width x 3 uint8 in the order blue, green, red. Poses and meshes are in meters,
as in the files; what is in millimeters has `_mm` in its name. `a_T_b` takes coordinates in b to a. A mistake in the
input raises gelslam.Error with one line. docs/python.md has a page about this module.
"""
import json as _json
import pathlib as _pathlib
import subprocess as _subprocess
import tempfile as _tempfile
import warnings as _warnings

from . import _core
from ._program import find_program as _find_program
from ._core import *  # noqa: F403
from ._core import __version__


def _on_folder(run, command, *words):
    """What the program prints of a run, which is saved for it where it has no folder."""
    with _tempfile.TemporaryDirectory() as temporary:
        folder = run.folder
        if folder is None:
            folder = _pathlib.Path(temporary) / "run"
            run.save(folder)
        program = _find_program()
        if program is None:
            raise _core.Error("the program gelslam is not installed, only the Python module")
        done = _subprocess.run([program, command, folder, *words, "-q"], capture_output=True, text=True)
    words = " ".join(done.stderr.split("\n")).strip()
    if done.returncode > 1:
        raise _core.Error(words)
    if words:
        _warnings.warn(words, stacklevel=3)
    return done.stdout


def _evaluate(self, truth):
    """evaluate(self: gelslam.Run, truth: os.PathLike) -> dict

    What `gelslam evaluate --json` says of it. truth: the data folder of its log, with the true poses.
    """
    return _json.loads(_on_folder(self, "evaluate", "--truth", truth, "--json"))


def _export(self, path, *, units=None, color=None, max_error_mm=None, largest_piece=False, watertight=False, close=False,
            overwrite=False):
    """export(self: gelslam.Run, path: os.PathLike, *, units: str = None, color: str = None, max_error_mm: float = None, \
largest_piece: bool = False, watertight: bool = False, close: bool = False, overwrite: bool = False) -> None

    Writes a file for other programs as `gelslam export` does: .ply, .obj, .stl, .glb, .html, .mcap or .tum.
    """
    values = {"--units": units, "--color": color, "--max-error-mm": max_error_mm}
    flags = {"--largest-piece": largest_piece, "--watertight": watertight, "--close": close, "--overwrite": overwrite}
    _on_folder(self, "export", "-o", path, *(word for name, value in values.items() if value is not None for word in (name, str(value))),
               *(name for name, wanted in flags.items() if wanted))


_core.Run.evaluate, _core.Run.export = _evaluate, _export

__all__ = [name for name in vars(_core) if not name.startswith("_")] + ["__version__"]
for _name in __all__[:-1]:
    getattr(_core, _name).__module__ = "gelslam"
del _name
