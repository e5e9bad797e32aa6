#!/usr/bin/env bash
# Watches a running system with the real lcm-spy. See --help.
set -euo pipefail
top=$(cd "$(dirname "${BASH_SOURCE[0]}")/.." && pwd)
usage() {
  cat <<'EOT'
Usage: scripts/spy.sh [--port N | --lcm-url URL] [--jar-only]

Builds the message types for Java (build/spy/dmslam-types.jar, where they have changed) and starts lcm-spy with them.
Debian's own `lcm-spy` wrapper does not start on Java 17, so the class is started here as it should be.

  --port N        of the system to watch, on this host (default 7670); scripts/run.sh takes --port too
  --lcm-url URL   any other bus
  --jar-only      build the types and print their path

In lcm-spy: a double click on a channel shows its newest message, decoded; a click on one of its curves makes a chart.
Good ones to plot: DMSLAM_FRONTEND_POSE (inliers, moving_share, latency_ms, error_m) and the STATUS channels (rates, queue
depths, drops, repairs). Two hints: rates read too low where the kernel's receive buffer is small, since lcm-spy takes the
default one (`sysctl -w net.core.rmem_default=4194304`); channels with a prefix are decoded as well.
EOT
}
fail() { echo "spy.sh: $*" >&2; exit 1; }
url="udpm://239.255.76.67:7670?ttl=0" jar_only=0
while (($#)); do
  case $1 in
    -h | --help) usage; exit 0 ;;
    --port | --lcm-url)
      (($# > 1)) || fail "$1 needs a value (see --help)"
      [[ $1 == --lcm-url ]] && url=$2 || url="udpm://239.255.76.67:$2?ttl=0"
      shift 2
      ;;
    --jar-only) jar_only=1; shift ;;
    *) fail "unknown option $1 (see --help)" ;;
  esac
done

lcm_jar=/usr/share/java/lcm.jar chart_jar=/usr/share/java/jchart2d.jar
for tool in lcm-gen java javac jar; do
  command -v $tool >/dev/null || fail "$tool is missing; run scripts/setup.sh core tools"
done
[[ -s $lcm_jar && -s $chart_jar ]] || fail "LCM's Java package or jchart2d is missing; run scripts/setup.sh tools"

types=$top/build/spy/dmslam-types.jar
if [[ ! -s $types || -n $(find "$top/lcmtypes" -name '*.lcm' -newer "$types") ]]; then
  work=$(mktemp -d)
  trap 'rm -rf -- "$work"' EXIT
  mkdir -p "$top/build/spy" "$work/classes"
  lcm-gen -j --jpath="$work" "$top"/lcmtypes/dmslam_*_t.lcm
  javac -nowarn -d "$work/classes" -cp "$lcm_jar" "$work"/dmslam/*.java
  jar cf "$work/types.jar" -C "$work/classes" .
  mv "$work/types.jar" "$types"
  rm -rf -- "$work"
  trap - EXIT
fi
if ((jar_only)); then echo "$types"; exit 0; fi
[[ -n ${DISPLAY:-} ]] || fail "there is no display (DISPLAY is not set); scripts/spy_picture.sh needs none"
# Types are looked for in CLASSPATH; the program itself comes from -cp.
CLASSPATH=$types exec java -Djava.net.preferIPv4Stack=true -cp "$lcm_jar:$chart_jar" lcm.spy.Spy -l "$url"
