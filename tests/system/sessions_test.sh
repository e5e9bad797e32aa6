# What a second run adds to a saved map is in it; saved maps are listed, joined, compared and split; what does not fit is
# refused by name, and nothing is written.
source "$(dirname "$0")/lib.sh"
need_synthetic
multicast

camera=$root/config/synthetic.yaml
play=(run --sequence "$synthetic" --camera "$camera" --seed 3 --lockstep)
map() { "$build/bin/dmslam-map" "$@"; }
listed() { # FILE PATTERN
  map list "$1" >"$work/listed" || return
  grep -qE -- "$2" "$work/listed" || { cat "$work/listed"; return 1; }
}

check "the first run ends with 0" "${play[@]}" --frames 90 --save-map "$work/a.map" --out "$work/a"
check "the second one begins in its map" "${play[@]}" --start 60 --map "$work/a.map" --save-map "$work/ab.map" --out "$work/ab"
expect "the second run is tracked" "$work/ab" tracked_percent ">= 90"
expect "and well" "$work/ab" ate_rmse_final "<= 0.05"
check "both are one map" listed "$work/ab.map" "^$work/ab.map: 1 map, sessions [0-9]+, [0-9]+, "
check "the other one alone" "${play[@]}" --start 60 --save-map "$work/b.map" --out "$work/b"

# Four seconds in all: nothing is proven to be no person. The place fills the image, which nobody does.
check "two maps of one room are joined" map merge "$work/a.map" "$work/b.map" --save "$work/c.map" >"$work/said" 2>&1
check "it says by what, and of which file: $(<"$work/said")" \
  grep -qE "^joined: frame [0-9]+ of $work/b.map and frame [0-9]+ of $work/a.map: .*becomes part of map 1" "$work/said"
check "they are one map" listed "$work/c.map" "^$work/c.map: 1 map, sessions [0-9]+, [0-9]+, "
check "the same again" map merge "$work/a.map" "$work/b.map" --save "$work/again.map" >/dev/null 2>&1
check "gives the same bytes" cmp "$work/c.map" "$work/again.map"
check "its cameras" map --map "$work/c.map" --keyframes "$work/both.txt" >/dev/null
awk '!seen[$1]++' "$work/both.txt" >"$work/c.txt" # some frames are keyframes of both runs
check "are where they were" "$build/bin/dmslam-eval" "$synthetic/groundtruth.txt" "$work/c.txt" --json "$work/c.json" >/dev/null
check "to a few centimetres" holds "$(sed -nE '/"ate/,/}/s/^ *"rmse": *([0-9.]+),?$/\1/p' "$work/c.json" | head -n 1) <= 0.05"
check "a run begins in the joined map" "${play[@]}" --frames 40 --map "$work/c.map" --localize --out "$work/in_c"
expect "and finds itself" "$work/in_c" tracked_online_percent ">= 90"

session_of() { sed -nE '1s/.*: 1 map, sessions ([0-9]+), .*/\1/p' <(map list "$1"); } # FILE: of a map of one
for joined in ab c; do
  check "the landmarks of $joined are proven" map landmark "$work/$joined.map" --all --json "$work/proofs.json" >"$work/said"
  for first in a b; do
    [[ $joined$first != abb ]] || continue
    session=$(session_of "$work/$first.map")
    check "$joined has kept the run of $first" grep -qE "^run +session $session, seed 3, configuration [0-9a-f]{16}, profile dm$" "$work/said"
    check "and says which landmarks are of it" grep -q "\"state\":\"static\",\"session\":$session," "$work/proofs.json"
  done
done
check "the second run is in its map" grep -qE "^run +session [0-9]+, seed 3, .*, map.saved=on$" \
  <(map landmark "$work/ab.map" --all --json "$work/proofs.json")

check "a map does not differ from itself" map diff "$work/a.map" "$work/a.map" >"$work/said"
check "nothing is said then" test ! -s "$work/said"
map diff "$work/a.map" "$work/c.map" >"$work/said"
check "1: they differ" test $? = 1
check "all of A is in both" grep -qE "^keyframes +0 only in A +[1-9][0-9]* only in B +[1-9]" "$work/said"
map diff "$work/b.map" "$work/c.map" >"$work/said"
check "so is all of B" grep -qE "^keyframes +0 only in A +[1-9][0-9]* only in B +[1-9]" "$work/said"
check "whose landmarks are where they were, by their new ordinals" \
  holds "$(sed -nE 's/^ +landmarks .* median ([0-9.]+), .*/\1/p' "$work/said") <= 0.05"
