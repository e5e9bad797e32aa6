# The viewer in a headless Chromium: a run is drawn, counters move, who is killed is seen as down and then as back.
source "$(dirname "$0")/lib.sh"
skip() { echo "SKIPPED: $*"; exit $SKIPPED; }
[[ -x $build/bin/dmslam-viewer ]] || skip "dmslam-viewer was not built"
command -v chromium >/dev/null || skip "chromium is missing (scripts/setup.sh browser)"
/usr/bin/python3 -c 'import websocket' 2>/dev/null || skip "python3-websocket is missing (scripts/setup.sh browser)"
multicast

pictures=$build/viewer_test
mkdir -p "$pictures"
if [[ -d $data/kitchen_walk1 ]]; then
  sequence=$data/kitchen_walk1 camera=$root/config/kitchen.yaml
else
  need_synthetic
  echo "$data/kitchen_walk1 is not there: the rendered sequence instead"
  sequence=$synthetic camera=$root/config/synthetic.yaml
fi
[[ -x $build/bin/dmslam-inprocess ]] || skip "dmslam-inprocess was not built"
check "a run in one process is recorded" "$build/bin/dmslam-inprocess" --sequence "$sequence" --camera "$camera" \
  --frames 90 --session 7 --out "$work/whole" --record "$work/whole.lcmlog" >"$work/whole.txt" 2>&1
check "the page shows the run" /usr/bin/python3 "$(dirname "$0")/viewer_test.py" --bin "$build/bin" --logs "$work" \
  --pictures "$pictures" --sequence "$sequence" --camera "$camera" --whole-log "$work/whole.lcmlog"
check "a screenshot is there" test -s "$pictures/run_dark.png"

# What users get wrong.
viewer=("$build/bin/dmslam-viewer" --lcm-url "udpm://239.255.76.67:27433?ttl=0")
quietly() { "${viewer[@]}" --quiet "$@"; }
refused "HOST:PORT" quietly --http 8080
refused "taken|not of this machine" quietly --http 192.0.2.1:8080
refused "libjs-three.*--three" quietly --http 127.0.0.1:0 --three "$work/none"
refused "index.html.*--web" quietly --http 127.0.0.1:0 --web "$work"
finish
