#!/usr/bin/env bash
# scripts/sweep.sh with programs that only pretend to render and to run: arguments, continuing, stopping, the tables.
# shellcheck source-path=SCRIPTDIR source=expect.sh
source "$(dirname "$0")/expect.sh"
sweep=$DMSLAM_SOURCE_DIR/scripts/sweep.sh
DMSLAM_BIN=$work/bin
export DMSLAM_BIN CALLS=$work/calls
mkdir "$DMSLAM_BIN"
ln -s "$1" "$DMSLAM_BIN/dmslam-report"

cat >"$DMSLAM_BIN/dmslam-synth" <<'EOS'
#!/usr/bin/env bash
echo "synth $*" >>"$CALLS"
out=${*: -1} share=0
[[ $* != *--moving-share* ]] || share=$(sed -E 's/.*--moving-share ([0-9.]*).*/\1/' <<<"$*")
mkdir -p "$out"
echo "{\"mean_coverage\": $share, \"mean_moving_coverage\": $share}" >"$out/synthetic.json"
touch "$out/camera.yaml"
awk 'BEGIN { for (i = 0; i < 60; ++i) { t = i / 30;
  printf "%.6f %.9f %.9f %.9f 0 0 0 1\n", 100 + t, sin(t), cos(t), 0.3 * t > "'"$out"'/groundtruth.txt";
  printf "%.6f rgb/%d.png\n", 100 + t, i > "'"$out"'/rgb.txt" } }'
EOS
cat >"$DMSLAM_BIN/dmslam-inprocess" <<'EOS'
#!/usr/bin/env bash
echo "run $*" >>"$CALLS"
while (($#)); do
  [[ $1 == --sequence || $1 == --out || $1 == --save-map ]] && declare "${1//[-]/_}=$2"
  shift
done
if [[ -n ${SLOW:-} ]]; then echo $$ >"$CALLS.pid"; exec sleep 60; fi
[[ -z ${__save_map:-} ]] || echo map >"$__save_map"
cp "$__sequence/groundtruth.txt" "$__out/trajectory.txt"
echo '{"tracked_percent": 91.5}' >"$__out/summary.json"
EOS
cat >"$DMSLAM_BIN/dmslam-map" <<'EOS'
#!/usr/bin/env bash
echo '{"on_people_percent": 0.75}' >"${*: -1}"
EOS
chmod +x "$DMSLAM_BIN"/*

expect 0 'Usage' "$sweep" --help
expect 1 'unknown argument --frob' "$sweep" --frob
expect 1 '--seeds needs a value' "$sweep" --seeds
expect 1 '--seeds none' "$sweep" --seeds none --out "$work/o"
expect 1 '--only all: choose' "$sweep" --only all --out "$work/o"

# 17 sequences (nobody is in one of them), 2 profiles, 2 seeds; and nothing is run twice.
expect 0 'dynamic-scenes.md' "$sweep" --out "$work/a" --seeds 2 --only sweep --data "$work/none"
check "17 sequences" test "$(grep -c ^synth "$CALLS")" -eq 17
check "68 runs" test "$(grep -c ^run "$CALLS")" -eq 68
check "half of them baseline" test "$(grep -c 'profile baseline' "$CALLS")" -eq 34
check "the table has 70 %" grep -qE '^\| 70 \| 70\.0 / 70\.0 \| 2/2 \|' "$work/a/dynamic-scenes.md"
check "a picture" test -s "$work/a/dynamic-scenes.png"
check "quiet in a pipe" test -z "$(grep -F '[1/' <<<"$output")"
: >"$CALLS"
expect 0 'dynamic-scenes.md' "$sweep" --out "$work/a" --seeds 2 --only sweep --data "$work/none"
check "nothing is run twice" test ! -s "$CALLS"

# The ablation needs the kitchen: absent it says so; else 7 variants.
expect 0 'kitchen_walk1 is not there: no ablation' "$sweep" --out "$work/b" --seeds 1 --only ablation --data "$work/none"
mkdir "$work/data"
"$DMSLAM_BIN/dmslam-synth" --out "$work/data/kitchen_walk1"
: >"$CALLS"
expect 0 'dynamic-scenes.md' "$sweep" --out "$work/b" --seeds 1 --only ablation --data "$work/data"
check "7 runs" test "$(grep -c ^run "$CALLS")" -eq 7
check "each switch" test "$(grep -cE 'mutual_exclusion=off|motion_belief=off|seen_through=off|method=(ar|ran)sac' "$CALLS")" -eq 5
check "landmarks on people" grep -qE '91\.5 \| 0\.75 \|$' "$work/b/dynamic-scenes.md"
check "the map itself is not kept" test ! -e "$work/b/runs/kitchen_walk1/dm/dm/seed_1/map.log"

# Published between the marks of a page; a page without them is refused.
printf '# People\n<!-- written by scripts/sweep.sh -->\n<!-- end of what scripts/sweep.sh writes -->\nthe end\n' >"$work/page.md"
expect 0 'dynamic-scenes.md' "$sweep" --out "$work/b" --seeds 1 --report-only --data "$work/data" --publish "$work/page.md"
check "the page has the table" grep -q 'Ablation: kitchen_walk1' "$work/page.md"
check "and its own text" grep -q 'the end' "$work/page.md"
check "and the picture" test -s "$work/images/page.png"
echo '# People' >"$work/page.md"
expect 1 'needs the lines' "$sweep" --out "$work/b" --seeds 1 --report-only --data "$work/data" --publish "$work/page.md"

# Stopped in the middle: exit 130, the run is gone, and the same command goes on.
SLOW=1 "$sweep" --out "$work/c" --seeds 1 --only sweep --data "$work/none" >"$work/c.txt" 2>&1 &
pid=$!
for _ in $(seq 200); do [[ -s $CALLS.pid ]] && break; read -rt 0.1 <> <(:) || true; done
kill -TERM "$pid"
wait "$pid"
check "a stopped sweep exits with 130" test $? -eq 130
check "it says how to go on" grep -q 'the same command continues' "$work/c.txt"
check "its run is gone" test ! -d "/proc/$(cat "$CALLS.pid")"

finish
