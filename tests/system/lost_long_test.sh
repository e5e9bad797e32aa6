# Six seconds of darkness, longer than a map used to be waited for: the camera is lost meanwhile and in no other map, and
# when the light comes back it is in the same map at once.
source "$(dirname "$0")/lib.sh"
need_synthetic

sequence=$work/dark out=$work/out
check "the sequence is made" python3 "$root/scripts/rearrange.py" "$synthetic" "$sequence" 0-89 'dark*6' 60-149
check "the run ends with 0" "$build/bin/dmslam-inprocess" --sequence "$sequence" \
  --camera "$root/config/synthetic.yaml" --seed 1 --out "$out"
expect "darkness is no reason to begin another map" "$out" resets "== 0"
expect "the camera is found again" "$out" relocalisations ">= 1"
# 180 of 360 frames are lit.
expect "nine tenths of the lit frames have a pose in the end" "$out" tracked_percent ">= 45"
expect "the trajectory is right" "$out" ate_rmse_final "<= 0.05"
dark_from=$(awk 'NR == 90 + 1 { print $1 }' "$sequence/lit.txt")
light=$(awk 'NR == 90 + 2 { print $1 }' "$sequence/lit.txt")
poses() { # STAMP STAMP: of the online trajectory, between the two
  awk -v from="$1" -v to="$2" '!/^#/ && $1 > from && $1 < to' "$out/trajectory_online.txt" | wc -l
}
check "no dark frame has a pose" test "$(poses "$dark_from" "$light")" = 0
in_a_second=$(awk -v t="$light" 'BEGIN { printf "%.6f", t + 1 }')
check "within a second of light there are poses" test "$(poses "$light" "$in_a_second")" -gt 0
finish
