#!/usr/bin/env bash
# scripts/population.sh with programs that only pretend to make sequences and to run: arguments, halves, continuing,
# stopping, the tables.
# shellcheck source-path=SCRIPTDIR source=expect.sh
source "$(dirname "$0")/expect.sh"
population=$DMSLAM_SOURCE_DIR/scripts/population.sh
DMSLAM_BIN=$work/bin
DMSLAM_SHARED=$work/shared
export DMSLAM_BIN DMSLAM_SHARED CALLS=$work/calls
mkdir -p "$DMSLAM_BIN" "$DMSLAM_SHARED/population" "$DMSLAM_SHARED/tools"
ln -s "$1" "$DMSLAM_BIN/dmslam-report"
: >"$CALLS"

cat >"$work/make" <<'EOS'
make_sequence() { # FOLDER
  mkdir -p "$1"
  touch "$1/camera.yaml"
  awk 'BEGIN { for (i = 0; i < 60; ++i) { t = i / 30;
    printf "%.6f %.9f %.9f %.9f 0 0 0 1\n", 100 + t, sin(t), cos(t), 0.3 * t > "'"$1"'/groundtruth.txt";
    printf "%.6f rgb/%d.png\n", 100 + t, i > "'"$1"'/rgb.txt"; print 0.3 > "'"$1"'/coverage.txt" } }'
}
EOS
cat >"$DMSLAM_BIN/dmslam-synth" <<EOS
#!/usr/bin/env bash
source "$work/make"
EOS
cat >>"$DMSLAM_BIN/dmslam-synth" <<'EOS'
echo "synth $*" >>"$CALLS"
while [[ $1 != --out ]]; do shift; done
make_sequence "$2"
EOS
cat >"$DMSLAM_SHARED/tools/add_people.py" <<EOS
#!/usr/bin/env bash
source "$work/make"
EOS
cat >>"$DMSLAM_SHARED/tools/add_people.py" <<'EOS'
echo "people $*" >>"$CALLS"
[[ $* != *"--seed 13 "* ]] || { echo "no picture of 13" >&2; exit 1; }
make_sequence "$2"
EOS
cat >"$DMSLAM_BIN/dmslam-inprocess" <<'EOS'
#!/usr/bin/env bash
echo "run $*" >>"$CALLS"
while (($#)); do
  [[ $1 == --sequence || $1 == --out ]] && declare "${1//[-]/_}=$2"
  shift
done
if [[ -n ${SLOW:-} ]]; then echo $$ >>"$CALLS.pid"; exec sleep 60; fi
[[ -z ${BROKEN:-} ]] || { echo "the camera is broken" >&2; exit 3; }
cp "$__sequence/groundtruth.txt" "$__out/trajectory.txt"
cp "$__sequence/groundtruth.txt" "$__out/trajectory_online.txt"
echo '{"version": "1.0"}' >"$__out/summary.json"
EOS
chmod +x "$DMSLAM_BIN"/* "$DMSLAM_SHARED/tools/add_people.py"
cat >"$DMSLAM_SHARED/population/grid.txt" <<'END'
# half name seed actors pause distance amplitude first last
develop a 1 2 1 0.45 0.5 0 600
develop b 2 1 0 0.55 0.6 100 700
report c 3 1 0 0.55 0.6 100 700
END
cat >"$work/rendered.txt" <<'END'
# half name options
develop r01 --seed 1 --path xyz
report r02 --seed 2 --path rpy
END
lists=(--list "$DMSLAM_SHARED/population/grid.txt" --list "$work/rendered.txt" --sequences "$work/sequences")

expect 0 'Usage' "$population" --help
expect 1 'unknown argument --frob' "$population" --frob
expect 1 '--half needs a value' "$population" --half
expect 1 '--half both: choose' "$population" --half both
expect 1 '--jobs none' "$population" --jobs none
expect 1 'no sequence of the develop half is wanted' "$population" "${lists[@]}" --only z --out "$work/a"

# Only the half that is asked for, each sequence by its own program with its own arguments; nothing is run twice.
expect 0 '\| 10 to 40 % \| a \| 2 of 2 \(100 %\)' "$population" "${lists[@]}" --out "$work/a" --data "$work/data" --set x.y=1
check "two composited" test "$(grep -c ^people "$CALLS")" -eq 2
check "pause" grep -qF -- '--seed 1 --actors 2 --pause --distance 0.45 --amplitude 0.5 --first 0 --last 600' "$CALLS"
check "no pause" grep -qF -- '--seed 2 --actors 1 --distance' "$CALLS"
check "one rendered" test "$(grep -c ^synth "$CALLS")" -eq 1
check "three runs" test "$(grep -c '^run.*--profile dm --seed 1 .*--set x.y=1' "$CALLS")" -eq 3
check "a table" grep -q 'rendered, develop half' "$work/a/develop.md"
check "and its figures" grep -q '"successes": 2' "$work/a/develop.json"
check "quiet in a pipe" test -z "$(grep -F '[1/' <<<"$output")"
: >"$CALLS"
expect 0 'success' "$population" "${lists[@]}" --out "$work/a" --set x.y=1
check "nothing is run twice" test ! -s "$CALLS"
expect 1 'holds runs of .*, not of' "$population" "${lists[@]}" --out "$work/a"

# Sequences are shared between systems; both stand in one table. The report half shows no single sequence.
expect 0 '\| baseline \| 2 of 2' "$population" "${lists[@]}" --out "$work/baseline" --profile baseline --jobs 2 --compare "dm=$work/a"
check "no sequence is made again" test "$(grep -cE '^(people|synth)' "$CALLS")" -eq 0
check "side by side" grep -q '| dm | 2 of 2' "$work/baseline/develop.md"
expect 0 'composited, report half' "$population" "${lists[@]}" --out "$work/b" --half report
check "no single sequence" test "$(grep -c '^| c ' "$work/b/report.md")" -eq 0
expect 0 '^\| c \|' "$population" "${lists[@]}" --out "$work/b" --half report --details --report-only
: >"$CALLS"
expect 0 'composited' "$population" "${lists[@]}" --out "$work/c" --only b --only rendered
check "two of three" test "$(grep -c ^run "$CALLS")" -eq 2

# What fails is named, counts as no success, and is tried again.
BROKEN=1 expect 0 'a: exit status 3: the camera is broken' "$population" "${lists[@]}" --out "$work/d"
check "none of three" grep -q '| all | d | 0 of 2 (0 %)' "$work/d/develop.md"
expect 0 '\| all \| d \| 2 of 2' "$population" "${lists[@]}" --out "$work/d"
echo 'develop bad 13 1 0 0.5 0.5 0 600' >"$work/bad.txt"
expect 0 'bad cannot be made: no picture of 13' "$population" --list "$work/bad.txt" --sequences "$work/sequences" --out "$work/e"
check "nothing half made" test -z "$(find "$work/sequences" -name '*bad' -o -name '*.part')"
echo 'develop bad 13 1 0' >"$work/bad.txt"
expect 1 'bad: write half, name, seed' "$population" --list "$work/bad.txt" --out "$work/e"

# Stopped in the middle: exit 130, all runs are gone, and the same command goes on.
SLOW=1 "$population" "${lists[@]}" --out "$work/f" --jobs 2 >"$work/f.txt" 2>&1 &
pid=$!
for _ in $(seq 200); do [[ -s $CALLS.pid && $(wc -l <"$CALLS.pid") -ge 2 ]] && break; read -rt 0.1 <> <(:) || true; done
kill -TERM "$pid"
wait "$pid"
check "stopped, it exits with 130" test $? -eq 130
check "it says how to go on" grep -q 'the same command continues' "$work/f.txt"
while read -r run; do
  for _ in $(seq 50); do [[ -d /proc/$run ]] || break; read -rt 0.1 <> <(:) || true; done
  check "its run is gone" test ! -d "/proc/$run"
done <"$CALLS.pid"
expect 0 'success' "$population" "${lists[@]}" --out "$work/f"

# The list of rendered sequences is what its script makes of consecutive seeds.
check "the list in config/ is generated" diff "$DMSLAM_SOURCE_DIR/config/population_rendered.txt" \
  <("$DMSLAM_SOURCE_DIR/scripts/population_rendered.sh")

finish
