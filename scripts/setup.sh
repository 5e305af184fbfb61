#!/usr/bin/env bash
# Installs the Debian packages that building, testing and plotting need: only those that are missing, without questions.
set -euo pipefail

packages=(
  g++ cmake ninja-build ccache pkg-config    # build
  libeigen3-dev libopencv-dev libceres-dev libopen3d-dev libembree-dev
  libcli11-dev libyaml-cpp-dev nlohmann-json3-dev libfmt-dev libzip-dev
  libturbojpeg0-dev zlib1g-dev libavformat-dev libavcodec-dev libavutil-dev # camera pictures, logs
  libglfw3-dev libepoxy-dev libimgui-dev         # window
  fonts-dejavu-core                              # its letters
  xvfb xauth libgl1-mesa-dri                     # its tests, without a display
  libgtest-dev libgmock-dev libbenchmark-dev # tests and benchmarks
  python3-numpy python3-matplotlib           # figures
)

say() { echo "setup: $*"; }

if ! command -v dpkg-query >/dev/null || ! command -v apt-get >/dev/null; then
  say "this is no Debian-like system; install what these packages hold yourself: ${packages[*]}" >&2
  exit 1
fi

missing=()
for package in "${packages[@]}"; do
  status=$(dpkg-query --show --showformat '${db:Status-Status}' "$package" 2>/dev/null || true)
  [[ $status == installed ]] || missing+=("$package")
done
if ((${#missing[@]} == 0)); then
  say "all ${#packages[@]} packages are installed"
  exit 0
fi

as_root=()
if ((EUID != 0)); then
  if ! command -v sudo >/dev/null; then
    say "missing ${missing[*]}; run as root: apt-get install --no-install-recommends ${missing[*]}" >&2
    exit 1
  fi
  as_root=(sudo)
fi

update() {
  say "refreshing the package lists"
  "${as_root[@]}" apt-get update -qq
}
install() {
  "${as_root[@]}" env DEBIAN_FRONTEND=noninteractive apt-get install -qq -y --no-install-recommends "${missing[@]}"
}

updated=false
for package in "${missing[@]}"; do
  if ! apt-cache show "$package" >/dev/null 2>&1; then
    update
    updated=true
    break
  fi
done
say "installing ${missing[*]}"
if ! install; then
  # Old lists name files that the mirrors have replaced.
  if $updated; then exit 1; fi
  update
  install
fi
say "done"
