"""GelSLAM: surfaces, poses and maps from camera-based tactile sensors.

Pictures are NumPy arrays of height x width x 3 uint8 in the order blue, green, red. Poses and meshes are in meters,
as in the files; what is in millimeters has `_mm` in its name. `a_T_b` takes coordinates in b to a. A mistake in the
input raises gelslam.Error with one line. docs/python.md has a page about this module.
"""
from . import _core
from ._core import *  # noqa: F403
from ._core import __version__

__all__ = [name for name in vars(_core) if not name.startswith("_")] + ["__version__"]
for _name in __all__[:-1]:
    getattr(_core, _name).__module__ = "gelslam"
del _name
