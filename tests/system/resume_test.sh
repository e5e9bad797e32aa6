# All processes of a run die at once, dmslam-run too (power, the OOM killer): --resume goes on. No pose that was written is
# lost, and of the map at most what came in the last ten seconds.
source "$(dirname "$0")/lib.sh"
multicast
if [[ -d $data/kitchen_walk1 ]]; then
  arguments=(--sequence "$data/kitchen_walk1" --camera "$root/config/kitchen.yaml" --frames 300)
  frames=300 middle=200 tracked=85
else
  need_synthetic
  arguments=(--sequence "$synthetic" --camera "$root/config/synthetic.yaml")
  frames=150 middle=100 tracked=40
fi
arguments+=(--lockstep --seed 1 --set collector.checkpoint_s=2)

strike() { # all at once
  local pid pids=()
  while IFS=: read -r pid _; do pids+=("$pid"); done < <(mine)
  kill -KILL "${pids[@]}" 2>/dev/null
  for _ in {1..100}; do [[ -z $(mine) ]] || { sleep 0.05; continue; }; return; done
  failed "somebody outlived SIGKILL"
}
frame_of() { sed -nE 's/.*frame ([0-9]+) of .*, [0-9]+ keyframes/\1/p' "$1/log/collector.log" 2>/dev/null | tail -n 1; }
until_frame() { # FOLDER FRAME RUNNER
  until (($(frame_of "$1" || true) + 0 >= $2)) || ! kill -0 "$3" 2>/dev/null; do sleep 0.05; done
}
complete() { # NAME FOLDER LEAST_RESUMED
  expect "$1: all frames are there" "$2" frames "== $frames"
  expect "$1: it was resumed" "$2" resumed ">= $3"
  expect "$1: tracked as ever" "$2" tracked_percent ">= $tracked"
  expect "$1: nothing is missing" "$2" keyframes_missing "== 0"
  expect "$1: no record is lost" "$2" records_lost "== 0"
  expect "$1: one map" "$2" map "> 0"
  check "$1: each frame once" test -z "$(cut -d' ' -f1 "$2/trajectory_online.txt" | grep -v '#' | sort | uniq -d)"
  check "$1: each keyframe once" test -z "$(cut -d' ' -f1 "$2/keyframes.txt" | grep -v '#' | sort | uniq -d)"
  for name in collector.journal checkpoint.lcmlog checkpoint.lcmlog.former; do
    [[ ! -e $2/$name ]] || failed "$1: $name is left"
  done
}
# ---- Killed in the middle; a copy of the folder, taken while it ran, is what a snapshot of the disk would show
"$root/scripts/run.sh" --build-dir "$build" "${arguments[@]}" --out "$work/out" >"$work/said" 2>&1 </dev/null &
runner=$!
until_frame "$work/out" $((middle - 80)) "$runner"
cp -r "$work/out" "$work/snapshot"
said=$(run --resume "$work/out" 2>&1 </dev/null) && failed "a run that is alive was resumed"
[[ $said == *"is alive and writes there"* ]] || failed "a run that is alive: $said"
until_frame "$work/out" "$middle" "$runner"
strike
wait "$runner" 2>/dev/null
[[ -s $work/out/checkpoint.lcmlog ]] || failed "there is no checkpoint: $(ls "$work/out")"
[[ -s $work/out/collector.journal ]] || failed "there is no journal"
[[ ! -e $work/out/summary.json ]] || failed "the run had ended before it was killed"
cp -r "$work/out" "$work/damaged"
cp -r "$work/out" "$work/gone"
at=$(frame_of "$work/out")
((at < frames - 10)) || failed "the run had come to its end before it was killed"
check "the run is resumed" run --resume "$work/out" >"$work/resumed.said" 2>&1
cat "$work/resumed.said"
no_orphans "the resumed run"
complete "after SIGKILL" "$work/out" 1
behind=$(sed -nE 's/.*goes on behind frame ([0-9]+).* in a map of [0-9]+ keyframes.*/\1/p' "$work/resumed.said")
newest=$(sed -nE 's/.* keyframes, the newest of frame ([0-9]+)$/\1/p' "$work/resumed.said")
((behind >= at - 1)) || failed "frames up to $at were told, but it went on behind ${behind:-none}"
((newest >= behind - 75)) || failed "the map ends at frame ${newest:-none}, more than 2 s and a keyframe before $behind"

