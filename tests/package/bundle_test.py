"""Every binary of a wheel or archive finds its libraries beside it, or with those that every system has.

usage: bundle_test.py FOLDER GLIBC   FOLDER: unpacked; GLIBC: the newest that may be asked for, as 2.36
"""
import pathlib
import re
import subprocess
import sys

folder, glibc = pathlib.Path(sys.argv[1]), sys.argv[2]
SYSTEM = re.compile(r"(lib(c|m|dl|pthread|rt|resolv|stdc\+\+|gcc_s|GL|GLX|EGL|OpenGL|GLdispatch)|ld-linux-x86-64)\.so\.\d+$")
SHARED_WITH_DRIVERS = re.compile(r"lib(X|xcb|bsd|md\.)")  # every other library has a name of its own


def version(text):
    return tuple(map(int, text.split(".")))


problems, binaries = [], []
for path in sorted(folder.rglob("*")):
    if not path.is_file() or path.is_symlink() or path.open("rb").read(4) != b"\x7fELF":
        continue
    name = str(path.relative_to(folder))
    dynamic = subprocess.run(["readelf", "--wide", "--dynamic", "--version-info", path], check=True, capture_output=True,
                             text=True).stdout
    binaries.append(path)
    roots = re.findall(r"\((?:RUNPATH|RPATH)\).*\[(.*)\]", dynamic)
    if len(roots) != 1 or not re.fullmatch(r"\$ORIGIN(/\.\.)?(/lib)?", roots[0]):
        problems.append(f"{name}: searches {roots}")
        continue
    beside = (path.parent / roots[0].replace("$ORIGIN", ".")).resolve()
    for needed in re.findall(r"\(NEEDED\).*\[(.*)\]", dynamic):
        inside = (beside / needed).is_file() and beside.is_relative_to(folder.resolve())
        if not inside and not SYSTEM.match(needed):
            problems.append(f"{name}: needs {needed}")
        if inside and not needed.startswith("gelslam-") and not SHARED_WITH_DRIVERS.match(needed):
            problems.append(f"{name}: another library of the process may have the name {needed}")
    newest = max(map(version, re.findall(r"\bGLIBC_([0-9.]+)", dynamic)), default=(0,))
    if newest > version(glibc):
        problems.append(f"{name}: needs glibc {newest}")

libraries = [path for path in binaries if path.parent.name == "lib"]
licenses = next(folder.rglob("LIBRARIES")).parent
listed = dict(line.split(maxsplit=2)[:2] for line in (licenses / "LIBRARIES").read_text().splitlines()[1:])
for path in libraries:
    package = listed.get(path.name, "").split(":")[0]
    if path.name != "gelslam-noglx.so" and not (licenses / package).is_file():
        problems.append(f"{path.name}: no license")
assert len(libraries) > 20, libraries
sys.exit("\n".join(problems) or 0)
