#!/usr/bin/env bash
# Installed into a folder: the programs run from there, and projects of somebody else build against it.
source "$(dirname "$0")/expect.sh"
root=${DMSLAM_SOURCE_DIR:?set by ctest} build=$1 sequence=$2 prefix=$work/prefix

expect 0 "" cmake --install "$build" --prefix "$prefix"
for name in player frontend mapper loopcloser collector inprocess synth eval map vocab settings report run demo convert-camera; do
  check "dmslam-$name is there" test -x "$prefix/bin/dmslam-$name"
  check "it has a man page" test -s "$prefix/share/man/man1/dmslam-$name.1.gz"
done
zcat "$prefix/share/man/man1/dmslam-player.1.gz" >"$work/page"
for part in '^\.TH DMSLAM\\-PLAYER 1' '^\.SH NAME' '^dmslam\\-player \\- ' '^\.B \\-\\-lockstep'; do
  check "the man page has $part" grep -q "$part" "$work/page"
done
for file in share/dmslam/lcmtypes/dmslam_pose_t.lcm share/dmslam/config/TUM1.yaml share/dmslam/data/vocabulary.dmv \
  lib/systemd/system/dmslam-frontend@.service lib/systemd/system/dmslam@.target share/dmslam/system.env \
  share/doc/dmslam/copyright share/doc/dmslam/docs/camera.md; do
  check "$file is there" test -s "$prefix/$file"
done
if command -v systemd-analyze >/dev/null; then
  export SYSTEMD_UNIT_PATH=$prefix/lib/systemd/system:/usr/lib/systemd/system PATH=$prefix/bin:$PATH
  for name in player frontend mapper loopcloser collector; do
    systemd-analyze verify "dmslam-$name@test.service" 2>&1 | grep -E "dmslam-$name@.*(Unknown|Failed|Invalid|bad)" &&
      failures=$((failures + 1))
  done
fi

# Nothing of the source tree is needed.
cd "$work" || exit 1
expect 0 "" "$prefix/bin/dmslam-inprocess" --sequence "$sequence" --frames 60 --out "$work/run" \
  --camera "$prefix/share/dmslam/config/synthetic.yaml"
check "it has a trajectory" test -s "$work/run/trajectory.txt"
expect 0 "^Usage: dmslam-run " "$prefix/bin/dmslam-run" --help
expect fail "dmslam-run: --sequence is missing" "$prefix/bin/dmslam-run"
expect 0 "^Usage: dmslam-demo " "$prefix/bin/dmslam-demo" --help

expect 0 "" cmake -S "$root/examples/outside_project" -B "$work/outside" -DCMAKE_PREFIX_PATH="$prefix" \
  -DCMAKE_CXX_FLAGS="-Wall -Wextra -Werror" -DCMAKE_BUILD_TYPE=Release
expect 0 "" cmake --build "$work/outside"
expect 0 "seen at \(345.75, 292.00\)" "$work/outside/outside_project" "$prefix/share/dmslam/config/synthetic.yaml" \
  "$sequence/groundtruth.txt" "$work/run/trajectory.txt"
expect 0 "poses, ATE 0\.0[0-9]+" "$work/outside/outside_project" "$prefix/share/dmslam/config/synthetic.yaml" \
  "$sequence/groundtruth.txt" "$work/run/trajectory.txt"

# A room that is asked for is there, or refused by name.
mkdir "$work/rooms"
cat >"$work/rooms/CMakeLists.txt" <<'EOF'
cmake_minimum_required(VERSION 3.25)
project(rooms LANGUAGES CXX)
find_package(dmslam 0.2 REQUIRED COMPONENTS ${ROOMS})
foreach(room IN LISTS ROOMS)
  get_target_property(type dmslam::${room} TYPE)
  message(STATUS "dmslam::${room} is a ${type}")
endforeach()
EOF
expect 0 "dmslam::loops is a STATIC_LIBRARY" cmake -S "$work/rooms" -B "$work/rooms/all" \
  -DCMAKE_PREFIX_PATH="$prefix" "-DROOMS=tracking;mapping;loops;evaluation"
expect fail "no room of the name 'cellar'" cmake -S "$work/rooms" -B "$work/rooms/none" -DCMAKE_PREFIX_PATH="$prefix" -DROOMS=cellar

# The whole SLAM in one program, without LCM: the poses are those of the processes.
camera=$prefix/share/dmslam/config/synthetic.yaml
expect 0 "" cmake -S "$root/examples/slam_folder" -B "$work/slam" -DCMAKE_PREFIX_PATH="$prefix" \
  -DCMAKE_CXX_FLAGS="-Wall -Wextra -Werror" -DCMAKE_BUILD_TYPE=Release
expect 0 "" cmake --build "$work/slam"
check "it needs no LCM" test -z "$(ldd "$work/slam/slam_folder" | grep 'liblcm\.so')"
for example in "$root"/examples/*/*.{cc,java} "$root"/examples/python/*.py; do
  check "${example#"$root"/} has at most 80 lines" test "$(wc -l <"$example")" -le 80
done
expect 0 "of 150 frames tracked" "$work/slam/slam_folder" "$sequence" "$camera" \
  "$prefix/share/dmslam/data/vocabulary.dmv" "$work/folder.txt" seed=1
expect 0 "" "$prefix/bin/dmslam-inprocess" --sequence "$sequence" --camera "$camera" --seed 1 --out "$work/whole"
check "the trajectory is that of dmslam-inprocess" cmp "$work/folder.txt" "$work/whole/trajectory.txt"
expect 1 "slam_folder: .*nowhere" "$work/slam/slam_folder" "$work/nowhere" "$camera" \
  "$prefix/share/dmslam/data/vocabulary.dmv" "$work/folder.txt"

# The library's mapper under a main of its own, in place of the process.
expect 0 "" cmake -S "$root/examples/own_mapper" -B "$work/mapper" -DCMAKE_PREFIX_PATH="$prefix" \
  -DCMAKE_CXX_FLAGS="-Wall -Wextra -Werror" -DCMAKE_BUILD_TYPE=Release
expect 0 "" cmake --build "$work/mapper"
mv "$prefix/bin/dmslam-mapper" "$work/replaced"
cp "$work/mapper/own_mapper" "$prefix/bin/dmslam-mapper"
expect 0 "" "$prefix/bin/dmslam-run" --sequence "$sequence" --camera "$camera" --seed 1 --lockstep --out "$work/own" \
  --save-map "$work/own.map"
check "it was this mapper" grep -rq "own mapper: [0-9]* turns" "$work/own/log"
check "the run gives the same trajectory" cmp "$work/own/trajectory.txt" "$work/whole/trajectory.txt"
expect 0 "keyframes" "$prefix/bin/dmslam-map" list "$work/own.map"
finish
