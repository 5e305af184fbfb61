#!/usr/bin/env bash
# usage: scripts/results.sh [--only PART,...] DATA [REAL]
#
# Measures what README.md and docs/results.md state (45 minutes on two idle cores), writes docs/results.json with commit
# and processor, draws the charts and renders both texts (scripts/results.py). What is not run stays as it was measured.
#
# DATA: rendered sequences with truth, and presses of real sensors. REAL: a folder of logs of real sensors:
# NAME/{left,right}.avi, NAME/background_{left,right}.png, NAME/pair.json (ppmm, start, end). Neither can be downloaded.
# The parts "simulated", "demo", "followed", "long" and "growth" need none of it (DATA: any folder), for they simulate what
# they measure.
# NO_BUILD=1 takes what is built. PUBLIC=DIR also runs the public system (scripts/public_system.sh).
#
#   --only    of: models simulated accuracy demo stability mechanisms calibration real live real_live followed long growth speed public
#             (accuracy and calibration need models; from live on an idle machine is needed)
#
# Tables stay in build/results. Needs jq and python3-opencv, too.
. "$(dirname "$0")/common.sh"

only=
parse --only= 1 2 "$@"
data=$(realpath -e "${arguments[0]}")
real=${arguments[1]:+$(realpath -e "${arguments[1]}")}
[[ -z ${PUBLIC:-} ]] || PUBLIC=$(realpath -e "$PUBLIC")
cd "$root"
export GELSLAM_DATA=$data  # of check_sequences.py
out=$root/build/results gelslam=build/bin/gelslam lab=build/bin/gelslam-lab
commit=$(git rev-parse --short=8 HEAD)
mkdir -p "$out"
[[ -n ${NO_BUILD:-} ]] || scripts/build.sh --lab --python build
sequences=("$data"/sequences/*/) tracks=("$data"/sequences/track_*/)
optics=("$data"/optics/optics_*/)

check() {  # name of the table, an option, folders of logs
  local status=0 names=("${@:3}")
  names=("${names[@]%/}")
  scripts/check_sequences.py --out "$out/runs" --json "$out/$1.json" "${@:2:1}" "${names[@]##*/}" >"$out/$1.txt" || status=$?
  ((status <= 1)) || exit "$status"  # 1: a target is missed
}

models() {
  "$gelslam" calibrate train "$data/calibration_sim" -o "$out/models/flat.json" -q &
  "$gelslam" calibrate train "$data/optics/calibration" -o "$out/models/optics.json" -q || (($? == 1))
  wait $! || (($? == 1))
  # Every fifth press is for the check.
  for share in train check; do
    mkdir -p "$out/models/$share"
    ln -s "$data"/calibration/*mm "$data/calibration/background.png" "$out/models/$share"
  done
  awk 'NR == 1 || (NR - 2) % 5' "$data/calibration/catalog.csv" >"$out/models/train/catalog.csv"
  awk 'NR == 1 || (NR - 2) % 5 == 0' "$data/calibration/catalog.csv" >"$out/models/check/catalog.csv"
  "$gelslam" calibrate train "$out/models/train" --automatic -o "$out/models/real.json" -q || (($? == 1))
  scripts/simulated_models.sh "$gelslam" "$out/models" mini
}

accuracy() {
  check accuracy/network
  check accuracy/own --extra="--model $out/models/flat.json" "${sequences[@]}" "$data"/ablation/*/
  check accuracy/optics_own --extra="--model $out/models/optics.json" "${optics[@]}"
  sed '/^device_config:/a\  optics: {lens_k1: 0, camera_distance_mm: 0, gel_dome_per_mm: [0, 0]}' "${optics[0]}/config.yaml" >"$out/accuracy/flat.yaml"
  check accuracy/optics_flat --extra="--config $out/accuracy/flat.yaml --model $data/optics/calibration/model/nnmodel.pth" "${optics[@]}"
}

