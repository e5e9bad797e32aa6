#!/usr/bin/env bash
# Runs the system on two "hosts" of this machine with a link that loses packets. See --help.
set -euo pipefail

top=$(cd "$(dirname "${BASH_SOURCE[0]}")/.." && pwd)
usage() {
  cat <<'EOF'
Usage: scripts/two_hosts.sh --sequence DIR --out DIR [options]      (as root: it makes network namespaces)

Two network namespaces with a veth pair between them stand for two hosts: player, frontend and collector run on A, mapper
and loop closer on B, with multicast over the link (ttl 1, link: lan). Plays the sequence once per share of packets dropped,
dropped at random in both directions, and writes DIR/table.md: records lost, what was tracked, how long a lost record took to
be recovered, and bytes on the link per byte of payload.

  --camera FILE      camera file (YAML)
  --drop LIST        shares of packets dropped [%], with commas (default 0,5,20)
  --frames N         at most so many frames
  --speed X          factor on the recorded rate (default 1)
  --lockstep         instead of real time
  --move-mapper S    after S seconds the mapper is killed on B and started on A
  --build-dir DIR    where the programs are (default: build/release)
EOF
}
fail() { echo "two_hosts.sh: $*" >&2; exit 1; }

sequence="" out="" drops=0,5,20 build=$top/build/release move="" player=() common=()
while (($#)); do
  case $1 in
    -h | --help) usage; exit 0 ;;
    --sequence) sequence=$2; shift 2 ;;
    --out) out=$2; shift 2 ;;
    --drop) drops=$2; shift 2 ;;
    --build-dir) build=$2; shift 2 ;;
    --move-mapper) move=$2; shift 2 ;;
    --camera | --frames | --speed) player+=("$1" "$2"); shift 2 ;;
    --lockstep) player+=("$1"); shift ;;
    *) fail "unknown option $1 (see --help)" ;;
  esac
done
[[ -n $sequence && -n $out ]] || fail "--sequence and --out are needed (see --help)"
((EUID == 0)) || fail "network namespaces need root: sudo $0 ..."
command -v nft >/dev/null || fail "nft is missing: apt-get install nftables"
build=$(cd "$build" && pwd)
id=$$ a=dmA$$ b=dmB$$
children=()
cleanup() {
  local child
  for child in "${children[@]}"; do kill -TERM "$child" 2>/dev/null || true; done
  sleep 0.3
  for child in "${children[@]}"; do kill -KILL "$child" 2>/dev/null || true; done
  ip netns del "$a" 2>/dev/null || true
  ip netns del "$b" 2>/dev/null || true
}
trap cleanup EXIT
trap 'exit 130' INT TERM

