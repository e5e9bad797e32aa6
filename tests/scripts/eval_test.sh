#!/usr/bin/env bash
# dmslam-eval as users call it: results, pictures, and every kind of bad input.
# shellcheck source-path=SCRIPTDIR source=expect.sh
source "$(dirname "$0")/expect.sh"
eval=$1

# A helix at 30 Hz, and the same in another unit (x 0.5) with a little of a second wave.
awk 'BEGIN { for (i = 0; i < 200; ++i) { t = i / 30;
  printf "%.6f %.9f %.9f %.9f 0 0 0 1\n", 100 + t, sin(t), cos(t), 0.3 * t > "'"$work"'/gt.txt";
  printf "%.6f %.9f %.9f %.9f 0 0 0 1\n", 100 + t, 0.5 * sin(t) + 0.01 * sin(9 * t), 0.5 * cos(t), 0.15 * t > "'"$work"'/est.txt";
  printf "%.6f rgb/%d.png\n", 100 + t, i > "'"$work"'/rgb.txt" } }'
gt=$work/gt.txt est=$work/est.txt

expect 0 'ATE \[m\]' "$eval" "$gt" "$est" --json "$work/r.json" --plot "$work/p" --frames "$work/rgb.txt"
for what in 'RPE per second \[deg\]' 'RPE per metre \[m\]' '100.0 % \(200 poses, 200 frames\); first pose after 0.00 s'; do
  check "the table says $what" grep -qE "$what" <<<"$output"
done
check "JSON names the scale" grep -q '"scale": 1.99' "$work/r.json"
check "there is a PNG" grep -q PNG "$work/p.png"
check "there is an SVG" grep -q '</svg>' "$work/p.svg"
expect 0 'alignment se3, scale 1,' "$eval" "$gt" "$est" --align se3
expect 0 'RPE per 0.5 seconds' "$eval" "$gt" "$est" --rpe-delta 0.5s 10f
head -n 150 "$est" | tail -n 100 >"$work/part.txt"
expect 0 '50.0 % .*first pose after 1.67 s' "$eval" "$gt" "$work/part.txt" --frames "$work"
expect 0 '80.0 %' "$eval" "$gt" "$est" --frame-count 250
expect 0 '100.0 %' "$eval" "$gt" "$est" --frame-count 200
for count in -3 0 5 199; do
  expect 1 "--frame-count $count: .*est.txt has 200 poses; write the number of all frames" \
    "$eval" "$gt" "$est" --frame-count $count
done
expect 108 'frame-count' "$eval" "$gt" "$est" --frames "$work/rgb.txt" --frame-count 200
expect 0 '[0-9]+\.[0-9]+\.[0-9]+' "$eval" --version
expect 0 'Usage' "$eval" --help

bad() {  # PATTERN TEXT: an estimate with that text
  printf '%b' "$2" >"$work/bad.txt"
  expect 1 "$1" "$eval" "$gt" "$work/bad.txt"
}
bad 'bad.txt:2.*7 columns' '100.0 0 0 0 0 0 0 1\n100.1 0 0 0 0 0 1\n'
bad 'bad.txt:2.*9 columns' '100.0 0 0 0 0 0 0 1\n100.1 0 0 0 0 0 0 1 5\n'
bad 'bad.txt:3.*earlier' '100.0 0 0 0 0 0 0 1\n100.2 0 0 0 0 0 0 1\n100.1 0 0 0 0 0 0 1\n'
bad 'bad.txt:2.*repeats' '100.0 0 0 0 0 0 0 1\n100.0 0 0 0 0 0 0 1\n'
bad 'bad.txt:1.*not a finite number' '100.0 nan 0 0 0 0 0 1\n'
bad 'bad.txt:1.*not a finite number' '100.0 0 inf 0 0 0 0 1\n'
bad 'bad.txt:1.*stamp' 'nan 0 0 0 0 0 0 1\n'
bad 'bad.txt:1.*quaternion is zero' '100.0 0 0 0 0 0 0 0\n'
bad 'no pose' '# nothing\n'
bad 'no overlap in time' '500.0 0 0 0 0 0 0 1\n500.1 1 0 0 0 0 0 1\n500.2 0 1 0 0 0 0 1\n'
bad 'fewer than three pairs: 2' '100.0 0 0 0 0 0 0 1\n100.1 1 0 0 0 0 0 1\n'
bad 'one point or on one line' '100.0 0 0 0 0 0 0 1\n100.1 1 0 0 0 0 0 1\n100.2 2 0 0 0 0 0 1\n'
printf '100.0 0 0 0 0 0 0 1\n100.0 1 0 0 0 0 0 1\n100.1 0 1 0 0 0 0 1\n' >"$work/bad.txt"
expect 1 'bad.txt:2.*repeats' "$eval" "$work/bad.txt" "$est"
expect 1 'nowhere.txt' "$eval" "$work/nowhere.txt" "$est"
expect 1 'cannot be written' "$eval" "$gt" "$est" --json "$work/no/such/folder.json"
cp "$est" "$work/est.svg"
for option in "--json $gt" "--json $work/rgb.txt" "--plot $work/est"; do
  # shellcheck disable=SC2086 # two words
  expect 1 'is read too, and would be lost' "$eval" "$gt" "$work/est.svg" --frames "$work" $option
done
check "what is read is left alone" cmp "$est" "$work/est.svg"
expect 1 'is the name of a folder' "$eval" "$gt" "$est" --plot "$work/"
expect 1 'is the name of a folder' "$eval" "$gt" "$est" --json "$work"
expect 0 'written: .*/q.png, .*/q.svg' "$eval" "$gt" "$est" --plot "$work/q.png"
expect 1 'standard output cannot be written' bash -c "'$eval' '$gt' '$est' >/dev/full"
printf '\xef\xbb\xbf' | cat - "$est" >"$work/bom.txt"
expect 0 '200 pairs' "$eval" "$gt" "$work/bom.txt"
sed '7s/ [^ ]*/ 1e300/' "$est" >"$work/far.txt"
expect 1 'estimate: pose 7 .*more than 1e12' "$eval" "$gt" "$work/far.txt" --align none
expect 1 '--rpe-delta 1e30f' "$eval" "$gt" "$est" --rpe-delta 1e30f
expect 1 '--align best' "$eval" "$gt" "$est" --align best
expect 1 '--rpe-delta 3x' "$eval" "$gt" "$est" --rpe-delta 3x
expect 1 '--max-diff' "$eval" "$gt" "$est" --max-diff -1
expect fail 'EST is required' "$eval" "$gt"

finish
