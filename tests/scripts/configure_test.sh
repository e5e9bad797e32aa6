#!/usr/bin/env bash
# A new folder is configured without options, as an editor does it, and the same folder again.
source "$(dirname "$0")/expect.sh"
root=${DMSLAM_SOURCE_DIR:?set by ctest}

for _ in first again; do
  expect 0 "" cmake -S "$root" -B "$work/new" -G Ninja -DCMAKE_BUILD_TYPE=Release
done
finish
