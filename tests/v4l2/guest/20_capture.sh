# Full-size MJPG at 25 Hz through v4l2loopback: format, frames, busy, feeder gone.
. "$here/guest/common.sh"
probe=$build/bin/camera_probe

load_loopback
runs_with 2 "$probe" auto MJPG 3280 2464 25 1
has "no GelSight Mini found: no camera is connected" "$tmp/err"
runs_with 2 "$probe" /dev/video10 MJPG 3280 2464 25 1
has "gives no pictures (GelSight Mini R0B TEST is no camera now)" "$tmp/err"

feed "$work/made_up" 25 100000
# At once: the first half second, when the driver still says no, must be waited out.
runs_with 0 "$probe" /dev/video10 MJPG 3280 2464 25 30
cat "$tmp/out"
has "camera: GelSight Mini R0B TEST, /dev/video10, MJPG 3280x2464, 25 Hz" "$tmp/out"
has "decoded: 30" "$tmp/out"
has "times: forward" "$tmp/out"
has "green: 10" "$tmp/out" # 110 but for the circle

runs_with 0 "$probe" auto MJPG 3280 2464 25 2
runs_with 2 "$probe" auto MJPG 640 480 25 2
has "asked for MJPG 640x480, the driver gave MJPG 3280x2464" "$tmp/err"
runs_with 2 "$probe" "GelSight" YUYV 640 480 25 2
has "the driver refuses YUYV 640x480; the camera offers MJPG 3280x2464" "$tmp/err"

# The feeder goes away: no frames any more, which is said.
"$probe" auto MJPG 3280 2464 25 1000000 >"$tmp/out" 2>"$tmp/err" &
prober=$!
until grep -q "frame 5 " "$tmp/out"; do sleep 0.2; done
stop_feeding
wait $prober
[[ $? == 2 ]] || fail "it did not notice"
cat "$tmp/err"
has "error: /dev/video10: " "$tmp/err"
