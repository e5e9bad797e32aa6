#!/usr/bin/env bash
# The examples, built as their first lines say, print the same poses of a log, in C++ and in Java.
source "$(dirname "$0")/expect.sh"
root=${DMSLAM_SOURCE_DIR:?set by ctest} bin=$1 sequence=$2

check "a log is recorded" "$bin/dmslam-inprocess" --sequence "$sequence" --frames 60 --camera "$root/config/synthetic.yaml" \
  --out "$work/run" --record "$work/run.lcmlog"

check "C++ types" lcm-gen --cpp --cpp-hpath="$work/types" "$root/lcmtypes/dmslam_pose_t.lcm"
expect 0 "" c++ -std=c++17 -Wall -Wextra -isystem "$work/types" "$root/examples/pose_printer/pose_printer.cc" -llcm \
  -o "$work/pose_printer"
"$work/pose_printer" "file://$work/run.lcmlog?speed=0" >"$work/cpp.txt" 2>"$work/cpp.err"
check "C++ prints 60 frames" test "$(grep -c ' frame ' "$work/cpp.txt")" = 60
check "C++ prints poses" grep -qE 'frame 5[0-9]: at \(-?[0-9.]+, -?[0-9.]+, -?[0-9.]+\) of map 1, tr(acking|ying a map)' "$work/cpp.txt"
expect 1 "cannot be used" "$work/pose_printer" "nonsense://"

if command -v javac >/dev/null && [[ -s /usr/share/java/lcm.jar ]]; then
  check "Java types" lcm-gen -j --jpath="$work/java" "$root/lcmtypes/dmslam_pose_t.lcm"
  expect 0 "" javac -nowarn -cp "/usr/share/java/lcm.jar:$work/java" -d "$work" \
    "$root/examples/pose_printer/PosePrinter.java" "$work/java/dmslam/pose_t.java"
  LC_ALL=C java -cp "/usr/share/java/lcm.jar:$work" PosePrinter "$work/run.lcmlog" >"$work/java.txt"
  check "Java prints the same frames" cmp <(sed 's/:.*//' "$work/cpp.txt") <(sed 's/:.*//' "$work/java.txt")
  check "Java prints the same states" cmp <(sed 's/at (.*) of/of/; s/, [0-9]* % of.*//' "$work/cpp.txt") \
    <(sed 's/at (.*) of/of/; s/, [0-9]* % of.*//' "$work/java.txt")
else
  echo "Java is not checked: there is no javac, or no liblcm-java (scripts/setup.sh tools)"
fi
finish
