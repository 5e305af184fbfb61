# vivid, the kernel's virtual camera, with faults put into it: raw pictures, automatic gain, lost buffers, unplugging.
. "$here/guest/common.sh"
probe=$build/bin/camera_probe
control() { "$build/bin/virtual_camera" control /dev/video20 "$@" || fail "vivid has no control $1"; }
load_vivid

runs_with 2 "$probe" /dev/video21 YUYV 640 480 25 1
has "/dev/video21: carries only metadata of vivid; its pictures are at /dev/video20" "$tmp/err"
runs_with 2 "$probe" /dev/video20 MJPG 3280 2464 25 1
has "asked for MJPG 3280x2464, the driver gave" "$tmp/err"
has "the camera offers" "$tmp/err"

runs_with 0 "$probe" /dev/video20 YUYV 640 480 5 10
grep -v "^frame\|^setting" "$tmp/out"
has "vivid, /dev/video20, YUYV 640x480, 5 Hz" "$tmp/out"
has "decoded: 10" "$tmp/out"
has "times: forward" "$tmp/out"
has "setting: gain_automatic=0" "$tmp/out"
lacks " automatic" "$tmp/out"

control "Percentage of Dropped Buffers" 50
runs_with 0 "$probe" /dev/video20 YUYV 640 480 5 20
has "decoded: 20" "$tmp/out"
lost() { sed -n 's/^lost: //p' "$tmp/out"; }
echo "  lost $(lost)"
(($(lost) >= 3)) || fail "about 20 buffers were dropped" # fewer than 3: one time in ten thousand
control "Percentage of Dropped Buffers" 0

for fault in REQBUFS QBUF STREAMON; do
  control "Inject VIDIOC_$fault Error" 1
  # A call that fails once is made again when its error may pass; else it ends in a sentence, never in between.
  code=0
  "$probe" /dev/video20 YUYV 640 480 5 3 >"$tmp/out" 2>"$tmp/err" || code=$?
  echo "  $fault: exit code $code $(cat "$tmp/err")"
  [[ $code == 0 && ! -s $tmp/err ]] || [[ $code == 2 && $(wc -l <"$tmp/err") == 1 ]] || fail "$fault"
done

# start FRAMES: in the background, until frames come
start() {
  "$probe" /dev/video20 YUYV 640 480 5 "$1" >"$tmp/out" 2>"$tmp/err" &
  prober=$!
  until grep -q "frame 2 " "$tmp/out"; do sleep 0.1; done
}
start 50  # 10 s: the control's program takes more than one to begin when the emulated processor is busy
control "Inject V4L2_BUF_FLAG_ERROR" 1
wait $prober
has "decoded: 50" "$tmp/out"
has "1 frame came damaged from the driver" "$tmp/out"
(($(lost) >= 1)) || fail "a damaged frame is a lost one"

# lose_by FAULT: the camera is lost while it streams
lose_by() {
  start 1000000
  control "$1" 1
  wait $prober
  [[ $? == 2 ]] || fail "it did not notice: $1"
  echo "  $1: $(cat "$tmp/err")"
}
lose_by "Inject Fatal Streaming Error"
has "error: /dev/video20: the camera does not answer; unplug it and plug it in again" "$tmp/err"
lose_by "Disconnect"
has "error: /dev/video20: the camera is gone; is it unplugged?" "$tmp/err"
