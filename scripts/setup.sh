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
. "$(dirname "$0")/common.sh"

# Their names are the same in Debian 12, Debian 13 and Ubuntu 24.04.
needed=(
  g++ cmake ninja-build ccache pkg-config # build
  libeigen3-dev libopencv-dev libceres-dev libassimp-dev libembree-dev libmeshoptimizer-dev
  libcli11-dev libyaml-cpp-dev nlohmann-json3-dev libfmt-dev libzip-dev libsqlitecpp-dev libcpp-httplib-dev
  libturbojpeg0-dev libpng-dev zlib1g-dev                            # pictures
  libavformat-dev libavcodec-dev libavutil-dev libswscale-dev         # videos, logs
  libglfw3-dev libepoxy-dev libimgui-dev fonts-dejavu-core            # window
  libgl1-mesa-dri libegl1                                             # pictures without a display
)
optional_packages=(libopen3d-dev) # Ubuntu 24.04 does not have it
without_optional="the program makes no watertight meshes, and the laboratory is not built"
browser_packages=(chromium chromium-driver python3-selenium) # Ubuntu 24.04 has no driver
test_packages=(
  libgtest-dev libgmock-dev libbenchmark-dev
  xvfb xauth                       # windows without a display
  python3-numpy python3-matplotlib python3-pandas python3-scipy # charts
  python3-venv                     # the wheel, installed
  jupyter-nbconvert python3-ipykernel # the notebook
)
python_packages=(python3-dev python3-numpy python3-pybind11 pybind11-dev)
package_packages=("${python_packages[@]}" dpkg-dev debhelper dh-python help2man)
wheel_packages=("${python_packages[@]}" dpkg-dev nasm patchelf python3-wheel python3-venv)
reference_packages=(doxygen)
check_packages=(clang-format clang-tidy python3-ament-flake8 python3-ament-pep257
  ros-geometry-msgs ros-sensor-msgs ros-std-msgs ros-std-srvs) # of the ROS 2 bridge

tests='' python='' packages='' wheel='' reference='' checks='' no_install=''
parse "--tests --python --packages --wheel --reference --checks --no-install" 0 0 "$@"
if [[ -n $tests ]]; then
  needed+=("${test_packages[@]}" "${package_packages[@]}" "${wheel_packages[@]}")
  optional_packages+=("${browser_packages[@]}")
  without_optional+="; or pages are not tried in a browser"
fi
[[ -z $python ]] || needed+=("${python_packages[@]}")
[[ -z $packages ]] || needed+=("${package_packages[@]}")
[[ -z $wheel ]] || needed+=("${wheel_packages[@]}")
[[ -z $reference ]] || needed+=("${reference_packages[@]}")
[[ -z $checks ]] || needed+=("${check_packages[@]}")

if ! command -v dpkg-query >/dev/null || ! command -v apt-get >/dev/null; then
  say "this is no Debian-like system; install the equivalents of: ${needed[*]}" >&2
  # The compiler finds out what is missing.
  if [[ -z $no_install ]]; then exit 1; else exit 0; fi
fi

# missing_of PACKAGE...: one per line.
missing_of() {
  local package
  for package in "$@"; do
    [[ $(dpkg-query --show --showformat '${db:Status-Status}' "$package" 2>/dev/null || true) == installed ]] || echo "$package"
  done
}
mapfile -t missing < <(missing_of "${needed[@]}")

as_root() {
  if ((EUID == 0)); then "$@"; else sudo "$@"; fi
}
if ((${#missing[@]} > 0)) && [[ -z $no_install ]]; then
  if ((EUID != 0)) && ! command -v sudo >/dev/null; then
    say "missing ${missing[*]}; run as root: apt-get install --no-install-recommends ${missing[*]}" >&2
    exit 1
  fi
  say "missing: ${missing[*]}; refreshing the package lists"
  as_root apt-get update -qq
fi
for package in $(missing_of "${optional_packages[@]}"); do
  if apt-cache show "$package" >/dev/null 2>&1; then missing+=("$package"); else say "no package $package here: $without_optional"; fi
done
if ((${#missing[@]} == 0)); then
  say "all ${#needed[@]} packages are installed"
  exit 0
fi
if [[ -n $no_install ]]; then
  say "missing: ${missing[*]}" >&2
  exit 1
fi
say "installing with apt-get: ${missing[*]} (--no-install refuses)"
as_root env DEBIAN_FRONTEND=noninteractive apt-get install -qq -y --no-install-recommends "${missing[@]}"
say "done"
