# Two systems at once on one network: by port, and on one port by prefix. Each ends as if it were alone.
source "$(dirname "$0")/lib.sh"
need_synthetic
multicast
sequence=(--sequence "$synthetic" --camera "$root/config/synthetic.yaml" --seed 3 --frames 80 --lockstep)

check "alone" run "${sequence[@]}" --out "$work/alone" --port 23411
run "${sequence[@]}" --out "$work/port" --port 23412 >/dev/null 2>&1 &
run "${sequence[@]}" --out "$work/prefix_a" --port 23413 --prefix A_ >/dev/null 2>&1 &
check "one of two on a port" run "${sequence[@]}" --out "$work/prefix_b" --port 23413 --share-port --prefix B_
wait
for other in port prefix_a prefix_b; do
  for file in trajectory.txt map.ply; do
    check "$file of '$other' has the bytes of one that was alone" cmp "$work/alone/$file" "$work/$other/$file"
  done
  expect "nothing foreign reaches '$other'" "$work/$other" messages_dropped "== 0"
done
finish
