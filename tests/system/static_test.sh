# Which matches are static, drawn and judged: every method on a rendered sequence with a walker, pairs with and without the
# initialiser's gates, first maps, the judge's tables, and what it says of bad input.
source "$(dirname "$0")/lib.sh"
need_synthetic
static=$build/bin/dmslam-static camera=$root/config/synthetic.yaml

number() { # FILE KEY: the number at the top of a JSON file
  sed -nE "s/^  \"$2\": *([^,]*),?$/\1/p" "$1"
}
select_static() { # NAME ARGUMENTS...: pictures and static.json in $work/NAME
  local out=$work/$1
  shift
  "$static" --sequence "$synthetic" --camera "$camera" --out "$out" "$@" >"$work/log.txt" 2>&1 ||
    { failed "dmslam-static $* ended with $?"; cat "$work/log.txt"; }
}

for method in dlrsac dlrsac-paper arsac ransac; do
  select_static "$method" --method "$method" --gap 8 --pairs 3
  check "$method draws three pairs" test "$(find "$work/$method" -name 'pair_*.png' -size +10k | wc -l)" = 3
  check "$method: precision" holds "$(number "$work/$method/static.json" precision) >= 0.9"
done
check "DLRSAC: recall" holds "$(number "$work/dlrsac/static.json" recall) >= 0.8"
select_static gated --gated --gap 12 --pairs 4
check "behind the gates: nothing is static where refused" awk '/refused/ && !/: 0 static of/ { bad = 1 } END { exit bad }' \
  "$work/log.txt"
check "behind the gates: precision" holds "$(number "$work/gated/static.json" precision) >= 0.95"
select_static maps --first-maps --pairs 2 --features 4000
check "first maps: at least one of two" test -n "$(find "$work/maps" -name 'map_*.png' -size +10k)"
check "first maps: every one is nearly all static" awk '/"precision"/ { n++; if ($2 + 0 < 0.9) bad = 1 } END { exit bad || !n }' \
  "$work/maps/static.json"

for table in pairs windows system starts; do
  check "judge: $table" "$static" judge --sequence "$synthetic" --camera "$camera" --table "$table" --count 2 --gaps 8 \
    --features 2000 --out "$work/$table.md" --json "$work/$table.json"
  check "judge: $table has rows" grep -qE '^\| (DLRSAC|2) \|' "$work/$table.md"
  check "judge: $table as JSON" python3 -c 'import json, sys; json.load(open(sys.argv[1]))' "$work/$table.json"
done

check "judge: system says which windows are bad" python3 -c '
import json, sys
bad = json.load(open(sys.argv[1]))["system"]["bad_windows"]
assert bad == {method: [] for method in bad} and "DLRSAC" in bad, bad
' "$work/system.json"

# Frames without a true pose are not judged.
half=$work/half
mkdir "$half"
ln -s "$synthetic"/* "$half/"
rm "$half/groundtruth.txt"
head -n $(($(wc -l <"$synthetic/groundtruth.txt") / 2)) "$synthetic/groundtruth.txt" >"$half/groundtruth.txt"
for table in pairs windows system; do
  check "judge: $table with half of the poses" "$static" judge --sequence "$half" --camera "$camera" --table "$table" \
    --count 4 --gaps 8 --only DLRSAC --features 1000 --out "$work/half_$table.md"
  check "judge: $table says what it left out" grep -qE '^[1-4] of 4 .* left out' "$work/half_$table.md"
done

# Two images: said as pairs of a sequence are.
mapfile -t frames < <(find "$synthetic/rgb/" -type f | sort)
for second in 8 0; do
  check "two images" "$static" "${frames[0]}" "${frames[$second]}" --camera "$camera" --out "$work/two" >"$work/two_$second.txt"
done
check "two images: how many are static" grep -qE '^pair: [1-9][0-9]* static of [0-9]+$' "$work/two_8.txt"
check "two images: why they are refused" grep -qE '^pair: 0 static of [0-9]+, refused: .' "$work/two_0.txt"

check "time: measures" "$static" time --sequence "$synthetic" --camera "$camera" --rounds 3 --json "$work/time.json"
check "time: all made their iterations" python3 -c '
import json, sys
t = json.load(open(sys.argv[1]))
assert t["iterations"]["ransac"] == 2000 and t["iterations"]["arsac"] <= 2000 and 0 < t["iterations"]["dlrsac"] <= 2000, t
assert min(t["ransac_ms"], t["arsac_ms"], t["dlrsac_ms"]) > 0 and t["machine"], t
' "$work/time.json"

refused "unknown.*magsac" "$static" --sequence "$synthetic" --camera "$camera" --method magsac --out "$work/no"
refused "give two images" "$static" "$synthetic/rgb.txt" --camera "$camera" --out "$work/no"
refused "gap.*none" "$static" --sequence "$synthetic" --camera "$camera" --gap none --out "$work/no"
refused "give --sequence" "$static" "$synthetic/rgb.txt" "$synthetic/rgb.txt" --gated --camera "$camera" --out "$work/no"
refused "unknown table" "$static" judge --sequence "$synthetic" --camera "$camera" --table legs
refused "fewer frames" "$static" time --sequence "$synthetic" --camera "$camera" --gap 5000
refused "fewer frames" "$static" judge --sequence "$synthetic" --camera "$camera" --table pairs --gaps 9999 --out "$work/no.md"
refused "no method" "$static" judge --sequence "$synthetic" --camera "$camera" --table system --only written --out "$work/no.md"
refused "not both" "$static" "$synthetic/rgb.txt" "$synthetic/rgb.txt" --sequence "$synthetic" --camera "$camera" --out "$work/no"
for gap in -3 0 100001; do
  says=$("$static" judge --sequence "$synthetic" --camera "$camera" --table pairs --gaps "$gap" --out "$work/no.md" 2>&1) &&
    failed "judge takes --gaps $gap"
  check "judge: --gaps $gap: $says" grep -q "Value $gap not in range" <<<"$says"
done
without_poses=$work/without_poses
mkdir "$without_poses"
ln -s "$synthetic"/* "$without_poses/"
rm "$without_poses/groundtruth.txt"
refused "groundtruth.txt: missing" "$static" judge --sequence "$without_poses" --camera "$camera" --out "$work/no.md"
sed 's/^width: .*/width: 320/' "$camera" >"$work/narrow.yaml"
size="640x480 pixels, but the camera has 320x480"
refused "$size" "$static" --sequence "$synthetic" --camera "$work/narrow.yaml" --out "$work/no"
refused "$size" "$static" judge --sequence "$synthetic" --camera "$work/narrow.yaml" --out "$work/no.md"
refused "$size" "$static" time --sequence "$synthetic" --camera "$work/narrow.yaml"
check "judge writes nothing where it refuses" test ! -e "$work/no.md"
refused "no_such" "$static" judge --sequence "$work/no_such" --camera "$camera"
finish
