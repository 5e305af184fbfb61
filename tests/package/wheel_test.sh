#!/usr/bin/env bash
# Installs the wheel of a build folder in a fresh virtual environment, without the network, and reconstructs with it.
# usage: wheel_test.sh WHEEL_SCRIPT BUILD PYTHON LOG
set -euo pipefail
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
unset PYTHONPATH
"$3" -c 'import venv, ensurepip, numpy' 2>/dev/null || { echo "wheel_test: no python3-venv or numpy; skipped"; exit 77; }

"$1" --build "$2" "$work"
"$3" -m venv --system-site-packages "$work/venv"  # NumPy is the system's
install=("$work/venv/bin/pip" install --no-index --quiet --disable-pip-version-check)
"${install[@]}" --ignore-installed --no-deps "$work"/gelslam-*.whl  # whatever the system has
"${install[@]}" "$work"/gelslam-*.whl                               # what it needs is there
cd "$work"
"$work/venv/bin/python" - "$work/venv" "$4" <<'END'
import sys
import gelslam
assert gelslam.__file__.startswith(sys.argv[1]), gelslam.__file__
run = gelslam.reconstruct(sys.argv[2] + "/scan", sys.argv[2] + "/scan/model.json")
assert len(run.trajectory) > 30 and len(run.mesh.vertices) > 1000, run
run.save("run")
assert len(gelslam.Map("run")) > 0
END
"$work/venv/bin/pip" uninstall --quiet --yes gelslam
[[ ! -e $(echo "$work"/venv/lib/python3*/site-packages)/gelslam ]] || { echo "wheel_test: the wheel leaves files" >&2; exit 1; }
