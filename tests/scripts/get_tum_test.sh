#!/usr/bin/env bash
# scripts/get_tum.sh: arguments, refusal without a network, whole and broken archives (from a file:// mirror).
# shellcheck source-path=SCRIPTDIR source=expect.sh
source "$(dirname "$0")/expect.sh"
get_tum=$DMSLAM_SOURCE_DIR/scripts/get_tum.sh
unset DMSLAM_TUM DMSLAM_TUM_URL

# A mirror with one small sequence.
mirror=$work/mirror
name=rgbd_dataset_freiburg3_walking_xyz
make_sequence() {  # FOLDER: two images, their list, a ground truth
  mkdir -p "$1/rgb"
  printf '# color images\n1.0 rgb/1.0.png\n1.1 rgb/1.1.png\n' >"$1/rgb.txt"
  printf '1.0 0 0 0 0 0 0 1\n' >"$1/groundtruth.txt"
  echo a >"$1/rgb/1.0.png"
  echo b >"$1/rgb/1.1.png"
}
pack() { mkdir -p "$mirror/freiburg3" && tar -czf "$mirror/freiburg3/$1.tgz" -C "$work/src" "$1"; }
make_sequence "$work/src/$name"
pack "$name"

expect 0 'Usage' "$get_tum" --help
expect 0 '^fr3_walking_halfsphere$' "$get_tum" --list
check "--list prints 47 sequences" test "$("$get_tum" --list | wc -l)" -eq 47
check "--list repeats none" test "$("$get_tum" --list | sort -u | wc -l)" -eq 47
expect 1 'name at least one sequence' "$get_tum"
expect 1 "no sequence is called 'fr9_xyz'" "$get_tum" fr9_xyz
expect 1 "no sequence is called 'xyz'" "$get_tum" xyz
expect 1 "no sequence is called ''" "$get_tum" --to "$work/a" ''
check "nothing was begun" test ! -e "$work/a"
expect 1 'unknown option --frobnicate' "$get_tum" --frobnicate
expect 1 '--to needs a folder' "$get_tum" --to

# Every spelling of a name; a second call leaves the folder alone.
for spelling in fr3_walking_xyz freiburg3_walking_xyz "$name"; do
  to="$work/with blank/$spelling"
  expect 0 '2 frames' "$get_tum" --base-url "file://$mirror" --to "$to" "$spelling"
  check "$spelling is unpacked" cmp "$to/$name/rgb/1.1.png" "$work/src/$name/rgb/1.1.png"
  check "nothing else is left" test "$(ls -A "$to")" = "$name"
done
expect 0 'is there already' env DMSLAM_TUM_URL="file://$mirror" DMSLAM_TUM="$to" "$get_tum" fr3_walking_xyz
rm "$to/$name/rgb/1.0.png"
expect 1 '1 of the 2 images in its rgb.txt are missing' "$get_tum" --base-url "file://$mirror" --to "$to" fr3_walking_xyz

# No network: an address that nothing can resolve, and a port on which nothing listens.
expect 1 'no network.*download' env no_proxy='*' "$get_tum" --base-url http://mirror.invalid/x --to "$work/a" fr1_xyz
expect 1 'no network' env no_proxy='*' "$get_tum" --base-url http://127.0.0.1:9/x --to "$work/a" fr1_xyz
check "no half of an archive is left" test -z "$(ls -A "$work/a")"
expect 1 'cannot be downloaded' "$get_tum" --base-url "file://$mirror" --to "$work/a" fr1_xyz
echo begun >"$work/a/rgbd_dataset_freiburg1_xyz.tgz"
expect 1 'cannot be downloaded' "$get_tum" --base-url "file://$mirror" --to "$work/a" fr1_xyz
check "what an earlier call brought is kept" grep -q begun "$work/a/rgbd_dataset_freiburg1_xyz.tgz"

# An archive that is whole already: servers answer 416 to who asks for the rest, which curl calls 22. A connection that was
# cut (18) and a full disk (23) keep what is there.
mkdir -p "$work/fake" "$work/d"
printf '#!/bin/sh\nexit "$CURL_SAYS"\n' >"$work/fake/curl"
chmod +x "$work/fake/curl"
with_curl() { CURL_SAYS=$1 PATH=$work/fake:$PATH "${@:2}"; }
archive=$work/d/$name.tgz
head -c 120 "$mirror/freiburg3/$name.tgz" >"$archive"
expect 1 'no network' with_curl 18 "$get_tum" --base-url http://x --to "$work/d" fr3_walking_xyz
expect 1 'disk full' with_curl 23 "$get_tum" --base-url http://x --to "$work/d" fr3_walking_xyz
check "what was downloaded is kept" test -s "$archive"
cp "$mirror/freiburg3/$name.tgz" "$archive"
expect 0 '2 frames' with_curl 22 "$get_tum" --base-url http://x --to "$work/d" fr3_walking_xyz
expect 1 'cannot be downloaded' with_curl 22 "$get_tum" --base-url http://x --to "$work/d" fr1_xyz

# Broken archives are named and removed, and the other sequences still come.
head -c 120 "$mirror/freiburg3/$name.tgz" >"$mirror/freiburg3/rgbd_dataset_freiburg3_walking_rpy.tgz"
expect 1 'walking_rpy.tgz is broken \(it does not unpack\) and was removed' \
  "$get_tum" --base-url "file://$mirror" --to "$work/b" fr3_walking_rpy fr3_walking_xyz
check "only the whole one is there" test "$(ls -A "$work/b")" = "$name"
cp "$mirror/freiburg3/$name.tgz" "$mirror/freiburg3/rgbd_dataset_freiburg3_teddy.tgz"
expect 1 'holds no folder rgbd_dataset_freiburg3_teddy' "$get_tum" --base-url "file://$mirror" --to "$work/c" fr3_teddy
make_sequence "$work/src/rgbd_dataset_freiburg3_cabinet"
rm "$work/src/rgbd_dataset_freiburg3_cabinet/groundtruth.txt"
pack rgbd_dataset_freiburg3_cabinet
expect 1 'it has no groundtruth.txt' "$get_tum" --base-url "file://$mirror" --to "$work/c" fr3_cabinet
check "nothing is left of them" test -z "$(ls -A "$work/c")"

finish
