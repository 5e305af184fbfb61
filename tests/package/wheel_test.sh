#!/usr/bin/env bash
# Installs the wheel of a build folder in a fresh virtual environment, without the network, and reconstructs with it; runs
# the program of the archive where it was moved to. Both bring their libraries.
# usage: wheel_test.sh WHEEL_SCRIPT BUILD PYTHON LOG
set -euo pipefail
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
unset PYTHONPATH
"$3" -c 'import venv, ensurepip, numpy' 2>/dev/null || { echo "wheel_test: no python3-venv or numpy; skipped"; exit 77; }

for tool in patchelf readelf; do command -v "$tool" >/dev/null || { echo "wheel_test: no $tool; skipped"; exit 77; }; done
"$3" -c 'import wheel' 2>/dev/null || { echo "wheel_test: no python3-wheel; skipped"; exit 77; }

"$1" --build "$2" "$work"
wheel=$(echo "$work"/gelslam-*.whl)
glibc=$(sed -n 's/.*manylinux_\([0-9]*\)_\([0-9]*\)_.*/\1.\2/p' <<<"$wheel")
"$3" -m venv --system-site-packages "$work/venv"  # NumPy is the system's
install=("$work/venv/bin/pip" install --no-index --quiet --disable-pip-version-check)
"${install[@]}" --ignore-installed --no-deps "$wheel"  # whatever the system has
"${install[@]}" "$wheel"                               # what it needs is there
installed=$(echo "$work"/venv/lib/python3*/site-packages)
"$3" "$(dirname "$0")/bundle_test.py" "$installed" "$glibc"
# The archive holds the same.
mkdir "$work/archive"
tar -C "$work/archive" -xf "$work"/gelslam-*.tar.gz
mv "$work"/archive/gelslam-* "$work/another folder"
for folder in bin lib share; do diff -r "$installed/gelslam/$folder" "$work/another folder/$folder"; done
diff -r "$installed"/gelslam-*.dist-info/licenses "$work/another folder/licenses"
# Nothing of this system's is asked for.
env -i "$work/another folder/bin/gelslam" simulate scan --object coin --frames 30 -o "$work/log" -q
cd "$work"
"$work/venv/bin/python" - "$work/venv" "$4" <<'END'
import sys
import gelslam
assert gelslam.__file__.startswith(sys.argv[1]), gelslam.__file__
run = gelslam.reconstruct(sys.argv[2] + "/scan", sys.argv[2] + "/scan/model.json")
assert len(run.trajectory) > 30 and len(run.mesh.vertices) > 1000, run
run.save("run")
assert run.evaluate(sys.argv[2] + "/scan")["trajectory"]["ate_mm"] < 0.3
assert len(gelslam.Map("run")) > 0
END
[[ $(env -i "$work/venv/bin/gelslam" --version) == "$("$work/venv/bin/python" -m gelslam --version)" ]]
"$work/venv/bin/gelslam" info run | grep -q mesh
"$work/venv/bin/pip" uninstall --quiet --yes gelslam
[[ ! -e $installed/gelslam ]] || { echo "wheel_test: the wheel leaves files" >&2; exit 1; }
