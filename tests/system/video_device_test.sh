# A live run from /dev/videoN: OpenCV's own reader of Video4Linux, on a device that v4l2_stand_in.cc makes of rendered frames.
source "$(dirname "$0")/lib.sh"
need_synthetic
multicast
[[ -x $build/bin/make_layouts ]] || { echo "SKIPPED: built without OpenCV's videoio"; exit $SKIPPED; }
if ldd "$build/bin/dmslam-player" | grep -qE 'lib[at]san'; then
  echo "SKIPPED: nothing can be loaded before a sanitizer's library"
  exit $SKIPPED
fi
find_python
[[ -n $python ]] || { echo "SKIPPED: there is no Python 3 with ctypes"; exit $SKIPPED; }
cd "$root" || exit 1
check "the device is built" c++ -std=c++20 -Wall -Wextra -Werror -shared -fPIC tests/system/v4l2_stand_in.cc -o "$work/camera.so"
check "a video is made" "$build/bin/make_layouts" "$synthetic" "$work/in" 100
check "its frames are grey values" "$build/bin/dmslam-player" --quiet --video "$work/in/video.avi" --encoding raw \
  --camera config/synthetic.yaml --to-log "$work/raw.lcmlog"
check "Python types" lcm-gen -p --ppath="$work/types" lcmtypes/dmslam_frame_t.lcm
PYTHONPATH=$work/types:examples/python "$python" - "$work/raw.lcmlog" "$work/grey.raw" <<'EOF' || failed "the frames are not written"
import sys
import lcm
from dmslam import frame_t
with open(sys.argv[2], "wb") as out:
    log = lcm.LCM(f"file://{sys.argv[1]}?speed=0")
    log.subscribe("DMSLAM_PLAYER_FRAME", lambda channel, data: out.write(frame_t.decode(data).data))
    try:
        while True:
            log.handle()
    except IOError:
        pass  # the log has ended
EOF

live() { # OPTIONS...
  LD_PRELOAD=$work/camera.so CAMERA_NAME=/dev/video42 CAMERA_FRAMES=$work/grey.raw CAMERA_FPS=10 \
    run --video /dev/video42 "$@"
}
# The device delivers one size only, whatever it is asked for.
sed 's/^width:.*/width: 320/; s/^cx:.*/cx: 160/' config/synthetic.yaml >"$work/small.yaml"
refused "640x480 pixels, the camera file says 320x480" live --camera "$work/small.yaml" --out "$work/refused"
refused "/dev/video42: cannot be opened as a camera" run --video /dev/video42 --camera config/synthetic.yaml --out "$work/refused"

status=0
live --camera config/synthetic.yaml --encoding raw --frames 60 --out "$work/live" >"$work/said" 2>&1 || status=$?
((status == 0 || status == 6)) || failed "the run ended with $status: $(tail -n 3 "$work/said")"
no_orphans "the run"
expect "as many frames as were asked for" "$work/live" frames "== 60"
expect "frames were worked on" "$work/live" frames_processed ">= 20"
expect "nothing is lost" "$work/live" records_lost "== 0"
finish
