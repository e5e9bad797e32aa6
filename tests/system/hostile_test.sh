# Noise and damaged messages on every channel during a run: the same bytes in the end, and all of it counted.
source "$(dirname "$0")/lib.sh"
need_synthetic
multicast
sequence=(--sequence "$synthetic" --camera "$root/config/synthetic.yaml" --seed 3 --frames 100 --lockstep)

check "the run ends with 0" run "${sequence[@]}" --out "$work/quiet" --port 23401
"$build/bin/dmslam-noise" --lcm-url "udpm://239.255.76.67:23402?ttl=0" --rate 2000 --count 1000000 >"$work/noise" 2>&1 &
noise=$!
check "the run in noise ends with 0" run "${sequence[@]}" --out "$work/noisy" --port 23402 --share-port
kill -TERM "$noise" 2>/dev/null
wait "$noise"
for file in trajectory.txt trajectory_online.txt keyframes.txt map.ply; do
  check "$file has the same bytes in noise" cmp "$work/quiet/$file" "$work/noisy/$file"
done
expect "without noise nothing is dropped" "$work/quiet" messages_dropped "== 0"
expect "the noise is counted" "$work/noisy" messages_dropped ">= 1000"
expect "nothing is lost" "$work/noisy" records_lost "== 0"
expect "nobody died of it" "$work/noisy" restarts "== 0"
finish
