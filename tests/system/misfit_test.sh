# Who comes with other settings than the frontend, or with another vocabulary, is refused by name and ends with 2; the
# others go on.
source "$(dirname "$0")/lib.sh"
need_synthetic
multicast

url="udpm://239.255.76.67:23461?ttl=0&recv_buf_size=4194304"
common=(--lcm-url "$url" --session 5 --fresh-system --quiet)
mkdir "$work/few" "$work/vocabulary"
find "$synthetic/rgb" -type f | sort | head -n 3 | xargs -I{} cp {} "$work/few"
check "a small vocabulary is trained" "$build/bin/dmslam-vocab" train --images "$work/few" --k 4 --levels 2 \
  --out "$work/vocabulary/small.dmv" >/dev/null 2>&1

declare -A pids=()
begin() { # NAME ARGUMENTS...
  local name=$1
  shift
  "$build/bin/dmslam-$name" "${common[@]}" "$@" </dev/null >"$work/$name.log" 2>&1 &
  pids[$name]=$!
}
# All of them, with something else for one: that one is refused, and no other.
misfit() { # NAME PATTERN ARGUMENTS...
  local odd=$1 pattern=$2 name status=0
  shift 2
  declare -A more=([player]="--lockstep --camera $root/config/synthetic.yaml --sequence $synthetic"
    [collector]="--out $work/$odd")
  pids=()
  for name in mapper loopcloser frontend collector player; do
    local own=()
    [[ $name != "$odd" ]] || own=("$@")
    # shellcheck disable=SC2086  # several words
    begin "$name" --peers frontend,mapper,loopcloser,collector ${more[$name]:-} "${own[@]}"
  done
  timeout 60 tail --pid="${pids[$odd]}" -f /dev/null
  if kill -0 "${pids[$odd]}" 2>/dev/null; then
    failed "the $odd with $* goes on"
  else
    wait "${pids[$odd]}" || status=$?
    ((status == 2)) || failed "the $odd with $* ended with $status"
  fi
  check "the $odd names what differs: $(<"$work/$odd.log")" grep -qE "$pattern" "$work/$odd.log"
  for name in "${!pids[@]}"; do
    [[ $name == "$odd" ]] || kill -0 "${pids[$name]}" 2>/dev/null || failed "the $name ended too: $(<"$work/$name.log")"
    kill -KILL "${pids[$name]}" 2>/dev/null
    wait "${pids[$name]}" 2>/dev/null
  done
  no_orphans "the run with another $odd"
}
settings="the frontend of session 5 \(version [0-9.]+, this is [0-9.]+\) has other settings \(profile dm, seed 1, hash [0-9a-f]{16}\) than this process"
for name in mapper loopcloser collector; do
  misfit "$name" "$settings .*give every process the same --config and --set" --set tracking.min_inliers=25
done
misfit loopcloser "another vocabulary \(checksum [0-9a-f]{16}\) than this process .*the same --vocabulary" \
  --vocabulary "$work/vocabulary/small.dmv"
finish
