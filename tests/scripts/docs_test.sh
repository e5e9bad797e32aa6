#!/usr/bin/env bash
# Every file and folder of the project that a page names is there, and so is every page it links to. What lies in
# a room may be named as it is included, without src/dmslam before it.
set -uo pipefail
cd "${DMSLAM_SOURCE_DIR:-$(dirname "$0")/../..}" || exit 1
failures=0
missing() { # PAGE NAME
  echo "$1 names $2, which is not there"
  failures=$((failures + 1))
}
require() { # PAGE NAME PATH, of a header perhaps without its ending
  local path=${3%[.,]}
  [[ -e $path || -e $path.h ]] || missing "$1" "$2"
}
names() { # PAGE FOLDERS: what the page names that lies in one of them
  grep -oE '`[^`<>{}*]+`' "$1" | tr -d '`' | tr ' ' '\n' | grep -E "^($2)/[A-Za-z0-9_./-]+$"
}
top='src|procs|tools|scripts|docs|config|tests|examples|lcmtypes|cmake|data'
rooms=$(cd src/dmslam && printf '%s|' */ | tr -d /)dmslam
[[ $rooms == *'|map|'* ]] || { echo "no rooms in src/dmslam" && exit 1; }
for page in README.md docs/*.md; do
  while read -r name; do require "$page" "$name" "$name"; done < <(names "$page" "$top")
  while read -r name; do
    require "$page" "$name" "src/dmslam/${name#dmslam/}"
  done < <(names "$page" "$rooms")
  while read -r link; do
    [[ -e $(dirname "$page")/$link ]] || missing "$page" "$link"
  done < <(grep -oE '\]\([^)#]+' "$page" | cut -c3- | grep -vE '^(https?|mailto):')
done
((failures == 0)) || exit 1
echo "all names were found"