# ---- No pose that was written is lost: what an undisturbed run, which is the same up to there, placed of these frames
check "the undisturbed run" run "${arguments[@]}" --out "$work/undisturbed" >"$work/said" 2>&1
stamps() { cut -d' ' -f1 "$1" | grep -v '#' | sort; }
last=$(grep -v '^#' "${arguments[1]}/rgb.txt" | sed -n "$((behind + 1))p" | cut -d' ' -f1)
for name in trajectory trajectory_online; do
  lost=$(comm -23 <(stamps "$work/undisturbed/trajectory_online.txt" | awk -v last="$last" '$1 <= last + 1e-4') <(stamps "$work/out/$name.txt"))
  [[ -z $lost ]] || failed "$name.txt lacks $(wc -l <<<"$lost") poses that were written, as of $(head -n 1 <<<"$lost")"
done
# Frames of before the kill keep the poses with which they were told: their features went with the frontend.
holds "$(field "$work/out" ate_rmse_final) <= 1.1 * $(field "$work/undisturbed" ate_rmse_online)" ||
  failed "the final error is $(field "$work/out" ate_rmse_final), undisturbed $(field "$work/undisturbed" ate_rmse_online) online"

# ---- The copy: the run as it was earlier
check "a copy that was taken while it ran is resumed" run --resume "$work/snapshot" >"$work/snapshot.said" 2>&1
complete "the copy" "$work/snapshot" 1

# ---- Killed twice, the second time while the resumed run goes on; the newest checkpoint is damaged
printf 'damaged' | dd of="$work/damaged/checkpoint.lcmlog" bs=1 seek=20000 conv=notrunc status=none
"$root/scripts/run.sh" --build-dir "$build" --resume "$work/damaged" >"$work/said" 2>&1 </dev/null &
runner=$!
until_frame "$work/damaged" $((middle + 40)) "$runner"
strike
wait "$runner" 2>/dev/null
if [[ -e $work/gone/checkpoint.lcmlog.former ]]; then
  grep -q "goes on from .*checkpoint.lcmlog.former" "$work/said" || failed "the one before does not serve: $(<"$work/said")"
  check "it is resumed twice" run --resume "$work/damaged" >"$work/twice.said" 2>&1
  complete "twice" "$work/damaged" 2
fi

# ---- Another run in the same folder leaves what the one that died needs: both end, in folders of their own
cp -r "$work/gone" "$work/twice"
former=$(sed -nE 's/ *"session": ([0-9]+),/\1/p' "$work/twice/run.json")
check "another run in the same folder" run "${arguments[@]}" --out "$work/twice" >"$work/said" 2>&1 </dev/null
grep -q -- "--resume $work/twice/former-$former\$" "$work/said" || failed "it does not say what is kept: $(<"$work/said")"
expect "the other run has its own results" "$work/twice" frames "== $frames"
expect "the other run is none that was resumed" "$work/twice" resumed "== 0"
check "what it kept is resumed" run --resume "$work/twice/former-$former" >"$work/said" 2>&1
complete "the former run" "$work/twice/former-$former" 1

# ---- What cannot be resumed is refused by name
refused "this run has ended" run --resume "$work/out"
refused "no such folder" run --resume "$work/nowhere"
refused "run.json: is not there" run --resume "$work"
refused "give no other option" run --resume "$work/gone" --seed 2
sed "s#\"--frames\"#\"--start\"#; s#$data#/gone#; s#$build/synthetic#/gone#" "$work/gone/run.json" >"$work/run.json"
cp "$work/run.json" "$work/gone/run.json"
refused "no such folder or file; check --sequence" run --resume "$work/gone"
rm "$work/gone"/checkpoint.lcmlog*
refused "no checkpoint of this run" run --resume "$work/gone"
finish
