#!/usr/bin/env bash
# Installs what a part of the project needs, from Debian's packages only: scripts/setup.sh core|test|tools|viewer|browser|package...
set -euo pipefail
core=(build-essential cmake ninja-build ccache pkg-config
  liblcm-dev liblcm-bin libglib2.0-dev
  libopencv-core-dev libopencv-imgproc-dev libopencv-imgcodecs-dev libopencv-features2d-dev libopencv-calib3d-dev
  libopencv-videoio-dev libeigen3-dev libceres-dev libspdlog-dev libcli11-dev libyaml-cpp-dev nlohmann-json3-dev
  libturbojpeg0-dev zlib1g-dev)
test=(libgtest-dev libbenchmark-dev iproute2 nftables python3-minimal)
tools=(default-jre default-jdk-headless liblcm-java libjchart2d-java xvfb xdotool imagemagick)
viewer=(libcpp-httplib-dev libjs-three libjs-chart.js)
browser=(chromium python3-websocket)
package=(dpkg-dev file)
usage() { echo "Usage: scripts/setup.sh PART...   with PART one of: core test tools viewer browser (to test the viewer) package"; }
[ $# -gt 0 ] || { usage >&2; exit 2; }
packages=()
for part in "$@"; do
  case "$part" in
    core) packages+=("${core[@]}") ;;
    test) packages+=("${core[@]}" "${test[@]}" "${viewer[@]}" "${browser[@]}") ;;
    tools) packages+=("${tools[@]}") ;;
    package) packages+=("${package[@]}") ;;
    browser) packages+=("${browser[@]}") ;;
    viewer) packages+=("${core[@]}" "${viewer[@]}") ;;
    -h | --help) usage; exit 0 ;;
    *) echo "setup.sh: there is no part '$part'" >&2; usage >&2; exit 2 ;;
  esac
done
missing=()
for package in "${packages[@]}"; do
  dpkg-query -W -f='${Status}' "$package" 2>/dev/null | grep -q "install ok installed" || missing+=("$package")
done
[ ${#missing[@]} -gt 0 ] || exit 0
sudo=()
if [ "$(id -u)" != 0 ]; then
  command -v sudo >/dev/null || { echo "setup.sh: these packages are missing: ${missing[*]}; install them as root" >&2; exit 1; }
  sudo=(sudo)
fi
export DEBIAN_FRONTEND=noninteractive
"${sudo[@]}" apt-get update -q >/dev/null
"${sudo[@]}" apt-get install -y -q --no-install-recommends "${missing[@]}" >/dev/null ||
  { echo "setup.sh: apt-get could not install: ${missing[*]}" >&2; exit 1; }
