#!/usr/bin/env bash
# What several cameras on hosts of their own send and receive, over links that lose packets. See --help.
set -euo pipefail

top=$(cd "$(dirname "${BASH_SOURCE[0]}")/.." && pwd)
usage() {
  cat <<'EOF'
Usage: scripts/traffic.sh --sequence DIR --also DIR [--also DIR ...] --out DIR [options]     (as root: it makes network namespaces)

A network namespace for each camera, with its player and its frontend, and one for mapper, loop closer and collector, stand
for hosts on one switch (multicast, ttl 1, link: lan). Plays the sequences at once, once per share of packets dropped, at random
where a host receives them, and writes DIR/table.md: for each camera's host and the map's what it sends, with all headers, per
second of the sequence; what was tracked, the joint ATE, and the records that were lost. Each host hears what all others send.

  --camera FILE      camera file (YAML) of all
  --drop LIST        shares of packets dropped [%], with commas (default 0,5,20)
  --kill-mapper S    in each run the mapper is killed after S seconds and started again
  --lockstep         instead of real time
  --build-dir DIR    where the programs are (default: build/release)
EOF
}
fail() { echo "traffic.sh: $*" >&2; exit 1; }

sequences=() out="" drops=0,5,20 build=$top/build/release kill_after="" player=()
while (($#)); do
  case $1 in
    -h | --help) usage; exit 0 ;;
    --lockstep) player+=("$1"); shift ;;
    --sequence | --also | --out | --drop | --build-dir | --kill-mapper | --camera)
      (($# > 1)) || fail "$1 needs a value (see --help)"
      case $1 in
        --sequence | --also) sequences+=("$2") ;;
        --out) out=$2 ;;
        --drop) drops=$2 ;;
        --build-dir) build=$2 ;;
        --kill-mapper) kill_after=$2 ;;
        --camera) player+=("$1" "$2") ;;
      esac
      shift 2
      ;;
    *) fail "unknown option $1 (see --help)" ;;
  esac
