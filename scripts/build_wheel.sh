#!/usr/bin/env bash
# usage: scripts/build_wheel.sh [--build DIR] [OUT]
#
# Makes a wheel of the Python module in OUT (default: packages in the repository), for the system's Python and with its
# shared libraries. Install it with: pip install OUT/gelslam-*.whl
#
#   --build DIR   take what was built in DIR, instead of building first in build/wheel
set -euo pipefail

usage() { sed -n '2,/^set /s/^# \?//p' "$0"; }

root=$(cd "$(dirname "${BASH_SOURCE[0]}")/.." && pwd -P)

build=
while [[ ${1:-} == -* ]]; do
  case $1 in
    --build) build=$(cd "${2:?--build needs a folder}" && pwd -P); shift ;;
    -h | --help) usage; exit 0 ;;
    *) usage >&2; exit 2 ;;
  esac
  shift
done
(($# <= 1)) || { usage >&2; exit 2; }
out=$(realpath -m "${1:-$root/packages}")

if [[ -z $build ]]; then
  build=$root/build/wheel
  "$root/scripts/setup.sh" --python
  cmake -S "$root" -B "$build" -G Ninja -DCMAKE_BUILD_TYPE=Release -DGELSLAM_BUILD_PYTHON=ON \
    -DGELSLAM_BUILD_PROGRAM=OFF -DGELSLAM_BUILD_VIEWER=OFF >/dev/null
  cmake --build "$build" --parallel "$(nproc)" --target gelslam_python
fi
cached() { sed -n "s/^$1:[A-Z]*=//p" "$build/CMakeCache.txt"; }
[[ $(cached GELSLAM_BUILD_PYTHON) == ON ]] || { echo "build_wheel: $build has no Python module (GELSLAM_BUILD_PYTHON)" >&2; exit 2; }

work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
DESTDIR=$work cmake --install "$build" --prefix /usr --component python >/dev/null
package=$work/usr/$(cached GELSLAM_PYTHON_DIR)/gelslam
find "$package" -name '*.so' -exec strip --strip-unneeded {} + -exec chmod 644 {} +
mkdir -p "$out"
"$(cached _Python_EXECUTABLE)" - "$package" "$root/LICENSE" "$(cached CMAKE_PROJECT_VERSION)" "$out" <<'END'
import base64, hashlib, pathlib, sys, sysconfig, zipfile

package, license, version, out = map(pathlib.Path, sys.argv[1:])
python = f"{sys.version_info.major}{sys.version_info.minor}"
tag = f"cp{python}-cp{python}-{sysconfig.get_platform().replace('-', '_').replace('.', '_')}"
info = f"gelslam-{version}.dist-info"
files = {f"gelslam/{path.name}": path.read_bytes() for path in sorted(package.iterdir()) if path.is_file()}
files[f"{info}/LICENSE"] = license.read_bytes()
files[f"{info}/WHEEL"] = f"Wheel-Version: 1.0\nGenerator: gelslam\nRoot-Is-Purelib: false\nTag: {tag}\n".encode()
files[f"{info}/METADATA"] = (f"Metadata-Version: 2.1\nName: gelslam\nVersion: {version}\n"
                             "Summary: Tactile SLAM for camera-based touch sensors\nLicense: MIT\nRequires-Dist: numpy\n").encode()
record = [f"{name},sha256={base64.urlsafe_b64encode(hashlib.sha256(data).digest()).rstrip(b'=').decode()},{len(data)}"
          for name, data in files.items()]
files[f"{info}/RECORD"] = "\n".join([*record, f"{info}/RECORD,,", ""]).encode()
wheel = out / f"gelslam-{version}-{tag}.whl"
with zipfile.ZipFile(wheel, "w", zipfile.ZIP_DEFLATED) as archive:
    for name, data in files.items():
        archive.writestr(name, data)
print(f"build_wheel: {wheel}")
END