map diff "$work/a.map" "$work/b.map" >"$work/said"
check "1: two runs differ" test $? = 1
check "they have nothing in common, though both number from 1" grep -q "^A and B have nothing in common" "$work/said"
check "and nothing that has moved" test "$(grep -c moved "$work/said")" = 0
map diff "$work/a.map" "$camera" 2>/dev/null
check "2: that is no map" test $? = 2

# Where too little is found they are not joined.
refused "a.map and $work/b.map: do not show the same place.*nothing is written" map merge "$work/a.map" "$work/b.map" \
  --set loop.min_matches=10000 --save "$work/none.map"
check "nothing is written" test ! -e "$work/none.map"
check "unless they may stay apart" map merge "$work/a.map" "$work/b.map" --set loop.min_matches=10000 --apart \
  --save "$work/apart.map" >/dev/null 2>&1
check "then there are two" listed "$work/apart.map" "^$work/apart.map: 2 maps"
check "which are split" map split "$work/apart.map" --save-prefix "$work/part" >/dev/null
check "the first is as it was" map diff "$work/a.map" "$work/part1.map"
check "the second is a map" listed "$work/part2.map" "^$work/part2.map: 1 map"
refused "a.map: holds one map.*nothing to split" map split "$work/a.map" --save-prefix "$work/part"

# What does not fit.
refused "a.map and $work/a.map: both hold session [0-9]+;.*--renumber" map merge "$work/a.map" "$work/a.map" --save "$work/none.map"
head -c $(($(wc -c <"$work/b.map") / 2)) "$work/b.map" >"$work/half.map"
for command in "merge $work/a.map $work/half.map --save $work/none.map" "diff $work/a.map $work/half.map" "list $work/half.map" \
  "split $work/half.map --save-prefix $work/none"; do
  # shellcheck disable=SC2086  # several words
  refused "half.map: is not whole: [0-9]+ of the [0-9]+ records of the saved map" map $command
done
refused "half.map: is not whole" "${play[@]}" --map "$work/half.map" --out "$work/o"
# One byte of the first message, which says how many records there are, is another one.
python3 - "$work/b.map" "$work/head.map" <<'EOP'
import sys

