#!/usr/bin/env bash
# What somebody who knows the protocol and has no key can do to a run, with a key and without one. See --help.
set -euo pipefail
top=$(cd "$(dirname "${BASH_SOURCE[0]}")/.." && pwd)
readonly LONGEST_S=100 FRAMES=40
readonly KINDS=frame,small-frame,far-frame,end,camera,take-over,head,record,reset,ack,done,far-done,sequence-done,session,replay
readonly RESULTS=(trajectory.txt trajectory_online.txt keyframes.txt map.ply)
usage() {
  cat <<EOF
Usage: scripts/forgeries.sh --out DIR [options]

Plays $FRAMES rendered frames in lock-step beside a forger that forges one kind of message fifty times a second, once without
a key and once with one, for each kind; and writes DIR/table.md: how the run ended, what it tracked, how many messages it
refused, and whether its results have the bytes of a run beside nobody. Ends with 1 where one with a key has not.

  --kinds LIST       with commas (default: $KINDS)
  --build-dir DIR    where the programs are, those of the tests among them (default: build/release)
EOF
}
fail() { echo "forgeries.sh: $*" >&2; exit 1; }

out="" build=$top/build/release kinds=$KINDS
while (($#)); do
  case $1 in
    -h | --help) usage; exit 0 ;;
    --out | --kinds) ;;
    --build-dir) (($# > 1)) && build=$2 ;;
    *) fail "unknown option $1 (see --help)" ;;
  esac
  (($# > 1)) || fail "$1 needs a value (see --help)"
  [[ $1 == --build-dir ]] || printf -v "${1#--}" %s "$2"
  shift 2
done
[[ -n $out ]] || fail "--out is needed (see --help)"
for program in dmslam-run dmslam-synth forger; do
  [[ -x $build/bin/$program ]] || fail "$build/bin/$program is not there; run scripts/build.sh --tests"
done
mkdir -p -- "$out"
out=$(cd "$out" && pwd)
unset DMSLAM_KEY_FILE
rm -rf -- "${out:?}/key" "$out/sequence" "$out"/none_* "$out"/keyed_* "$out"/quiet*
(umask 077 && head -c 32 /dev/urandom | base64 >"$out/key")
"$build/bin/dmslam-synth" --quiet --out "$out/sequence" --path xyz --frames "$FRAMES" --moving-share 0.15 --seed 1

forger=""
trap '[[ -z $forger ]] || kill -TERM "$forger" 2>/dev/null' EXIT
play() { # NAME ARGUMENTS...: sets `status`
  local name=$1
  shift
  status=0
  timeout --kill-after 20 "$LONGEST_S" "$build/bin/dmslam-run" --sequence "$out/sequence" --camera "$top/config/synthetic.yaml" \
    --seed 3 --lockstep --out "$out/$name" "$@" >"$out/$name.said" 2>&1 || status=$?
}
value() { sed -nE "s/^ *\"$2\": *([^,]*),?$/\1/p" "$out/$1/summary.json" 2>/dev/null | head -n 1; }
same() { # NAME: the bytes of the run beside nobody
  local file
  for file in "${RESULTS[@]}"; do cmp -s "$out/quiet/$file" "$out/$1/$file" || return 1; done
}
describe() { # NAME
  if ((status == 124 || status == 137)); then
    echo "not over after $LONGEST_S s"
  elif ((status != 0)); then
    echo "ends with $status"
  elif same "$1"; then
    echo "same bytes"
  else
    echo "other results, $(value "$1" tracked_percent) % tracked, $(value "$1" restarts) restarts"
  fi
}
beside() { # NAME KIND ARGUMENTS...: a run beside a forger
  local name=$1 kind=$2 port=$((20000 + RANDOM % 30000))
  shift 2
  "$build/bin/forger" --lcm-url "udpm://239.255.76.67:$port?ttl=0" --kind "$kind" >"$out/$name.forged" 2>&1 &
  forger=$!
  play "$name" --port "$port" --share-port "$@"
  kill -TERM "$forger" 2>/dev/null || true
  wait "$forger" || true
  forger=""
  grep -q '^[1-9][0-9]* forged messages' "$out/$name.forged" || fail "nothing was forged: $(<"$out/$name.forged")"
}

play quiet
((status == 0)) || fail "the run beside nobody ended with $status: $(tail -n 1 "$out/quiet.said")"
harmed=()
{
  echo "| forged | without a key | with a key | refused |"
  echo "|---|---|---|---|"
} >"$out/table.md"
IFS=, read -ra kinds <<<"$kinds"
for kind in "${kinds[@]}"; do
  [[ ! -t 2 ]] || printf '\r\033[K%s' "$kind" >&2
  beside "none_$kind" "$kind"
  without=$(describe "none_$kind")
  beside "keyed_$kind" "$kind" --key "$out/key"
  with=$(describe "keyed_$kind")
  [[ $with == "same bytes" ]] || harmed+=("$kind")
  echo "| \`$kind\` | $without | $with | $(value "keyed_$kind" messages_dropped) |" >>"$out/table.md"
done
[[ ! -t 2 ]] || printf '\r\033[K' >&2
cat "$out/table.md"
((${#harmed[@]} == 0)) || fail "in spite of the key these did harm: ${harmed[*]}"
