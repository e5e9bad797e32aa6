#!/usr/bin/env bash
# Every script of scripts/ answers --help with its name and code 0, and does nothing else. (run.sh builds dmslam-run first.)
set -uo pipefail
cd "${DMSLAM_SOURCE_DIR:-$(dirname "$0")/../..}" || exit 1
failures=0 asked=0
for script in scripts/*.sh scripts/*.py; do
  name=${script##*/}
  [[ $name != run.sh ]] || continue
  case $script in
    *.py) said=$(timeout 20 /usr/bin/python3 "$script" --help 2>&1 </dev/null) ;;
    *) said=$(timeout 20 bash "$script" --help 2>&1 </dev/null) ;;
  esac
  code=$?
  asked=$((asked + 1))
  ((code == 0)) && [[ $said == *"$name"* ]] && continue
  echo "$script --help ends with $code and says: ${said:0:200}"
  failures=$((failures + 1))
done
((failures == 0 && asked > 30)) || exit 1
echo "$asked scripts answered"