simulated() {  # every object and two motions, with three seeds of shape and hand
  for log in {pebble,peanut,coin,plank,golf,knurl,screw,sphere}/{wobble,allover}/{1,2,3}; do echo "$log"; done |
    xargs -P 2 -I{} bash -ec '
      IFS=/ read -r object motion seed <<<"{}"
      name=${object}_${motion}_$seed log=$1/log_$object$motion$seed run=$1/run_$object$motion$seed
      options=()
      [[ $motion != allover ]] || options=(--size 0.5 --frames 500)  # all over a larger one, the hand is too fast
      "$0" simulate scan --object "$object" --motion "$motion" --seed "$seed" "${options[@]}" -o "$log" -q
      (cd "$log"; sha256sum gelsight.avi true_start_T_currs.npy gt_mesh.ply touched.npy) >"$1/$name.sums"
      "$0" reconstruct "$log" -o "$run" -q 2>>"$1/log.txt" || (($? == 1))
      "$0" evaluate "$run" --truth "$log" --json >"$1/$name.json"
      rm -r "$log" "$run"' "$gelslam" "$out/simulated"
  (cd "$out/simulated"; cat ./*.sums | sha256sum | cut -c 1-16) >"$out/simulated/checksum"
}

demo() {  # scripts/demo.sh, with ten seeds of the hand
  for seed in {1..10}; do echo "$seed"; done | xargs -P 2 -I{} bash -ec '
    "$0" simulate scan --object pebble --size 0.5 --indentation 0.8 --motion allover --frames 400 --seed {} -o "$1/log{}" -q
    "$0" reconstruct "$1/log{}" -o "$1/run{}" -q
    "$0" evaluate "$1/run{}" --truth "$1/log{}" --json >"$1/{}.json"' "$gelslam" "$out/demo"
  rm -r "$out"/demo/{log,run}*
}

stability() {
  "$lab" stability "${tracks[@]}" --methods fpfh -o "$out/stability/fpfh" >/dev/null &
  "$lab" stability "${tracks[@]}" --methods normalflow,icp,icp-tuned,filterreg,filterreg-tuned -o "$out/stability/others" >/dev/null
  wait $!
  jq -s add "$out"/stability/{others,fpfh}/stability.json >"$out/stability/stability.json"
}

mechanisms() {
  "$lab" ablation "${optics[@]}" --only lens,perspective,dome --threads 2 -o "$out/mechanisms" >/dev/null
}

checked() {  # name, model, presses: of all of them, and of each alone
  local one=$out/calibration/one_press row
  "$gelslam" calibrate check "$2" "$3" -q >"$out/calibration/$1.txt" || (($? == 1))
  mkdir "$one"
  find "$3/" -mindepth 1 -maxdepth 1 ! -name catalog.csv -exec ln -s -t "$one" {} +
  for ((row = 2; row <= $(wc -l <"$3/catalog.csv"); ++row)); do
    sed -n "1p;${row}p" "$3/catalog.csv" >"$one/catalog.csv"
    "$gelslam" calibrate check "$2" "$one" -q 2>/dev/null || (($? <= 2))  # 2: the press cannot be used
  done >"$out/calibration/$1.each"
  rm -r "$one"
}
calibration() {
  for presses in calibration calibration_b markers; do
    checked "maker_$presses" "$data/real/nnmini.pt" "$data/$presses"
  done
  checked own "$out/models/real.json" "$out/models/check"
  checked owner "$data/calibration/model/nnmodel.pth" "$out/models/check"
  PYTHONPATH=build/python scripts/slopes_read.py "$data" "$out/calibration" >/dev/null
}

real_logs() {  # part, options of scan
  for log in "$real"/*/*.avi; do echo "$log"; done | xargs -P 2 -I{} bash -ec '
    log={} gelslam=$0 out=$1 model=$2 finger=$(basename {} .avi)
    pair=$(dirname "$log")
    run=$out/$(basename "$pair")_$finger
    ppmm=$(jq .ppmm "$pair/pair.json")
    echo "device_config: {ppmm: $ppmm}" >"$run.yaml"
    "$gelslam" scan "$log" "${@:3}" --headless -q --time start --background "$pair/background_$finger.png" \
      --model "$model" --config "$run.yaml" -o "$run" --overwrite 2>>"$out/log.txt" || (($? == 1))
    scripts/still_moved.py "$log" "$pair/background_$finger.png" "$run/trajectory.tum" --pitch "$ppmm" \
      --first "$(jq .start "$pair/pair.json")" --last "$(jq .end "$pair/pair.json")" >"$run.json"
    rm -r "$run"' "$gelslam" "$out/$1" "$data/real/nnmini.pt" "${@:2}"
}
real() {
  real_logs real --every-frame
}

live() {
  check live/live --live "$data"/sequences/{track,hard}_*/
}

real_live() {
  real_logs real_live
}

followed() {
  scripts/speed_followed.py "$out/followed" ${PUBLIC:+--public "$PUBLIC" --public-model "$out/models/mini.pth"} >"$out/followed/table.txt"
  rm -rf "$out"/followed/log_*
}

long() {
  "$lab" long-scan --frames 10000 -o "$out/long" >"$out/long/table.txt"
}

growth() {
  scripts/map_growth.py "$out/growth" --gelslam "$gelslam" >"$out/growth/table.txt"
  rm -rf "$out"/growth/{scan,part,next,killed,fused,live,run_*}
}

speed() {
  "$lab" speed-accuracy "$data"/sequences/{track,hard,scan}_*/ --slow-every 12 -o "$out/speed" >/dev/null
  "$lab" soak "$data/sequences/track_coin" --minutes 1 >"$out/speed/soak.txt"
  for i in 1 2 3; do
    for log in track_golf scan_peanut360; do
      taskset -c 1 "$gelslam" reconstruct "$data/sequences/$log" -o "$out/speed/$log-$i" -q
    done
  done
}

public() {
  scripts/side_by_side.sh "$PUBLIC" "$out/public" "$data"/sequences/{track_pebble,scan_peanut360} "$data/optics/optics_bolt" >"$out/public/table.txt"
  # Its errors, of the largest group of its frames: the only ones that share a frame of reference.
  local errors=$out/public/errors log name
  for log in "${tracks[@]}" "${optics[@]}" "$data"/sequences/scan_{peanut360,pebblescan}/; do
    name=$(basename "$log")
    [[ $name != optics_tread9 ]] || continue  # a scan of one of them
    scripts/public_system.sh "$PUBLIC" "$errors" "$log" >/dev/null
    mkdir "$errors/$name/run"
    awk 'NR == FNR { group[FNR] = $2; if (++frames[$2] > frames[most]) most = $2; next } group[FNR] == most' \
      "$errors/$name"/slam_groups.txt "$errors/$name"/slam.tum >"$errors/$name/run/trajectory.tum"
    [[ $name != scan_* ]] || cp "$errors/$name/mesh.ply" "$errors/$name/run"
    "$gelslam" evaluate "$errors/$name/run" --truth "$log" --json >"$errors/$name.json"
  done
}

for part in models simulated accuracy demo stability mechanisms calibration ${real:+real} live ${real:+real_live} followed long growth speed ${PUBLIC:+public}; do
  [[ -z $only || ,$only, == *,$part,* ]] || continue
  say "$part, $(date +%H:%M:%S)"
  rm -rf "${out:?}/$part"
  mkdir -p "$out/$part"
  "$part"
  echo "$commit" >"$out/$part/commit"
  lscpu | sed -n 's/^Model name: *//p' >"$out/$part/machine"
done
scripts/results.py "$out"
