# Sourced by the test scripts that run inside the virtual machine. `build`, `cache`, `here`, `work` are folders.
set -uo pipefail

gelslam=$build/bin/gelslam
tmp=$(mktemp -d /dev/shm/test.XXXX)
export PYTHONPATH=$here/guest PYTHONDONTWRITEBYTECODE=1  # readable.py

fail() {
  echo "  failed: $*"
  exit 1
}
# has TEXT FILE: the file holds the text
has() { grep -qF -- "$1" "$2" || { head -40 "$2" | cut -c-200 | sed "s|^|    \| |"; fail "no \"$1\""; }; }
lacks() { ! grep -qF -- "$1" "$2" || { head -40 "$2" | cut -c-200 | sed "s|^|    \| |"; fail "has \"$1\""; }; }
# fails_with CODE COMMAND...: it ends with this exit code; its output is in $tmp/out and $tmp/err
runs_with() {
  local expected=$1 code=0
  shift
  "$@" >"$tmp/out" 2>"$tmp/err" || code=$?
  [[ $code == "$expected" ]] || { head -20 "$tmp/out" "$tmp/err"; fail "exit code $code instead of $expected: $*"; }
}

# A camera like a GelSight Mini, /dev/video10, with its name, or two: load_loopback NAMES; they give pictures while feed
# runs.
load_loopback() {
  busybox insmod "$cache/modules/v4l2loopback.ko" video_nr=10,11 devices=$((${1:+1} + 1)) exclusive_caps=1,1 \
    card_label="\"${1:-GelSight Mini R0B TEST}\""
}
# feed FOLDER RATE FRAMES [LOG [FOLDER FRAMES]]: in the background, once the cameras have their format; $feeder is its
# process id. With LOG each picture is shown until this file has grown. The second folder is for the second camera.
feed() {
  "$build/bin/virtual_camera" feed "$2" "${4:-}" /dev/video10 "$1" "$3" ${5:+/dev/video11 "$5" "$6"} >"$tmp/feeder" &
  feeder=$!
  until grep -q feeding "$tmp/feeder"; do
    kill -0 $feeder 2>/dev/null || fail "the virtual camera cannot be fed"
    sleep 0.05
  done
}
stop_feeding() {
  [[ -n ${feeder:-} ]] || return
  kill "$feeder" 2>/dev/null
  wait "$feeder" 2>/dev/null
  feeder=
}
# small_config RATE: of the scanned pictures; without what other tests show, for which the emulated processor takes 15 s
# each
small_config() {
  sed "s/track_config:/&\n    relocalize: false/
    s/ppmm:.*/ppmm: 0.1268/; s/ imgh:.*/ imgh: 120/; s/ imgw:.*/ imgw: 160/; s/raw_imgh:.*/raw_imgh: 168/
    s/raw_imgw:.*/raw_imgw: 224/; s/framerate:.*/framerate: $1/; /calibration_model_path/d" "$data/config.yaml"
}
load_vivid() {
  busybox insmod "$cache/modules/vivid.ko" n_devs=1 node_types=0x20001 num_inputs=1 input_types=0x0 \
    vid_cap_nr=20 meta_cap_nr=21
}

# The next script finds the machine as this one did.
clean_up() {
  stop_feeding
  for module in vivid v4l2loopback; do busybox rmmod $module 2>/dev/null; done
}
trap clean_up EXIT
