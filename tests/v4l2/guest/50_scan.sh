# `gelslam scan` from camera to mesh: a simulated scan's frames at half their size, slowly (the machine is emulated;
# 20_capture.sh reads the camera's full size).
# It is killed and continued. When the frames end, the camera stalls: what was scanned must be saved all the same.
. "$here/guest/common.sh"

[[ -e $work/scan/00020.jpg ]] || { echo "  no data; set GELSLAM_DATA"; exit 77; }

load_loopback
frames=$(ls "$work/scan" | wc -l)
# Of the scanned pictures; without what other tests show, for which the emulated processor takes 15 s each.
sed "s/track_config:/&\n    relocalize: false/
  s/ppmm:.*/ppmm: 0.1268/; s/ imgh:.*/ imgh: 120/; s/ imgw:.*/ imgw: 160/; s/raw_imgh:.*/raw_imgh: 168/
  s/raw_imgw:.*/raw_imgw: 224/; s/framerate:.*/framerate: 25/; /calibration_model_path/d" \
  "$data/config.yaml" >"$tmp/config.yaml"
# begin LOG ARGUMENTS...: the scan in the background; the object moves on with each frame that it has logged, however
# slow the emulated processor is
begin() {
  feed "$work/scan" 2 "$frames" "$tmp/run/$1"
  "$gelslam" scan --headless --keep-free 1MB --camera "GelSight Mini" "${@:2}" >"$tmp/out" 2>"$tmp/err" &
  scanner=$!
}
begin log.mkv --config "$tmp/config.yaml" --model "$data/../../calibration_sim/model/nnmodel.pth" -o "$tmp/run"
until python3 -c 'import sqlite3, sys; sys.exit(not sqlite3.connect(f"file:{sys.argv[1]}?mode=ro", uri=True).execute("SELECT count(*) FROM keyframes").fetchone()[0])' "$tmp/run/session.db" 2>/dev/null; do
  kill -0 $scanner 2>/dev/null || { cat "$tmp/err"; fail "no keyframe"; }
  sleep 0.2
done
sleep "0.$((RANDOM % 10))"
kill -9 $scanner
wait $scanner
stop_feeding
runs_with 1 "$gelslam" info --json "$tmp/run/log.mkv"
python3 -c 'import json, sys; from readable import readable; log = readable(json.load(sys.stdin)); print("  killed after", log["frames"], "recorded frames"); sys.exit(log["frames"] < 3)' \
  <"$tmp/out" || fail "the log was lost"

begin log-2.mkv --continue "$tmp/run"
wait $scanner
echo "  exit code $?"
cut -c-200 "$tmp/err" | tr '\r' '\n' | tail -8
has "no frame for 5 s" "$tmp/err"

[[ -s $tmp/run/mesh.ply ]] || { ls -R "$tmp/run"; fail "no mesh"; }
# The emulated camera may stand still for seconds, which info calls a problem.
"$gelslam" info --json "$tmp/run/log-2.mkv" >"$tmp/out"
python3 - "$tmp/run" "$frames" "$tmp/out" <<'P' || fail "the run is not as expected"
import json, pathlib, sys
from readable import readable
run, sent, log = pathlib.Path(sys.argv[1]), int(sys.argv[2]), readable(json.load(open(sys.argv[3])))
tracked = [line for line in (run / "trajectory.tum").read_text().splitlines() if not line.startswith("#")]
head = (run / "mesh.ply").read_bytes()[:2000].decode("latin1").splitlines()
vertices = next(int(line.split()[2]) for line in head if line.startswith("element vertex"))
print("  sent", sent, "recorded", log["frames"], "tracked", len(tracked), "vertices", vertices)
print("  files", *sorted(path.name for path in run.iterdir()))
# The log grew before each picture but the first: once by its head, then by a frame each.
assert log["state"] == "whole" and log["frames"] >= sent - 2, log
# The emulated processor leaves out as many frames as it must; these are enough to see that the chain is whole.
assert len(tracked) >= 4, "too few frames were tracked"
assert vertices > 4000, "too small a mesh"
P
