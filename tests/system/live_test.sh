# A camera that serves its images over HTTP, as IP cameras do, is watched live, and the player is told to stop.
source "$(dirname "$0")/lib.sh"
need_synthetic
multicast

ip link set lo up
python3 - "$synthetic/rgb" >"$work/port" 2>"$work/server.log" <<'EOF' &
import http.server, pathlib, sys, time
images = [p.read_bytes() for p in sorted(pathlib.Path(sys.argv[1]).glob("*.jpg"))]
asked = 0  # how often somebody wanted the flickering camera
class Camera(http.server.BaseHTTPRequestHandler):
    def do_GET(self):
        global asked
        flickers = self.path == "/flickers.mjpg"
        asked += flickers
        if flickers and asked in (2, 3):  # it is away
            return self.send_error(503)
        self.send_response(200)
        self.send_header("Content-Type", "multipart/x-mixed-replace; boundary=frame")
        self.end_headers()
        for i in range(20 if flickers and asked == 1 else 100000):  # there and back
            image = images[i % (2 * len(images)) if i % (2 * len(images)) < len(images) else -1 - i % len(images)]
            self.wfile.write(b"--frame\r\nContent-Type: image/jpeg\r\nContent-Length: %d\r\n\r\n%s\r\n" % (len(image), image))
            time.sleep(1 / 15)
    def log_message(self, *_): pass
server = http.server.ThreadingHTTPServer(("127.0.0.1", 0), Camera)
print(server.server_address[1], flush=True)
server.serve_forever()
EOF
server=$!
for ((i = 0; i < 200; ++i)); do [[ -s $work/port ]] && break; sleep 0.05; done
address=http://127.0.0.1:$(<"$work/port")/camera.mjpg
camera=$root/config/synthetic.yaml

refused "waits for nobody" run --video "$address" --camera "$camera" --lockstep --out "$work/refused"
sed 's/^width:.*/width: 320/; s/^cx:.*/cx: 160/' "$camera" >"$work/small.yaml"
refused "640x480 pixels, the camera file says 320x480" run --video "$address" --camera "$work/small.yaml" --out "$work/refused"
refused "cannot be opened as a camera" run --video http://127.0.0.1:1/none --camera "$camera" --out "$work/refused"
refused "/dev/video99: cannot be opened as a camera" run --video /dev/video99 --camera "$camera" --out "$work/refused"

run --video "$address" --camera "$camera" --out "$work/live" >"$work/said" 2>&1 &
running=$!
busy() { # the collector keeps a record of every frame that was worked on
  local size
  size=$(stat -c %s "$work/live/collector.journal" 2>/dev/null)
  ((${size:-0} > 8000))
}
for ((i = 0; i < 1200; ++i)); do busy && break; sleep 0.05; done
kill -TERM "$(<"$work/live/log/player.pid")"
status=0
wait $running || status=$?
((status == 0 || status == 6)) || failed "the run ended with $status: $(tail -n 3 "$work/said")"
no_orphans "the run"
expect "frames were published" "$work/live" frames ">= 5"
expect "frames were worked on" "$work/live" frames_processed ">= 5"

# A camera that goes away for a while, and is tracked before and after it.
run --video "http://127.0.0.1:$(<"$work/port")/flickers.mjpg" --camera "$camera" --frames 150 --out "$work/away" >"$work/said" 2>&1 ||
  failed "the run with a camera that goes away ended with $?: $(tail -n 3 "$work/said")"
no_orphans "the run with a camera that goes away"
check "it says that the camera is away" grep -q "it is looked for until it is back" "$work/away/log/player.log"
check "it says that the camera is back" grep -q "the camera is back" "$work/away/log/player.log"
expect "it goes on" "$work/away" frames "== 150"
expect "it is tracked" "$work/away" tracked_online_percent ">= 40"
check "frames have the time at which they came" python3 - "$work/away/poses_online.csv" <<'EOF'
import statistics, sys, time
poses = [line.split(",") for line in open(sys.argv[1]) if not line.startswith("#")]
steps = [float(b[0]) - float(a[0]) for a, b in zip(poses, poses[1:]) if int(b[1]) == int(a[1]) + 1]
assert abs(float(poses[-1][0]) - time.time()) < 60, poses[-1][0]
assert 0.03 < statistics.median(steps) < 0.3, statistics.median(steps)
EOF
kill $server
finish