done
[[ ${#sequences[@]} -ge 2 && -n $out ]] || fail "--sequence, --also and --out are needed (see --help)"
((EUID == 0)) || fail "network namespaces need root: sudo $0 ..."
command -v nft >/dev/null || fail "nft is missing: apt-get install nftables"
build=$(cd "$build" && pwd)
cameras=${#sequences[@]} id=$$
hosts=(map)
for ((k = 0; k < cameras; ++k)); do hosts+=("camera$k"); done
children=()
end_children() {
  local child
  for child in "${children[@]}"; do kill -TERM "$child" 2>/dev/null || true; done
  sleep 0.3
  for child in "${children[@]}"; do kill -KILL "$child" 2>/dev/null || true; done
  children=()
}
cleanup() {
  local host
  end_children
  for host in switch "${hosts[@]}"; do ip netns del "dm$id$host" 2>/dev/null || true; done
}
trap cleanup EXIT
trap 'exit 130' INT TERM

make_network() {
  local host k=0
  ip netns add "dm${id}switch"
  ip -n "dm${id}switch" link add bridge type bridge mcast_snooping 0
  ip -n "dm${id}switch" link set bridge up
  for host in "${hosts[@]}"; do
    k=$((k + 1))
    ip netns add "dm$id$host"
    ip link add link0 netns "dm$id$host" type veth peer name "port$k" netns "dm${id}switch"
    ip -n "dm${id}switch" link set "port$k" master bridge
    ip -n "dm${id}switch" link set "port$k" up
    ip -n "dm$id$host" addr add "10.78.0.$k/24" dev link0
    ip -n "dm$id$host" link set lo up
    ip -n "dm$id$host" link set link0 up
    ip -n "dm$id$host" route add 224.0.0.0/4 dev link0
    ip netns exec "dm$id$host" sysctl -qw net.ipv4.ipfrag_time=2 || true
  done
}
drop() { # PERCENT: of what each host receives from others; it hears its own multicast, too
  local host k=0
  for host in "${hosts[@]}"; do
    k=$((k + 1))
    ip netns exec "dm$id$host" nft flush ruleset
    (($1 > 0)) || continue
    ip netns exec "dm$id$host" nft add table netdev loss
    ip netns exec "dm$id$host" nft "add chain netdev loss in { type filter hook ingress device link0 priority 0; }"
    ip netns exec "dm$id$host" nft add rule netdev loss in ip saddr != "10.78.0.$k" numgen random mod 100 '<' "$1" counter drop
  done
}
sent() { # HOST: bytes, with Ethernet, IP and UDP headers
  ip -n "dm$id$1" -s -j link show link0 | sed -E 's/.*"tx":\{"bytes":([0-9]+).*/\1/'
}
start() { # HOST FOLDER NAME ARGUMENTS...
  local host=$1 folder=$2 name=$3
  shift 3
  ip netns exec "dm$id$host" "$build/bin/dmslam-$name" "${common[@]}" "$@" >>"$folder/$host.$name.out" 2>>"$folder/$host.$name.log" \
    </dev/null &
  children+=($!)
  last=$!
}
play() { # FOLDER
  local folder=$1 truths=() k mapper collector
  rm -rf "$folder"
  mkdir -p "$folder"
  common=(--lcm-url "udpm://239.255.76.67:7676?ttl=1&recv_buf_size=4194304" --link lan --session $((RANDOM + 1)) --cameras "$cameras")
  for ((k = 0; k < cameras; ++k)); do
    truths+=("$([[ -f ${sequences[k]}/groundtruth.txt ]] && echo "${sequences[k]}/groundtruth.txt" || echo -)")
  done
  start map "$folder" mapper --fresh-system
  mapper=$last
  start map "$folder" loopcloser --fresh-system
  start map "$folder" collector --fresh-system --out "$folder" --ground-truth "${truths[@]}"
  collector=$last
  for ((k = 0; k < cameras; ++k)); do
    start "camera$k" "$folder" frontend --fresh-system --camera-id "$k"
    start "camera$k" "$folder" player --fresh-system --camera-id "$k" --sequence "${sequences[k]}" "${player[@]}"
  done
  if [[ -n $kill_after ]]; then
    sleep "$kill_after"
    kill -KILL "$mapper"
    start map "$folder" mapper
  fi
  wait "$collector"
}
seconds() { # FOLDER: of a sequence
  grep -v '^#' "$1/rgb.txt" | awk 'NR == 1 { first = $1 } { last = $1 } END { printf "%.3f", last - first }'
}

make_network
mkdir -p "$out"
out=$(cd "$out" && pwd)
lasts=0
for sequence in "${sequences[@]}"; do lasts=$(awk -v a="$lasts" -v b="$(seconds "$sequence")" 'BEGIN { print (a > b ? a : b) }'); done
table=$out/table.md
{
  printf '| packets dropped [%%] |'
  for host in "${hosts[@]}"; do printf ' sent by %s [kB/s] |' "$host"; done
  echo ' online, in the end [%] of each camera | joint ATE final / online [m] | other maps | records lost |'
  printf '|---|%s---|---|---|---|\n' "$(printf -- '---|%.0s' "${hosts[@]}")"
} >"$table"
status=0
for percent in ${drops//,/ }; do
  drop "$percent"
  declare -A before=()
  for host in "${hosts[@]}"; do before[$host]=$(sent "$host"); done
  folder=$out/drop_$percent
  play "$folder" || { echo "traffic.sh: the run with $percent % failed; see $folder" >&2; status=1; }
  end_children
  [[ -s $folder/summary.json ]] || continue
  {
    printf '| %s |' "$percent"
    for host in "${hosts[@]}"; do
      awk -v bytes=$(($(sent "$host") - before[$host])) -v lasts="$lasts" 'BEGIN { printf " %.0f |", bytes / lasts / 1000 }'
    done
    python3 - "$folder/summary.json" <<'EOF'
import json
import sys

summary = json.load(open(sys.argv[1]))
tracked = '; '.join(f"{c['tracked_online_percent']:.1f}, {c['tracked_percent']:.1f}" for c in summary['cameras'])
ate = ' / '.join('-' if v is None else f'{v:.4f}' for v in (summary['ate_rmse_joint'], summary['ate_rmse_joint_online']))
apart = {other['map'] for other in summary['other_maps']}  # once, however many cameras have frames in it
print(f" {tracked} | {ate} | {len(apart)} | {summary['records_lost']} |")
EOF
  } >>"$table"
done
cat "$table"
exit "$status"
