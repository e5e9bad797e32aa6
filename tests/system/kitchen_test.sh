# 200 frames of a real kitchen through the four processes.
source "$(dirname "$0")/lib.sh"
need_data kitchen
multicast

check "the run ends with 0" run --sequence "$data/kitchen" --camera "$root/config/kitchen.yaml" --lockstep --seed 1 \
  --frames 200 --out "$work/out"
no_orphans "the run"
expect "published" "$work/out" frames "== 200"
expect "tracked" "$work/out" tracked_percent ">= 70"
expect "right" "$work/out" ate_rmse_final "<= 0.02"
expect "nothing is lost" "$work/out" records_lost "== 0"
finish
