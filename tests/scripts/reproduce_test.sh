#!/usr/bin/env bash
# scripts/reproduce.sh with a runner that only pretends: arguments, continuing, failures, stopping, the report.
# shellcheck source-path=SCRIPTDIR source=expect.sh
source "$(dirname "$0")/expect.sh"
report=$1
DMSLAM_BIN=$(dirname "$report")
export DMSLAM_BIN
reproduce=$DMSLAM_SOURCE_DIR/scripts/reproduce.sh

# Two sequences of four seconds; the others are absent.
tum=$work/tum
for name in rgbd_dataset_freiburg3_walking_xyz rgbd_dataset_freiburg1_xyz; do
  mkdir -p "$tum/$name"
  awk 'BEGIN { for (i = 0; i < 120; ++i) { t = i / 30;
    printf "%.6f %.9f %.9f %.9f 0 0 0 1\n", 100 + t, sin(t), cos(t), 0.3 * t > "'"$tum/$name"'/groundtruth.txt";
    printf "%.6f rgb/%d.png\n", 100 + t, i > "'"$tum/$name"'/rgb.txt" } }'
done

# Takes the arguments of scripts/run.sh, writes them down, and gives the ground truth back with an error that the seed
# and the profile decide.
cat >"$work/runner" <<'EOF'
#!/usr/bin/env bash
echo "$*" >>"$CALLS"
while (($#)); do
  case $1 in
    --lockstep) shift ;;
    --sequence | --out | --profile | --seed | --camera | --set | --pictures) printf -v "${1#--}" %s "$2"; shift 2 ;;
    *) echo "unknown $1"; exit 2 ;;
  esac
done
[[ -s $camera ]] || { echo "no camera $camera"; exit 2; }
[[ ${SLOW:-} != "$seed" ]] || { echo $$ >"$CALLS.pid"; exec sleep 60; }
[[ ${FAIL:-} != "$profile" ]] || { echo "it fell over"; exit 7; }
mkdir -p "$out"
error=0.04
[[ $profile == dm ]] && error=0.01
awk -v e=$error -v s="$seed" '{ $2 += e * s * sin(9 * NR); print }' "$sequence/groundtruth.txt" >"$out/trajectory.txt"
tail -n +31 "$out/trajectory.txt" >"$out/trajectory_online.txt"
echo '{"tracked_percent": 98.5, "tracked_online_percent": 75.0, "first_init_s": 1.0}' >"$out/summary.json"
[[ ${FALL:-} != "$profile" ]] || { echo "it fell over in the end"; exit 9; }
EOF
chmod +x "$work/runner"
export CALLS=$work/calls
mkdir "$work/none"
run=("$reproduce" --tum "$tum" --no-render --data "$work/none" --runner "$work/runner")

expect 0 'Usage' "$reproduce" --help
expect 1 '--out DIR is missing' "$reproduce" --tum "$tum"
expect 1 '--tum DIR is missing' "$reproduce" --out "$work/o"
expect 1 'no such folder.*get_tum.sh' "$reproduce" --tum "$work/nowhere" --out "$work/o"
expect 1 '--seeds none' "$reproduce" --tum "$tum" --out "$work/o" --seeds none
expect 1 '--seeds needs a value' "$reproduce" --tum "$tum" --out "$work/o" --seeds
expect 1 'unknown argument --frob' "$reproduce" --frob
expect 1 "no sequence is called 'fr3'" "${run[@]}" --out "$work/o" --only fr3
check "progress.txt does not tell to go on" grep -q '^now: ended with exit status 1 before the first run' "$work/o/progress.txt"
expect 1 '--data .*/nowhere: no such folder' "${run[@]}" --data "$work/nowhere" --out "$work/p"
check "nothing was begun" test ! -e "$work/p"

