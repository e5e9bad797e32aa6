#!/usr/bin/env bash
# Every file and folder of the project that a page names is there, and so is every page it links to.
set -uo pipefail
cd "${DMSLAM_SOURCE_DIR:-$(dirname "$0")/../..}" || exit 1
failures=0
missing() { # PAGE NAME
  echo "$1 names $2, which is not there"
  failures=$((failures + 1))
}
top='(src|procs|tools|scripts|docs|config|tests|examples|lcmtypes|cmake|data)'
for page in README.md docs/*.md; do
  while read -r path; do
    [[ -e ${path%[.,]} || -e $path.h ]] || missing "$page" "$path"
  done < <(grep -oE '`[^`<>{}*]+`' "$page" | tr -d '`' | tr ' ' '\n' | grep -E "^$top/[A-Za-z0-9_./-]+$")
  while read -r link; do
    [[ -e $(dirname "$page")/$link ]] || missing "$page" "$link"
  done < <(grep -oE '\]\([^)#]+' "$page" | cut -c3- | grep -vE '^(https?|mailto):')
done
((failures == 0)) || exit 1
echo "all names were found"
