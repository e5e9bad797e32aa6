# The disk under the results fills up while a run goes on: the run goes on, says why once, and leaves no half file.
source "$(dirname "$0")/lib.sh"
need_synthetic
if [[ -z ${DMSLAM_OWN_MOUNTS:-} ]]; then
  export DMSLAM_OWN_MOUNTS=1
  unshare --mount true 2>/dev/null || { echo "SKIPPED: this machine lets nobody mount"; exit $SKIPPED; }
  exec unshare --mount bash "$0" "$@"
fi
multicast
mkdir "$work/disk"
trap 'umount -l "$work/disk" 2>/dev/null; cleanup' EXIT
mount -t tmpfs -o size=6m none "$work/disk" 2>/dev/null || { echo "SKIPPED: no tmpfs can be mounted"; exit $SKIPPED; }
arguments=(--sequence "$synthetic" --camera "$root/config/synthetic.yaml" --lockstep --seed 1 --out "$work/disk/out")

fill() { head -c 8000000 /dev/zero >>"$work/disk/filler" 2>/dev/null; }
begin() { # a run, until its collector has seen some frames and the disk is full
  rm -rf "$work/disk/out" "$work/disk/filler"
  "$root/scripts/run.sh" --build-dir "$build" "${arguments[@]}" >"$work/said" 2>&1 </dev/null &
  runner=$!
  until grep -qs "frame [0-9]* of" "$work/disk/out/log/collector.log" || ! kill -0 "$runner" 2>/dev/null; do sleep 0.05; done
  fill
  # The frontend forgets its frames, and gives back what room they took.
  until grep -qs "No space left.*frames die with this process" "$work/disk/out/log/frontend.log" || ! kill -0 "$runner" 2>/dev/null; do
    sleep 0.05
  done
  fill
}
journal() { stat -c %s "$work/disk/out/collector.journal" 2>/dev/null || echo 0; }

begin
size=$(journal)
sleep 4
(($(journal) - size < 5000)) || failed "the disk was not full"
rm "$work/disk/filler"
check "the run ends well once there is room: $(<"$work/said")" wait "$runner"
no_orphans "the run"
expect "all frames are there" "$work/disk/out" frames "== 150"
expect "nothing is lost" "$work/disk/out" records_lost "== 0"
check "the summary says why" grep -q "collector.journal: cannot be written (No space left on device)" "$work/disk/out/summary.json"
check "nobody was started again" test "$(field "$work/disk/out" restarts)" = 0
check "every pose was kept" test "$(grep -vc '^#' "$work/disk/out/trajectory_online.txt")" -gt 30

begin
status=0
wait "$runner" || status=$?
((status == 1)) || failed "a run whose results cannot be written ended with $status"
check "it says why: $(<"$work/said")" grep -q "cannot be written (No space left on device)" "$work/said"
for name in trajectory trajectory_online keyframes; do
  [[ ! -e $work/disk/out/$name.txt ]] || tail -c 1 "$work/disk/out/$name.txt" | grep -q '^$' || failed "half of $name.txt is left"
  [[ ! -e $work/disk/out/$name.txt || -s $work/disk/out/$name.txt ]] || failed "an empty $name.txt is left"
done
check "no other file is left" test -z "$(find "$work/disk/out" -name '*.part*')"
no_orphans "the run with a full disk"
finish
