# The power fails while a run goes on: all processes end by SIGKILL, and of the disk only that is left which the file system had
# written until then. dmslam-run --resume goes on from a copy of the disk.
source "$(dirname "$0")/lib.sh"
need_synthetic
for tool in mkfs.ext4 losetup; do
  command -v "$tool" >/dev/null || { echo "SKIPPED: $tool is not there (packages e2fsprogs, mount)"; exit $SKIPPED; }
done
if [[ -z ${DMSLAM_OWN_MOUNTS:-} ]]; then
  export DMSLAM_OWN_MOUNTS=1
  unshare --mount true 2>/dev/null || { echo "SKIPPED: this machine lets nobody mount"; exit $SKIPPED; }
  exec unshare --mount bash "$0" "$@"
fi
multicast
mkdir "$work/disk"
trap 'umount -l "$work/disk" 2>/dev/null; cleanup' EXIT
truncate -s 128M "$work/disk.img"
mkfs.ext4 -q "$work/disk.img"
# What nobody syncs stays in memory: no commit by time, and a file that is renamed without being synced is empty after the cut.
insert() { mount -o loop,commit=300,noauto_da_alloc "$1" "$work/disk" 2>/dev/null; }
insert "$work/disk.img" || { echo "SKIPPED: no image can be mounted"; exit $SKIPPED; }
out=$work/disk/out
arguments=(--sequence "$synthetic" --camera "$root/config/synthetic.yaml" --lockstep --seed 1 --set collector.checkpoint_s=2)

frame_of() { sed -nE 's/.*frame ([0-9]+) of .*, [0-9]+ keyframes/\1/p' "$1/log/collector.log" 2>/dev/null | tail -n 1; }
cut_at() { # FRAME: plays until then, then the power fails; sets `at` to the newest frame that was told
  until (($(frame_of "$out" || true) + 0 >= $1)) || ! kill -0 "$runner" 2>/dev/null; do sleep 0.05; done
  local pid pids=()
  while IFS=: read -r pid _; do pids+=("$pid"); done < <(mine)
  kill -KILL "${pids[@]}" 2>/dev/null
  cp --sparse=always "$work/disk.img" "$work/cut.img"
  wait "$runner" 2>/dev/null
  no_orphans "the power failed"
  at=$(frame_of "$out")
  [[ ! -e $out/summary.json ]] || failed "the run had ended before the power failed"
  umount "$work/disk"
  mv "$work/cut.img" "$work/disk.img"
  insert "$work/disk.img" || failed "what is left of the disk cannot be mounted"
}
"$build/bin/dmslam-run" "${arguments[@]}" --out "$out" >"$work/said" 2>&1 </dev/null &
runner=$!
cut_at 60
[[ -s $out/checkpoint.lcmlog ]] || failed "there is no checkpoint on the disk: $(ls -l "$out")"
"$build/bin/dmslam-run" --resume "$out" >"$work/resumed.said" 2>&1 </dev/null &
runner=$!
cut_at 110
check "it is resumed after a second cut" "$build/bin/dmslam-run" --resume "$out" >"$work/twice.said" 2>&1
cat "$work/resumed.said" "$work/twice.said"
no_orphans "the resumed run"
expect "all frames are there" "$out" frames "== 150"
expect "it was resumed twice" "$out" resumed "== 2"
expect "no keyframe is missing" "$out" keyframes_missing "== 0"
expect "no record is lost" "$out" records_lost "== 0"
expect "one map" "$out" map "> 0"
check "each frame once" test -z "$(cut -d' ' -f1 "$out/trajectory_online.txt" | grep -v '#' | sort | uniq -d)"

# A recording is played again where poses were lost: there are those that an undisturbed run tells while frames come.
check "the undisturbed run" "$build/bin/dmslam-run" "${arguments[@]}" --out "$work/undisturbed" >"$work/said" 2>&1
stamps() { cut -d" " -f1 "$1" | grep -v "#" | sort; }
lost=$(comm -23 <(stamps "$work/undisturbed/trajectory_online.txt") <(stamps "$out/trajectory.txt") | wc -l)
((lost <= 3)) || failed "$lost poses are missing"
echo "$lost poses are missing; final error $(field "$out" ate_rmse_final), undisturbed $(field "$work/undisturbed" ate_rmse_final)"
finish