# --publish writes over no page but a report, and says so before anything runs.
mkdir -p "$work/pages/images/viewer" "$work/pages/images/lone"
printf '# Viewer\n' >"$work/pages/viewer.md"
refused() { # PATTERN PAGE: by the script before anything runs, and by dmslam-report
  expect 1 "--publish .*$1" "${run[@]}" --out "$work/p" --publish "$2"
  check "nothing was begun" test ! -e "$work/p"
  expect 1 "--publish .*$1" "$report" write --out "$work/p" --publish "$2"
}
refused 'not the name of a page; write FOLDER/NAME.md' "$work/pages/x.txt"
refused 'not the name of a page' "$work/pages"
refused 'not the name of a page' "$work/pages/.md"
refused 'another page, and would be lost; name one that is not there yet' "$work/pages/viewer.md"
refused 'images/lone is there without its page' "$work/pages/lone.md"
expect 1 '--publish .*viewer.md is no folder' "${run[@]}" --out "$work/p" --publish "$work/pages/viewer.md/x.md"
check "the other page is as it was" grep -qx '# Viewer' "$work/pages/viewer.md"
check "so are its pictures" test -d "$work/pages/images/viewer"
for option in '--seeds 1' '--only fr1_xyz'; do
  # shellcheck disable=SC2086 # two words
  expect 1 'report-only tells of all runs.*leave --seeds and --only out' "$reproduce" --out "$work/p" --report-only $option
done

# A whole run: 2 sequences x 3 profiles x 2 settings x 2 seeds. In a pipe, nothing is said but what is absent.
expect 0 'report.json' "${run[@]}" --out "$work/a" --seeds 2
check "24 runs" test "$(wc -l <"$CALLS")" -eq 24
check "half of them with 3000 features" test "$(grep -c 'features.count=3000' "$CALLS")" -eq 12
check "freiburg1 with its own camera" test "$(grep 'freiburg1_xyz' "$CALLS" | grep -c 'config/TUM1.yaml')" -eq 12
check "pictures of the first seed only" test "$(grep -c -- '--pictures 31' "$CALLS")" -eq 12
check "no progress in a pipe" test -z "$(grep -F '[1/24]' <<<"$output")"
for what in '\*0\.329\*' '\*0\.143\*' 'fr3_walking_rpy \| \*absent\*' 'cvg\.cit\.tum\.de' 'kitchen_walk2' '\| 98\.5 \| 1\.00 \| 2/2' \
  'pictures/fr3_walking_xyz_defaults.png' '24 of 24 runs' 'Version of the programs: not recorded'; do
  check "the report has $what" grep -qE -- "$what" "$work/a/report.md"
done
check "a picture" test -s "$work/a/pictures/fr1_xyz_features3000.png"
for what in '^now: finished' '^runs done: 24 of 24' '^time left: 0 s' '^last run: fr1_xyz/defaults/dm/seed_2, done at '; do
  check "progress.txt has $what" grep -qE -- "$what" "$work/a/progress.txt"
done

# Again: nothing is run twice. One more seed: only that one.
: >"$CALLS"
expect 0 'report.md' "${run[@]}" --out "$work/a" --seeds 2
check "nothing is run twice" test ! -s "$CALLS"
expect 0 'report.md' "${run[@]}" --out "$work/a" --seeds 3
check "only the new seed is run" test "$(grep -c -- '--seed 3' "$CALLS")" -eq "$(wc -l <"$CALLS")"
expect 0 'report.md' "${run[@]}" --out "$work/a" --seeds 1 --only fr1_xyz
check "one sequence and seed more leave the others in the report" grep -q '36 of 36 runs' "$work/a/report.md"
check "with both sequences" grep -q '^| fr3_walking_xyz | dm | 3/3 ' "$work/a/report.md"
for again in no yes; do
  expect 0 'report.md' "$reproduce" --out "$work/a" --report-only --publish "$work/docs/results.md"
  check "there is a page ($again)" test -s "$work/docs/results.md"
done
check "the page has no picture of real images" test ! -e "$work/docs/images/results/fr1_xyz_defaults.png"
check "it has that of all runs" test -s "$work/docs/images/results/all_defaults.png"

# --report-only: of a folder with runs; sequences that moved are where --tum says, from then on.
mkdir "$work/bare"
for folder in nope bare; do
  expect 1 "--out .*/$folder: holds no runs to report; name the folder" "$reproduce" --out "$work/$folder" --report-only
  expect 1 "--out .*/$folder: holds no runs of scripts/reproduce.sh" "$report" write --out "$work/$folder"
