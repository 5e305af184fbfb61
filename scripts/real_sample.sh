#!/usr/bin/env bash
# usage: scripts/real_sample.sh [--no-window] [DIR]
#
# Downloads a real touch into DIR (default: sample in the repository), checks it, reconstructs it and opens the result: the
# handle of a screwdriver that turns on a GelSight Mini. The videos are of github.com/amitparag/Incipient-Slip-Detection
# (BSD 2-Clause, 2 MB), the model is the maker's, of github.com/gelsightinc/gsrobotics. Needs the Python module:
# the wheel, or what scripts/build.sh --python built.
#   --no-window   only write DIR/picture.png
#
# Leaves in DIR: run (what gelslam reconstruct writes), picture.png, nnmini.pt, and the videos.
. "$(dirname "$0")/common.sh"

# Tests take others.
touches=docs/franka-servo/datasets/base_data/base_data_for_training/screw_driver_blue_gray
videos_url=${SAMPLE_VIDEOS_URL:-https://github.com/amitparag/Incipient-Slip-Detection/raw/HEAD/$touches}
model_url=${SAMPLE_MODEL_URL:-https://github.com/gelsightinc/gsrobotics/raw/HEAD/models/nnmini.pt}
bare_frames=${SAMPLE_BARE_FRAMES:-400 440} # of the second video: the handle has left the gel
sums=${SAMPLE_SUMS:-"6905c991fc49d2fb3a677755cb5b9bae9b4069d74eb0230469609b85706d1276  touch.avi
c15fca1f3b56dbf1592a9d87ac7db4e8ea6c8d69639430b570bcd5bdd81c64b1  bare.avi
091bb7ee7ac259d8f77e80ca61c0370c09af6a4659bc9a4222474d4eca0bd65e  nnmini.pt"}

no_window=
parse --no-window 0 1 "$@"
sample=$(realpath -m "${arguments[0]:-$root/sample}")

python=python3
if ! "$python" -c 'import gelslam' 2>/dev/null; then
  export PYTHONPATH=$root/build/python PATH=$root/build/bin:$PATH
  python=/usr/bin/python3
  "$python" -c 'import gelslam' 2>/dev/null || fail "no Python module: install the wheel (README.md), or run scripts/build.sh --python"
fi

# fetch URL NAME
fetch() {
  "$python" -c 'import sys, urllib.request; urllib.request.urlretrieve(*sys.argv[1:])' "$1" "$sample/$2" 2>/dev/null || fail "cannot get $1"
}
is_whole() { (cd "$sample" && sha256sum --check --status --strict <<<"$sums" 2>/dev/null); }

mkdir -p "$sample"
if ! is_whole; then
  say "downloading to $sample"
  fetch "$videos_url/exp_num_6/camera_0.avi" touch.avi
  fetch "$videos_url/exp_num_7/camera_0.avi" bare.avi
  fetch "$model_url" nnmini.pt
  is_whole || fail "what was downloaded is not what was published: sha256sums differ in $sample"
fi

say "reconstructing"
"$python" - "$sample" "$bare_frames" <<'END'
import itertools, pathlib, sys, warnings
import gelslam

warnings.showwarning = lambda message, *_: print(f"real_sample: {message}")
sample, (first, last) = pathlib.Path(sys.argv[1]), map(int, sys.argv[2].split())
bare = [image for image, _ in itertools.islice(gelslam.Log(sample / "bare.avi"), first, last)]
sensor = gelslam.Sensor(sample / "nnmini.pt", background=bare)
slam = gelslam.Slam(sensor)
for image, time_s in gelslam.Log(sample / "touch.avi"):
    slam.process(image, time_s)
run = slam.finish()
run.save(sample / "run", overwrite=True)
size = 1e3 * (run.mesh.vertices.max(axis=0) - run.mesh.vertices.min(axis=0))
print(f"real_sample: {len(run.trajectory)} poses, a surface of {size[0]:.0f} x {size[1]:.0f} x {size[2]:.1f} mm: {sample}/run")
END

"$python" -m gelslam view "$sample/run" --snapshot "$sample/picture.png" --overwrite -q
say "its picture: $sample/picture.png"
if [[ -z $no_window && -n ${DISPLAY:-}${WAYLAND_DISPLAY:-} ]]; then exec "$python" -m gelslam view "$sample/run"; fi
