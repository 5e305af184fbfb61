#!/usr/bin/env bash
# Makes the Debian packages of a build folder, looks into them, and runs the program that they hold.
# usage: debian_test.sh PACKAGE_SCRIPT BUILD
set -euo pipefail
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
fail() { echo "debian_test: $*" >&2; exit 1; }
# grep -q would leave at the first match, and what writes into it would fail.
holds() { (($(grep -c -- "$1") > 0)); }

"$1" --build "$2" "$work"
contents() { dpkg-deb -c "$work"/"$1"_*.deb | awk '{ print $NF }'; }
contents gelslam >"$work/program"
for file in usr/bin/gelslam usr/share/man/man1/gelslam.1.gz usr/share/bash-completion/completions/gelslam \
  usr/share/applications/gelslam.desktop \
  usr/share/icons/hicolor/scalable/apps/gelslam.svg usr/share/doc/gelslam/examples/cpp/CMakeLists.txt; do
  grep -qx "./$file" "$work/program" || fail "gelslam lacks $file"
done
contents libgelslam-dev | holds 'cmake/gelslam/gelslamConfig.cmake$' || fail "libgelslam-dev lacks its CMake package"
if compgen -G "$work/python3-gelslam_*.deb" >/dev/null; then
  contents python3-gelslam | holds '^./usr/lib/python3/dist-packages/gelslam/_core' || fail "python3-gelslam lies elsewhere"
  dpkg-deb -f "$work"/python3-gelslam_*.deb Depends | holds 'python3 (<< 3' || fail "python3-gelslam goes with any Python"
  dpkg-deb -I "$work"/python3-gelslam_*.deb prerm | holds py3clean || fail "python3-gelslam leaves compiled files"
fi

dpkg-deb -x "$work"/gelslam_*.deb "$work/root"
version=$("$work/root/usr/bin/gelslam" --version)
system=$(. /etc/os-release && echo "$ID${VERSION_ID:-}")
[[ $(dpkg-deb -f "$work"/gelslam_*.deb Version) == "${version##* }+$system" ]] || fail "the program is of another version: $version"
dpkg-deb -f "$work"/gelslam_*.deb Depends | holds libopencv-core || fail "no dependencies"
zcat "$work/root/usr/share/man/man1/gelslam-calibrate-train.1.gz" | holds 'steps' || fail "a command has no manual page"
# The links of the pages hold in the package, but those to the code.
documents=$work/root/usr/share/doc/gelslam
while IFS=: read -r page link; do
  [[ -e $documents/$(dirname "$page")/$link ]] || fail "$page links to $link, which is not in the package"
done < <(cd "$documents" && grep -oHE '\]\([A-Za-z0-9./_-]+' README.md docs/*.md | sed 's/](//' |
  grep -vE ':(https?|LICENSE|\.\./(libs|scripts)/.*)$')
udev=$(find "$work/root" -path '*/lib/udev/rules.d/61-gelslam.rules')  # in /usr on newer systems
if command -v desktop-file-validate >/dev/null; then desktop-file-validate "$work/root/usr/share/applications/gelslam.desktop"; fi
[[ $(grep -c 'SYMLINK' "$udev") == 1 ]] || fail "the udev rule gives no name"

# Completion, by the program in the package.
complete_words() {
  PATH=$work/root/usr/bin:$PATH bash -c '. "$0"; COMP_WORDS=("$@"); COMP_CWORD=$(($# - 1)); _gelslam; echo "${COMPREPLY[@]}"' \
    "$work/root/usr/share/bash-completion/completions/gelslam" "$@"
}
[[ $(complete_words gelslam rec) == "reconstruct record" ]] || fail "completes commands wrongly: $(complete_words gelslam rec)"
[[ $(complete_words gelslam calibrate tr) == train ]] || fail "completes no subcommands"
[[ $(complete_words gelslam reconstruct log.avi --overw) == --overwrite ]] || fail "completes no options"
if command -v lintian >/dev/null; then lintian --fail-on error --allow-root "$work"/*.deb; fi
