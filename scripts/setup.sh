#!/usr/bin/env bash
# usage: scripts/setup.sh [--tests] [--python] [--packages] [--wheel] [--reference] [--checks] [--no-install]
#
# Installs what building and running the program needs, where it is missing, without questions.
#   --tests        also what the tests, the laboratory, the charts and the Python module need
#   --python       also what the Python module needs
#   --packages     also what scripts/package.sh needs
#   --wheel        also what scripts/build_wheel.sh needs
#   --reference    also what scripts/api_reference.sh needs
#   --checks       also clang-format, clang-tidy and ROS 2's linters
#   --no-install   only say what is missing; exit code 1 if something is
set -euo pipefail

usage() { sed -n '2,/^set /s/^# \?//p' "$0"; }

# Their names are the same in Debian 12, Debian 13 and Ubuntu 24.04.
packages=(
  g++ cmake ninja-build ccache pkg-config # build
  libeigen3-dev libopencv-dev libceres-dev libassimp-dev libembree-dev libmeshoptimizer-dev
  libcli11-dev libyaml-cpp-dev nlohmann-json3-dev libfmt-dev libzip-dev libsqlite3-dev libcpp-httplib-dev
  libturbojpeg0-dev libpng-dev zlib1g-dev                            # pictures
  libavformat-dev libavcodec-dev libavutil-dev libswscale-dev         # videos, logs
  libglfw3-dev libepoxy-dev libimgui-dev fonts-dejavu-core            # window
  libgl1-mesa-dri libegl1                                             # pictures without a display
  python3                                                             # the demo's summary
)
optional_packages=(libopen3d-dev) # Ubuntu 24.04 does not have it
without_optional="the program makes no watertight meshes, and the laboratory is not built"
browser_packages=(chromium chromium-driver python3-selenium) # Ubuntu 24.04 has no driver
test_packages=(
  libgtest-dev libgmock-dev libbenchmark-dev
  xvfb xauth                       # windows without a display
  python3-numpy python3-matplotlib python3-scipy # charts
  python3-venv                     # the wheel, installed
  jupyter-nbconvert python3-ipykernel # the notebook
)
python_packages=(python3-dev python3-numpy python3-pybind11 pybind11-dev)
package_packages=("${python_packages[@]}" dpkg-dev)
wheel_packages=("${python_packages[@]}" dpkg-dev nasm patchelf python3-wheel python3-venv)
reference_packages=(doxygen)
check_packages=(clang-format clang-tidy python3-ament-flake8 python3-ament-pep257
  ros-geometry-msgs ros-sensor-msgs ros-std-msgs ros-std-srvs) # of the ROS 2 bridge

install=true
for argument in "$@"; do
  case $argument in
    --tests)
      packages+=("${test_packages[@]}" "${package_packages[@]}" "${wheel_packages[@]}")
      optional_packages+=("${browser_packages[@]}")
      without_optional+="; or pages are not tried in a browser"
      ;;
    --python) packages+=("${python_packages[@]}") ;;
    --packages) packages+=("${package_packages[@]}") ;;
    --wheel) packages+=("${wheel_packages[@]}") ;;
    --reference) packages+=("${reference_packages[@]}") ;;
    --checks) packages+=("${check_packages[@]}") ;;
    --no-install) install=false ;;
    -h | --help) usage; exit 0 ;;
    *) usage >&2; exit 2 ;;
  esac
done

say() { echo "setup: $*"; }

if ! command -v dpkg-query >/dev/null || ! command -v apt-get >/dev/null; then
  say "this is no Debian-like system; install the equivalents of: ${packages[*]}" >&2
  # The compiler finds out what is missing.
  if $install; then exit 1; else exit 0; fi
fi

is_installed() { [[ $(dpkg-query --show --showformat '${db:Status-Status}' "$1" 2>/dev/null || true) == installed ]]; }
is_known() { apt-cache show "$1" >/dev/null 2>&1; }
add_optional() {
  local package
  for package in "${optional_packages[@]}"; do
    if is_installed "$package"; then continue; fi
    if is_known "$package"; then missing+=("$package"); else say "no package $package here: $without_optional"; fi
  done
}

missing=()
for package in "${packages[@]}"; do
  is_installed "$package" || missing+=("$package")
done
if ((${#missing[@]} == 0)); then add_optional; fi
if ((${#missing[@]} == 0)); then
  say "all ${#packages[@]} packages are installed"
  exit 0
fi
if ! $install; then
  say "missing: ${missing[*]}" >&2
  exit 1
fi

as_root=()
if ((EUID != 0)); then
  if ! command -v sudo >/dev/null; then
    say "missing ${missing[*]}; run as root: apt-get install --no-install-recommends ${missing[*]}" >&2
    exit 1
  fi
  as_root=(sudo)
  say "calling sudo apt-get to install: ${missing[*]} (--no-install refuses)"
else
  say "installing: ${missing[*]}"
fi

update() {
  say "refreshing the package lists"
  "${as_root[@]}" apt-get update -qq
}
install_missing() {
  "${as_root[@]}" env DEBIAN_FRONTEND=noninteractive apt-get install -qq -y --no-install-recommends "${missing[@]}"
}

updated=false
for package in "${missing[@]}"; do
  if ! is_known "$package"; then
    update
    updated=true
    break
  fi
done
[[ " ${missing[*]} " == *" ${optional_packages[0]} "* ]] || add_optional
if ! install_missing; then
  # Old lists name files that the mirrors have replaced.
  if $updated; then exit 1; fi
  update
  install_missing
fi
say "done"
