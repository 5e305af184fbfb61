"""GelSLAM: surfaces, poses and maps from camera-based tactile sensors.

Pictures are NumPy arrays of height x width x 3 uint8 in the order blue, green, red. Poses and meshes are in meters,
as in the files; what is in millimeters has `_mm` in its name. `a_T_b` takes coordinates in b to a. A mistake in the
input raises gelslam.Error with one line. docs/python.md has a page about this module.
"""
import functools as _functools
import re as _re

from . import _core
from ._core import *  # noqa: F403
from ._core import __version__


def _says_in_one_line(name, function, skipped=0):
    """The function; arguments that do not fit are named in one line, without the first `skipped`."""

    @_functools.wraps(function)
    def checked(*given, **named):
        try:
            return function(*given, **named)
        except TypeError as error:
            if "incompatible" not in str(error):
                raise
            known = _re.findall(r"^ +\d+\. [\w.]*\((?:self: [\w.]+(?:, )?)?(.*)\)(?: -> .*)?$", str(error), _re.M)
            kinds = [type(value).__name__ for value in given[skipped:]]
            kinds += [f"{key}={type(value).__name__}" for key, value in named.items()]
        message = f"{name}({', '.join(kinds)}): expected {name}({f') or {name}('.join(known)})"
        raise TypeError(message.replace("gelslam._core.", "gelslam.")) from None

    return checked


def _check_methods(kind):
    for name, member in list(vars(kind).items()):
        if name.startswith("_") and name not in ("__init__", "__call__") or isinstance(member, property):
            continue
        if isinstance(member, staticmethod):
            member = staticmethod(_says_in_one_line(f"{kind.__name__}.{name}", member.__func__))
        elif callable(member):
            full = kind.__name__ if name.startswith("__") else f"{kind.__name__}.{name}"
            member = _says_in_one_line(full, member, skipped=1)
        else:
            continue
        setattr(kind, name, member)


__all__ = [name for name in vars(_core) if not name.startswith("_")] + ["__version__"]
for _name in __all__[:-1]:
    _member = getattr(_core, _name)
    _member.__module__ = "gelslam"
    if not isinstance(_member, type):
        globals()[_name] = _says_in_one_line(_name, _member)
    elif not issubclass(_member, Exception):
        _check_methods(_member)
del _name, _member