data = bytearray(open(sys.argv[1], "rb").read())
data[120] ^= 1
open(sys.argv[2], "wb").write(data[:len(data) // 2])
EOP
refused "head.map: is damaged: its first message" map list "$work/head.map"
python3 - "$work/old.map" <<'EOP'
import struct
import sys

# A record of the map as version 0.1 wrote it, in a log of lcm-logger.
channel, record = b"DMSLAM_MAPPER_MAP", bytes.fromhex("60594f88dd67af37") + bytes(192)
with open(sys.argv[1], "wb") as log:
    log.write(struct.pack(">IqqII", 0xEDA1DA01, 0, 1, len(channel), len(record)) + channel + record)
EOP
for command in "merge $work/old.map $work/a.map --save $work/none.map" "diff $work/a.map $work/old.map"; do
  # shellcheck disable=SC2086  # several words
  refused "old.map: recorded by version 0.1; this is version" map $command
done
refused "none.map: cannot be read" map merge "$work/a.map" "$work/none.map" --save "$work/new.map"
awk '/^fx:/ { $2 *= 1.01 } { print }' "$camera" >"$work/other.yaml"
check "a map of another camera" "$build/bin/dmslam-inprocess" --sequence "$synthetic" --camera "$work/other.yaml" --seed 3 \
  --frames 60 --session 77 --save-map "$work/other.map" --out "$work/o" >/dev/null 2>&1
refused "a.map and $work/other.map: were made with different cameras: fx [0-9.]+ and fx [0-9.]+; join maps of one camera file" \
  map merge "$work/a.map" "$work/other.map" --save "$work/none.map"
map diff "$work/a.map" "$work/other.map" >"$work/said"
check "1: they differ in their cameras" test $? = 1
check "it says in what" grep -qE "^camera +fx [0-9.]+ in A +fx [0-9.]+ in B$" "$work/said"
mkdir "$work/few"
find "$synthetic/rgb" -type f | sort | head -n 3 | xargs -I{} cp {} "$work/few"
check "a small vocabulary is trained" "$build/bin/dmslam-vocab" train --images "$work/few" --k 4 --levels 2 \
  --out "$work/small.dmv" >/dev/null 2>&1
joins_others=(map merge "$work/a.map" "$work/b.map" --vocabulary "$work/small.dmv" --save "$work/none.map")
refused "a.map: was made with another vocabulary .*--vocabulary" "${joins_others[@]}"
"${joins_others[@]}" 2>/dev/null
check "2: maps of another vocabulary" test $? = 2
# The results of an earlier run stay as they are: nothing is written before the map is known to fit.
cp -r "$work/a" "$work/before"
unchanged() { # DESCRIPTION
  check "$1: what was in the folder is as it was" diff -r "$work/before" "$work/a"
}
inprocess=("$build/bin/dmslam-inprocess" --sequence "$synthetic" --seed 3 --frames 20 --save-map "$work/none.map" --out "$work/a")
"${inprocess[@]}" --camera "$camera" --map "$work/a.map" --vocabulary "$work/small.dmv" >"$work/said" 2>&1
check "2: a run with another vocabulary than the map's" test $? = 2
check "is refused by name: $(tail -n 1 "$work/said")" grep -q "a.map: was made with another vocabulary .*--vocabulary" "$work/said"
unchanged "another vocabulary, in one process"
fits="was made with fx [0-9.]+, the camera that plays has fx [0-9.]+: give the camera file of that map"
refused "a.map: $fits" "${inprocess[@]}" --camera "$work/other.yaml" --map "$work/a.map"
unchanged "another camera, in one process"
refused "a.map: holds keyframes of session [0-9]+; give all processes a higher one" "${inprocess[@]}" --camera "$camera" \
  --map "$work/a.map" --session 1
unchanged "a session that is in the map, in one process"
refused "other.map: $fits" "${play[@]}" --map "$work/other.map" --out "$work/a"
unchanged "another camera"
refused "a.map: was made with features.levels=8 " "${play[@]}" --map "$work/a.map" --set features.levels=7 --out "$work/a"
unchanged "other settings"
refused "half.map: is not whole" "${play[@]}" --map "$work/half.map" --out "$work/a"
unchanged "half a map"
"$build/bin/dmslam-inprocess" --sequence "$synthetic" --camera "$camera" --seed 3 --frames 60 --vocabulary "$work/small.dmv" \
  --save-map "$work/words.map" --out "$work/o" >/dev/null 2>&1
check "a map of another vocabulary" test $? = 0
"${play[@]}" --map "$work/words.map" --out "$work/a" >"$work/said" 2>&1
check "2: a run in a map of another vocabulary" test $? = 2
check "is refused by name, too: $(tail -n 1 "$work/said")" grep -q "words.map: was made with another vocabulary" "$work/said"
unchanged "a map of another vocabulary"
"${play[@]}" --map "$work/words.map" --vocabulary "$work/small.dmv" --frames 20 --out "$work/words" >"$work/said" 2>&1
check "its own may be given" test $? != 2
check "the run begins in it" grep -q "words.map: [0-9]* keyframes and [0-9]* landmarks loaded" "$work/words/log/mapper.log"
refused "a.map and .*words.map: were made with different vocabularies .*can never be joined" map merge "$work/a.map" \
  "$work/words.map" --renumber --save "$work/none.map"
map diff "$work/a.map" "$work/words.map" >"$work/said"
check "diff names the vocabularies" grep -qE "^vocabulary +[0-9a-f]{16} in A +[0-9a-f]{16} in B$" "$work/said"
check "nothing was written" test ! -e "$work/none.map"
# A folder that is not there is named, before the work.
nowhere="$work/nowhere: no such folder, so [^ ]* cannot be written there; make it"
refused "save-map: $nowhere" "${play[@]}" --save-map "$work/nowhere/c.map" --out "$work/a"
unchanged "a folder for the map that is not there"
refused "$nowhere" "$build/bin/dmslam-inprocess" --sequence "$synthetic" --camera "$camera" --frames 20 \
  --save-map "$work/nowhere/c.map" --out "$work/o"
refused "$nowhere" map merge "$work/a.map" "$work/b.map" --save "$work/nowhere/c.map"
refused "$nowhere" map split "$work/apart.map" --save-prefix "$work/nowhere/part"
refused "$nowhere" map --map "$work/a.map" --save "$work/nowhere/c.map"
timeout 2 "$build/bin/dmslam-mapper" --lcm-url "udpm://239.255.76.67:23495?ttl=0" --session 5 --save-map "$work/nowhere/c.map" \
  >"$work/said" 2>&1
check "a mapper says so at its beginning: $(<"$work/said")" grep -qE "mapper: --save-map: $nowhere.*before the run ends" "$work/said"
finish
