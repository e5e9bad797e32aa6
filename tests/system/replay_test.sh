# Recorded with the real lcm-logger, replayed with the real lcm-logplayer into new processes, at half the recorded rate.
source "$(dirname "$0")/lib.sh"
need_data kitchen
multicast

check "the run ends with 0" run --sequence "$data/kitchen" --camera "$root/config/kitchen.yaml" --frames 200 --speed 0.5 \
  --record --out "$work/first"
check "the replay ends with 0" run --replay "$work/first/run.lcmlog" --out "$work/again"
no_orphans "the replay"
expect "the frames are those of the log" "$work/again" frames "== 200"
expect "it is tracked" "$work/again" tracked_online_after_first_map_percent ">= 80"
finish
