#!/usr/bin/env bash
# Debian packages of the programs and of the libraries. See --help.
set -euo pipefail
top=$(cd "$(dirname "${BASH_SOURCE[0]}")/.." && pwd)
out=$top/out/package
usage() {
  cat <<EOF
Usage: scripts/package.sh [--out DIR]

Installs what is missing, builds (preset package: release, for /usr) and makes two Debian packages: dmslam (programs, message
definitions, cameras, vocabulary, systemd units, man pages, documents) and dmslam-dev (headers, libraries, find_package).

  --out DIR    where they go (default: out/package in the project)
EOF
}
while [ $# -gt 0 ]; do
  case "$1" in
    --out) [ $# -ge 2 ] || { echo "package.sh: --out needs a folder" >&2; exit 2; }; out=$2; shift 2 ;;
    -h | --help) usage; exit 0 ;;
    *) echo "package.sh: unknown option $1 (see --help)" >&2; exit 2 ;;
  esac
done
"$top/scripts/setup.sh" core viewer package
echo "package.sh: building (a few minutes the first time)" >&2
"$top/scripts/build.sh" package
mkdir -p "$out"
out=$(cd "$out" && pwd)
log=$(mktemp)
trap 'rm -rf "$log" "$out/_CPack_Packages"' EXIT
(cd "$top/build/package" && cpack -G DEB -B "$out") >"$log" 2>&1 || { cat "$log" >&2; exit 1; }
ls "$out"/*.deb
