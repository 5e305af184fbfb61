# Two cameras at the same time, which show the same pictures at the same moments: refused names, one log of both, and a
# scan of both that goes on when the second one stalls.
. "$here/guest/common.sh"

[[ -e $work/scan/00020.jpg ]] || { echo "  no data; set GELSLAM_DATA"; exit 77; }

load_loopback "GelSight Mini ONE,GelSight Mini TWO"
small_config 5 >"$tmp/config.yaml"

feed "$work/scan" 5 100000 "" "$work/scan" 100000
record() { runs_with "$1" "$gelslam" record --config "$tmp/config.yaml" --seconds 3 -o "$tmp/both.mkv" "${@:2}"; }
record 2 --camera GelSight --camera GelSight
has 'more than one camera has "GelSight" in its name: there is /dev/video10 (GelSight Mini ONE), /dev/video11' "$tmp/err"
record 2 --camera ONE --camera 10
has "error: --camera ONE and --camera 10 are both /dev/video10; name two cameras" "$tmp/err"
record 0 --camera ONE --camera TWO
python3 "$here/guest/simultaneous.py" "$tmp/both.mkv" "$work/scan" 0.2 || fail "the log is not as expected"
stop_feeding

# More of the bare gel, for the second sensor may begin to take its background some pictures later.
mkdir "$tmp/pictures"
ln -s "$work"/scan/* "$tmp/pictures"
for i in {0..3}; do ln -s "$work/scan/00000.jpg" "$tmp/pictures/0000-$i.jpg"; done
cat >"$tmp/rig.yaml" <<'Y'
second_y: {x: 0, y: 1, z: 0}
second_z: {x: 0, y: 0, z: 1}
second_origin: {x: 0, y: 0, z: 0}
sigma_mm: 0.05
sigma_deg: 0.1
Y
feed "$tmp/pictures" 5 100000 "$tmp/run-first/log.mkv" "$tmp/pictures" 24
"$gelslam" scan --headless --camera ONE --camera TWO --config "$tmp/config.yaml" -o "$tmp/run" \
  --model "$data/../../calibration_sim/model/nnmodel.pth" --rig "$tmp/rig.yaml" >"$tmp/out" 2>"$tmp/err" &
scanner=$!
until grep -q "^warning: second sensor" "$tmp/err"; do
  kill -0 $scanner 2>/dev/null || { cat "$tmp/err"; fail "it did not go on"; }
  sleep 0.2
done
bytes=$(stat -c %s "$tmp/run-first/log.mkv")
until (($(stat -c %s "$tmp/run-first/log.mkv") > bytes)); do sleep 0.2; done
kill -INT $scanner
wait $scanner
code=$?
tail -5 "$tmp/err" | cut -c-200
[[ $code == 1 ]] || fail "exit code $code instead of 1: the second sensor's scan ended early"
grep -c "/dev/video11: no frame for 5 s" "$tmp/err" | grep -qx 1 || fail "the stall is not said once"
lacks "/dev/video10: no frame" "$tmp/err"
runs_with 0 "$gelslam" info --json "$tmp/run-second/log.mkv"
python3 - "$tmp/run" "$tmp/out" <<'P' || fail "the runs are not as expected"
import json, pathlib, sys
from readable import readable
runs = [pathlib.Path(sys.argv[1] + name) for name in ("", "-first", "-second")]
both, first, second = reports = [json.load(open(run / "report.json")) for run in runs]
print("  tracked", *(report["frames"]["tracked"] for report in reports), "pieces", both["components"])
assert [report["partial"] for report in reports] == [False, False, True]
assert all((run / "mesh.ply").stat().st_size > 10000 for run in runs)
# How many frames are left out depends on the emulated processor.
assert min(run["frames"]["tracked"] for run in (first, second)) >= 1, "too few frames were tracked"
assert both["frames"]["tracked"] == first["frames"]["tracked"] + second["frames"]["tracked"]
assert both["components"] == 1 or both["warning"], "two maps, which is not said"
log = readable(json.load(open(sys.argv[2])))
# 24 pictures are sent; the loopback may deliver one of them again.
assert log["state"] == "whole" and 15 <= log["frames"] <= 30, log
P