done
check "no folder is made of a mistyped name" test ! -e "$work/nope"
cp -r "$work/a" "$work/h"
cp -r "$tum" "$work/moved"
rm "$work/h/plan.json"
expect 0 'runs/fr1_xyz is not shown: the sequence is not where it was' "$reproduce" --out "$work/h" --report-only
expect 0 'report.md' "$reproduce" --out "$work/h" --report-only --tum "$work/moved"
check "the runs are shown" grep -q '36 of 36 runs' "$work/h/report.md"
check "no run is said not to be" test -z "$(grep 'is not shown' <<<"$output")"
expect 0 'report.md' "$reproduce" --out "$work/h" --report-only
check "and are the next time" grep -q '36 of 36 runs' "$work/h/report.md"
check "from there" grep -qF "$work/moved/" "$work/h/plan.json"
check "the plan is never there in halves" test ! -e "$work/h/plan.json.part"

# Stopped in the middle: exit 130, the runner is gone, and the same command goes on where it was.
: >"$CALLS"
SLOW=2 "${run[@]}" --out "$work/b" --seeds 2 --only fr1_xyz >"$work/b.txt" 2>&1 &
pid=$!
for _ in $(seq 200); do [[ -s $CALLS.pid ]] && break; read -rt 0.1 <> <(:) || true; done
kill -TERM "$pid"
wait "$pid"
check "a stopped run exits with 130" test $? -eq 130
check "it says how to go on" grep -q 'the same command continues' "$work/b.txt"
check "so does progress.txt" grep -q '^now: stopped; the same command continues' "$work/b/progress.txt"
check "its runner is gone" test ! -d "/proc/$(cat "$CALLS.pid")"
before=$(wc -l <"$CALLS")
expect 0 'report.md' "${run[@]}" --out "$work/b" --seeds 2 --only fr1_xyz
check "it goes on where it was" test $(($(wc -l <"$CALLS") - before)) -eq 6

# Runs that fail are reported, tried again the next time, and three in a row end it.
expect 0 'dm/seed_1: exit status 7: it fell over' env FAIL=dm "${run[@]}" --out "$work/c" --seeds 1
check "the report counts them" grep -q '4 of 12 failed or gave no trajectory' "$work/c/report.md"
check "as nothing tracked" grep -qE '^\| fr1_xyz \| dm \| 0/1 \| 1 of 1 \| – \| – \| 0\.0 \| 0\.0 \| 0\.0 ' "$work/c/report.md"
check "progress.txt counts them" grep -q '^failed this time: 4' "$work/c/progress.txt"
check "the report lists them" grep -q 'the run failed: exit status 7: it fell over' "$work/c/report.md"
expect 0 'report.md' "${run[@]}" --out "$work/c" --seeds 1
check "the second time they are well" test -z "$(grep 'the run failed' "$work/c/report.md")"
expect 0 'seed_1: exit status 9: it fell over in the end' env FALL=dm "${run[@]}" --out "$work/f" --seeds 1 --only fr1_xyz
check "a summary does not make a run that failed a good one" grep -q '2 of 6 failed' "$work/f/report.md"
printf '#!/bin/sh\necho it fell over\nexit 7\n' >"$work/broken"
chmod +x "$work/broken"
expect 1 '3 runs failed in a row; see .*log.txt' "${run[@]}" --out "$work/d" --runner "$work/broken"
check "the report is written all the same" grep -q '3 of 3 failed or gave no trajectory' "$work/d/report.md"
check "progress.txt tells how it ended" grep -q '^now: ended with exit status 1; the same command continues' "$work/d/progress.txt"
: >"$CALLS"
expect 0 'report.md' "${run[@]}" --out "$work/d" --seeds 1
check "what failed comes last" test "$(tail -n 3 "$CALLS" | grep -c 'features.count=3000')" -eq 3

# The short names, and folders of sequences.
mkdir -p "$work/short/deeper"
cp -r "$tum/rgbd_dataset_freiburg1_xyz" "$work/short/fr1_xyz"
cp -r "$tum/rgbd_dataset_freiburg3_walking_xyz" "$work/short/deeper/fr3_walking_xyz"
: >"$CALLS"
expect 0 'report.md' "$reproduce" --tum "$work/short" --no-render --data "$work/none" --runner "$work/runner" --out "$work/s" --seeds 1
check "are found" test "$(wc -l <"$CALLS")" -eq 12