make_link() {
  local host
  ip netns add "$a"
  ip netns add "$b"
  ip link add "va$id" netns "$a" type veth peer name "vb$id" netns "$b"
  ip -n "$a" addr add 10.77.0.1/24 dev "va$id"
  ip -n "$b" addr add 10.77.0.2/24 dev "vb$id"
  for host in "$a" "$b"; do
    ip -n "$host" link set lo up
    ip netns exec "$host" sysctl -qw net.ipv4.ipfrag_time=2 || true
  done
  ip -n "$a" link set "va$id" up
  ip -n "$b" link set "vb$id" up
  ip -n "$a" route add 224.0.0.0/4 dev "va$id"
  ip -n "$b" route add 224.0.0.0/4 dev "vb$id"
}
drop() { # PERCENT: of the packets that come from the other side; multicast that a host hears of itself is on no link
  local host device other
  for host in "$a" "$b"; do
    device=va$id other=10.77.0.2
    [[ $host == "$a" ]] || device=vb$id other=10.77.0.1
    ip netns exec "$host" nft flush ruleset
    (($1 > 0)) || continue
    ip netns exec "$host" nft add table netdev loss
    ip netns exec "$host" nft "add chain netdev loss in { type filter hook ingress device $device priority 0; }"
    ip netns exec "$host" nft add rule netdev loss in ip saddr "$other" numgen random mod 100 '<' "$1" counter drop
  done
}
counter() { # HOST DEVICE NAME
  ip netns exec "$1" cat "/sys/class/net/$2/statistics/$3" 2>/dev/null ||
    ip -n "$1" -s -j link show "$2" | sed -E "s/.*\"tx\":\{\"bytes\":([0-9]+),\"packets\":([0-9]+).*/\1 \2/" | cut -d' ' -f"$([[ $3 == tx_bytes ]] && echo 1 || echo 2)"
}
on_link() { # bytes and packets sent by both sides
  echo "$(($(counter "$a" "va$id" tx_bytes) + $(counter "$b" "vb$id" tx_bytes)))" \
    "$(($(counter "$a" "va$id" tx_packets) + $(counter "$b" "vb$id" tx_packets)))"
}
start() { # HOST FOLDER NAME ARGUMENTS...
  local host=$1 folder=$2 name=$3
  shift 3
  ip netns exec "$host" "$build/bin/dmslam-$name" "${common[@]}" "$@" >>"$folder/$name.out" 2>>"$folder/$name.log" </dev/null &
  children+=($!)
  last=$!
}
play() { # FOLDER
  local folder=$1 ground_truth=() collector mapper
  mkdir -p "$folder"
  rm -f "$folder"/*.log "$folder"/*.out
  [[ ! -f $sequence/groundtruth.txt ]] || ground_truth=(--ground-truth "$sequence/groundtruth.txt")
  common=(--lcm-url "udpm://239.255.76.67:7676?ttl=1&recv_buf_size=4194304" --link lan --session $((RANDOM + 1))
    --peers "frontend,mapper,loopcloser,collector")
  start "$b" "$folder" mapper --fresh-system
  mapper=$last
  start "$b" "$folder" loopcloser --fresh-system
  start "$a" "$folder" frontend --fresh-system
  start "$a" "$folder" collector --fresh-system --out "$folder" "${ground_truth[@]}"
  collector=$last
  start "$a" "$folder" player --fresh-system --sequence "$sequence" "${player[@]}"
  if [[ -n $move ]]; then
    sleep "$move"
    kill -KILL "$mapper"
    start "$a" "$folder" mapper
  fi
  wait "$collector"
}
value() { sed -nE "s/^ *\"$2\": *([^,]*),?$/\1/p" "$1/summary.json" | head -n 1; }
largest() { # FILE KEY: the largest of a value per process
  sed -nE "/\"$2\": \{/,/\}/p" "$1/summary.json" | grep -oE '[0-9.]+,?$' | tr -d , | sort -g | tail -n 1
}

make_link
mkdir -p "$out"
out=$(cd "$out" && pwd)
table="$out/table.md"
{
  echo "| packets dropped [%] | records lost | repaired | recovery p50 / p99 [ms] | tracked online [%] | skipped | ATE final [m] | payload [MB] | messages / payload | on the wire / payload |"
  echo "|---|---|---|---|---|---|---|---|---|---|"
} >"$table"
status=0
for percent in ${drops//,/ }; do
  drop "$percent"
  read -r bytes_before packets_before < <(on_link)
  folder=$out/drop_$percent
  play "$folder" || { echo "two_hosts.sh: the run with $percent % failed; see $folder" >&2; status=1; continue; }
  read -r bytes packets < <(on_link)
  bytes=$((bytes - bytes_before)) packets=$((packets - packets_before))
  payload=$(value "$folder" payload_bytes)
  # 42: Ethernet, IP and UDP of each packet
  awk -v drop="$percent" -v lost="$(value "$folder" records_lost)" -v repaired="$(value "$folder" records_repaired)" \
    -v p50="$(largest "$folder" recovery_p50_ms)" -v p99="$(largest "$folder" recovery_p99_ms)" \
    -v online="$(value "$folder" tracked_online_percent)" -v skipped="$(value "$folder" frames_skipped)" \
    -v ate="$(value "$folder" ate_rmse_final)" -v payload="$payload" -v bytes="$bytes" -v packets="$packets" 'BEGIN {
      printf "| %s | %s | %s | %.0f / %.0f | %.1f | %s | %s | %.2f | %.3f | %.3f |\n", drop, lost, repaired, p50, p99, online,
        skipped, (ate == "null" ? "-" : sprintf("%.4f", ate)), payload / 1e6, (bytes - 42 * packets) / payload, bytes / payload }' >>"$table"
  [[ $(value "$folder" records_lost) == 0 ]] || status=1
  sleep 1
done
cat "$table"
exit "$status"
