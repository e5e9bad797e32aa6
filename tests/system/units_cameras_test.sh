# Two cameras by the systemd units, as docs/operations.md says: five processes with the settings of the system, player and
# frontend of camera 1 with a copy of them.
source "$(dirname "$0")/lib.sh"
source "$(dirname "$0")/units.sh"
need_synthetic
multicast

set_system "DMSLAM_LCM_URL=udpm://239.255.76.67:7741?ttl=0&recv_buf_size=4194304" "DMSLAM_OUT=$work/out" \
  "DMSLAM_SEQUENCE=$synthetic" "DMSLAM_PLAYER_OPTIONS=--camera $root/config/synthetic.yaml --lockstep --frames 60" \
  "DMSLAM_OPTIONS=--cameras 2"
for process in "${units[@]}"; do
  supervise "$process" &
  [[ $process != collector ]] || collector=$!
done
for process in frontend player; do
  DMSLAM_OPTIONS="--cameras 2 --camera-id 1" supervise "$process" "${process}1" &
done
wait "$collector" || failed "the collector ended with $?; its log: $(tail -n 3 "$work/collector.log")"
for file in trajectory.txt trajectory_1.txt; do check "$file is there" test -s "$work/out/$file"; done
expect "nothing is lost" "$work/out" records_lost "== 0"
expect "no keyframe is missing" "$work/out" keyframes_missing "== 0"
no_orphans "the run"
finish
