# The camera goes dark for a while, and frames are left out, while the loop closer stands still: the frontend finds itself
# in its own replica of the map, and the summary tells of the trouble.
source "$(dirname "$0")/lib.sh"
need_synthetic
multicast

readonly DARK_FROM=85 DARK_S=0.6 DARK_FRAMES=18 JUMP_FROM=120 JUMP_TO=126
out=$work/out
run --sequence "$synthetic" --camera "$root/config/synthetic.yaml" --speed 0.5 --out "$out" \
  --black-out "$DARK_FROM,$DARK_S" --jump "$JUMP_FROM,$JUMP_TO" &
playing=$!
for ((i = 0; i < 200; ++i)); do
  [[ ! -s $out/log/loopcloser.pid ]] || break
  sleep 0.05
done
sleep 1
check "the loop closer is stopped" kill -STOP "$(<"$out/log/loopcloser.pid")"
sleep 15 # the sequence takes ten
check "the loop closer goes on" kill -CONT "$(<"$out/log/loopcloser.pid")"
wait "$playing"
check "the run ends with 0" test $? = 0
expect "the dark frames are counted" "$out" frames_blacked_out "== $DARK_FRAMES"
expect "the frames left out are counted" "$out" frames_jumped "== $((JUMP_TO - JUMP_FROM - 1))"
expect "the camera is found again" "$out" relocalisations ">= 1"
expect "most of what was not dark is tracked" "$out" tracked_percent ">= 65"
expect "the trajectory is right" "$out" ate_rmse_final "<= 0.05"
check "the last frames have poses" test -n "$(grep -v '^#' "$out/trajectory_online.txt" | tail -n 1 | awk '$1 > 1700000004.8')"
finish
