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
refused "no_such" "$static" judge --sequence "$work/no_such" --camera "$camera"
finish