# A summary that was written in halves is a failed run in the report, and is run again.
printf '{"tracked_percent": 98' >"$work/f/runs/fr1_xyz/defaults/dm/seed_1/summary.json"
rm "$work/f/runs/fr1_xyz/defaults/dm/seed_1/failed.txt"
expect 0 'report.md' "$reproduce" --out "$work/f" --report-only
check "half a summary is a failed run" grep -q 'the run failed: .*summary.json: is not JSON; the same command' "$work/f/report.md"
: >"$CALLS"
expect 0 'report.md' "${run[@]}" --out "$work/f" --seeds 1 --only fr1_xyz
check "it is run again" grep -q -- '--out [^ ]*/runs/fr1_xyz/defaults/dm/seed_1' "$CALLS"
check "all six are well now" grep -q '6 of 6 runs' "$work/f/report.md"

# Nothing is there: a report that lists what is absent.
mkdir "$work/empty"
expect 0 'none of the sequences is there' "$reproduce" --tum "$work/empty" --no-render --runner "$work/runner" --data "$work/none" --out "$work/e"
check "what can be downloaded has its address" grep -qE '^\| kitchen \|.*absent.*https://www.microsoft.com/.*7-scenes' "$work/e/report.md"
check "what cannot says so" grep -qE '^\| kitchen_walk1 \|.*absent.*no public download page' "$work/e/report.md"
check "all are listed as absent" test "$(grep -c '\*\*absent\*\*' "$work/e/report.md")" -eq 14

# The pictures of what is taken for static: once per sequence, and what fails is named once.
mkdir "$work/bin"
ln -s "$report" "$work/bin/dmslam-report"
ln -s "$work/runner" "$work/bin/dmslam-inprocess"
# shellcheck disable=SC2016 # it is the program's
printf '#!/bin/sh\necho "static $*" >>"$CALLS"\necho no matches\nexit 1\n' >"$work/bin/dmslam-static"
chmod +x "$work/bin/dmslam-static"
: >"$CALLS"
expect 0 'no figures of fr3_walking_xyz: no matches' \
  env DMSLAM_BIN="$work/bin" "$reproduce" --tum "$tum" --no-render --data "$work/none" --out "$work/g" --seeds 2
check "named once" test "$(grep -c 'no figures of' <<<"$output")" -eq 1
check "tried once" test "$(grep -c '^static --sequence' "$CALLS")" -eq 1
check "Table 1 is not there in halves" test ! -e "$work/g/table1.json.part"

# They are kept, with the version of the programs, and made again by another one.
cat >"$work/bin/dmslam-static" <<'EOF'
#!/usr/bin/env bash
echo "static $*" >>"$CALLS"
if [[ $1 == time ]]; then
  cp -- "$OUT/progress.txt" "$CALLS.progress"
  echo '{"ransac_ms": 1, "arsac_ms": 2, "dlrsac_ms": 3, "machine": "Z80"}' >"${@: -1}"
else
  mkdir -p "${@: -1}"
  echo >"${@: -1}/pair_1.png"
fi
EOF
again=(env DMSLAM_BIN="$work/bin" OUT="$work/g" "$reproduce" --tum "$tum" --no-render --data "$work/none" --out "$work/g" --seeds 2)
made() { # COUNT: so many calls of dmslam-static, of which one is for Table 1 where there are any
  : >"$CALLS"
  expect 0 'report.md' "${again[@]}"
  check "dmslam-static is called $1 times" test "$(grep -c '^static ' "$CALLS")" -eq "$1"
}
made 3
check "progress.txt tells that Table 1 is timed" grep -q '^now: timing the methods of Table 1' "$CALLS.progress"
check "figures have a version" test "$(cat "$work/g/figures/fr3_walking_xyz/version")" = "$("$report" --version)"
check "Table 1 is in the report" grep -q 'Z80' "$work/g/report.md"
made 0
echo 0.0.9 >"$work/g/table1.version"
made 1
echo 0.0.9 >"$work/g/figures/fr3_walking_xyz/version"
made 2

finish
