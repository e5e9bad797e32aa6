# The four processes at the recorded rate: whatever this machine can do, nothing is lost and every frame is accounted for.
source "$(dirname "$0")/lib.sh"
need_synthetic
multicast

check "the run ends with 0" run --sequence "$synthetic" --camera "$root/config/synthetic.yaml" --speed 0.5 \
  --receive-buffer 212992 --record --out "$work/out"
no_orphans "the run"
expect "no record is lost" "$work/out" records_lost "== 0"
processed=$(field "$work/out" frames_processed) skipped=$(field "$work/out" frames_skipped) frames=$(field "$work/out" frames)
check "processed $processed + skipped $skipped = published $frames" test $((processed + skipped)) = "$frames"
check "the recording is there" test -s "$work/out/run.lcmlog"
finish
