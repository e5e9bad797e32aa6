# The four processes at the recorded rate: whatever this machine can do, no record is lost and every frame is accounted for.
source "$(dirname "$0")/lib.sh"
need_synthetic
multicast

overflows() { awk '$1 == "Udp:" && $2 ~ /^[0-9]+$/ { print $6 }' /proc/net/snmp; } # datagrams dropped at full receive buffers here
accounted() { # FOLDER: each frame was worked on, was too late for that, or was dropped by the kernel on its way
  local processed skipped received lost frames
  processed=$(field "$1" frames_processed) skipped=$(field "$1" frames_skipped)
  received=$(field "$1" frames_received) lost=$(field "$1" frames_lost) frames=$(field "$1" frames)
  check "processed $processed + skipped $skipped = received $received" test $((processed + skipped)) = "$received"
  check "received $received + lost $lost = published $frames" test $((received + lost)) = "$frames"
  (($(overflows) > 0)) || check "$lost frames were lost, but no receive buffer was full" test "$lost" = 0
}

check "the run ends with 0" run --sequence "$synthetic" --camera "$root/config/synthetic.yaml" --speed 0.5 \
  --receive-buffer 212992 --record --out "$work/out"
no_orphans "the run"
expect "no record is lost" "$work/out" records_lost "== 0"
accounted "$work/out"
expect "frames were worked on" "$work/out" frames_processed ">= 20"
check "the recording is there" test -s "$work/out/run.lcmlog"
finish
