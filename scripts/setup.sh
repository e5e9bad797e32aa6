#!/usr/bin/env bash
# Installs what parts of the project need, from Debian's packages only:
# scripts/setup.sh core|test|tools|viewer|browser|package|shield...
set -euo pipefail
core=(build-essential cmake ninja-build ccache pkg-config
  liblcm-dev liblcm-bin libglib2.0-dev
  libopencv-core-dev libopencv-imgproc-dev libopencv-imgcodecs-dev libopencv-features2d-dev libopencv-calib3d-dev
  libopencv-videoio-dev libeigen3-dev libceres-dev libspdlog-dev libcli11-dev libyaml-cpp-dev nlohmann-json3-dev
  libturbojpeg0-dev zlib1g-dev libsodium-dev)
test=(libgtest-dev libbenchmark-dev iproute2 nftables python3-minimal)
tools=(default-jre default-jdk-headless liblcm-java libjchart2d-java xvfb xdotool imagemagick)
viewer=(libjs-three libjs-chart.js)
browser=(chromium python3-websocket)
package=(dpkg-dev file)
shield=(nftables)
usage() {
  echo "Usage: scripts/setup.sh PART..."
  echo "with PART one of: core test tools viewer browser (to test the viewer) package shield"
  echo "shield: loads a firewall rule that keeps crafted fragments from LCM, now and at every start (docs/security.md)"
}
[ $# -gt 0 ] || { usage >&2; exit 2; }
packages=() load_shield=0
for part in "$@"; do
  case "$part" in
    core) packages+=("${core[@]}") ;;
    test) packages+=("${core[@]}" "${test[@]}" "${viewer[@]}" "${browser[@]}") ;;
    tools) packages+=("${tools[@]}") ;;
    shield) packages+=("${shield[@]}") load_shield=1 ;;
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
top=$(cd "$(dirname "${BASH_SOURCE[0]}")/.." && pwd)
sudo=()
if [ "$(id -u)" != 0 ] && { [ ${#missing[@]} -gt 0 ] || [ "$load_shield" = 1 ]; }; then
  command -v sudo >/dev/null || { echo "setup.sh: this needs root: install ${missing[*]:-nothing}, load config/shield.nft" >&2; exit 1; }
  sudo=(sudo)
fi
if [ ${#missing[@]} -gt 0 ]; then
  export DEBIAN_FRONTEND=noninteractive
  "${sudo[@]}" apt-get update -q >/dev/null
  "${sudo[@]}" apt-get install -y -q --no-install-recommends "${missing[@]}" >/dev/null ||
    { echo "setup.sh: apt-get could not install: ${missing[*]}" >&2; exit 1; }
fi
[ "$load_shield" = 1 ] || exit 0
"${sudo[@]}" nft -f "$top/config/shield.nft" ||
  { echo "setup.sh: the rule could not be loaded; does this kernel have nf_tables, and may you change it?" >&2; exit 1; }
echo "the shield is up (nft list table inet dmslam_shield)"
# At every start: where systemd runs, and this is not a network namespace of its own.
if [ -d /run/systemd/system ] && [ /proc/self/ns/net -ef /proc/1/ns/net ]; then
  "${sudo[@]}" install -D -m 644 "$top/config/shield.nft" /etc/dmslam/shield.nft
  "${sudo[@]}" install -m 644 "$top/config/systemd/dmslam-shield.service" /etc/systemd/system/
  "${sudo[@]}" systemctl daemon-reload
  "${sudo[@]}" systemctl enable -q dmslam-shield
else
  echo "it is gone at the next start of this host: load config/shield.nft from the start-up files"
fi
