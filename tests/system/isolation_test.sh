# Two systems at once on one network: by port, and on one port by prefix. Each ends as if it were alone.
source "$(dirname "$0")/lib.sh"
need_synthetic
multicast
sequence=(--sequence "$synthetic" --camera "$root/config/synthetic.yaml" --seed 3 --frames 80 --lockstep)

check "alone" run "${sequence[@]}" --out "$work/alone" --port 23411
# Which of the two on one port comes first is chance, so both say that they share it.
run "${sequence[@]}" --out "$work/port" --port 23412 >"$work/port.log" 2>&1 &
port=$!
run "${sequence[@]}" --out "$work/prefix_a" --port 23413 --share-port --prefix A_ >"$work/prefix_a.log" 2>&1 &
prefix_a=$!
check "one of two on a port" run "${sequence[@]}" --out "$work/prefix_b" --port 23413 --share-port --prefix B_
wait "$port" || { cat "$work/port.log"; failed "a system on a port of its own"; }
wait "$prefix_a" || { cat "$work/prefix_a.log"; failed "the other of two on a port"; }
for other in port prefix_a prefix_b; do
  for file in trajectory.txt map.ply; do
    check "$file of '$other' has the bytes of one that was alone" cmp "$work/alone/$file" "$work/$other/$file"
  done
  expect "nothing foreign reaches '$other'" "$work/$other" messages_dropped "== 0"
done
finish
