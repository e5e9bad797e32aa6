"""Runs the system by hand, opens the viewer's page, kills and restarts processes, and looks at what the page shows."""

import argparse
import os
import re
import signal
import socket
import struct
import subprocess
import sys
import time
import urllib.error
import urllib.request

sys.path.insert(0, os.path.dirname(os.path.abspath(__file__)))
from browser import Browser  # noqa: E402

URL = "udpm://239.255.76.67:27431?ttl=0&recv_buf_size=4194304"
FAILURES = []


def check(condition, what):
    print(("ok:     " if condition else "FAILED: ") + what, flush=True)
    if not condition:
        FAILURES.append(what)
    return condition


class System:
    """The processes of a run, started one by one."""

    def __init__(self, options):
        self.options = options
        self.processes = {}

    def start(self, name, *arguments, role=None):
        log = open(os.path.join(self.options.logs, name + ".log"), "a", encoding="utf-8")
        self.processes[name] = subprocess.Popen(
            [os.path.join(self.options.bin, "dmslam-" + (role or name)), "--lcm-url", URL, "--session", "7", *arguments],
            stdin=subprocess.DEVNULL, stdout=log, stderr=log)

    def record(self, path):
        self.processes["logger"] = subprocess.Popen(["lcm-logger", "--quiet", "--lcm-url=" + URL, path], stdin=subprocess.DEVNULL,
                                                    stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)

    def start_peer(self, name):
        self.start(name, "--peers", "frontend,mapper,loopcloser")

    def kill(self, name):
        self.processes[name].kill()
        self.processes[name].wait()

    def address(self, name):
        """What a viewer says of where it can be seen."""
        path = os.path.join(self.options.logs, name + ".log")
        for _ in range(200):
            found = re.search(r"http://\S+/", open(path, encoding="utf-8").read())
            if found:
                return found.group(0)
            time.sleep(0.05)
        raise RuntimeError("the viewer says no address: " + open(path, encoding="utf-8").read())

    def stop(self):
        for process in self.processes.values():
            if process.poll() is None:
                process.send_signal(signal.SIGTERM)
        for process in self.processes.values():
            try:
                process.wait(timeout=5)
            except subprocess.TimeoutExpired:
                process.kill()


def fetch(address, data=None):
    opener = urllib.request.build_opener(urllib.request.ProxyHandler({}))
    with opener.open(urllib.request.Request(address, data=data), timeout=20) as answer:
        return answer.read()


def points_of(address):
    words = struct.unpack("<10I", fetch(address + "api/map")[:40])
    return words[5], words[6]


def stall(address):
    """A browser that asks for everything and reads nothing."""
    host, port = re.match(r"http://([^:/]+):(\d+)/", address).groups()
    sockets = []
    for path in ("/api/events", "/api/map", "/three/build/three.module.js"):
        s = socket.create_connection((host, int(port)), timeout=5)
        s.sendall(f"GET {path} HTTP/1.1\r\nHost: {host}\r\n\r\n".encode())
        sockets.append(s)
    return sockets


def check_drawn(page, has_truth):
    drawn = page.wait("dmslam.store.numPoints > 150 && dmslam.store.numKeyframes >= 4 && dmslam.store.path.size >= 20 &&"
                      " dmslam.seen.features > 5", 150)
    if not check(drawn, "landmarks, keyframes and frames arrive"):
        print(page.eval("document.body.innerText"))
        return False
    pixels = page.eval("dmslam.scene.countPixels()")
    print("pixels:", pixels)
    for name, least in (("points", 200), ("frusta", 100), ("path", 40)):
        check(pixels[name] >= least, f"{name} are drawn: {pixels[name]} pixels")
    # Not in a frame that has no pose.
    placed = "[...dmslam.scene.poses.values()].some((pose) => pose)"
    check(page.wait(f"{placed} && dmslam.scene.countPixels().camera >= 60", 30), "the camera is drawn where it is")
    if has_truth:
        check(page.wait("dmslam.scene.countPixels().truth >= 20", 30), "the ground truth is drawn, aligned")
    return True


def check_counters(page):
    read = ("({frame: parseInt(document.getElementById('count-frame').textContent), poses: dmslam.seen.poses,"
            " series: dmslam.series.end, statuses: dmslam.seen.statuses, shown: dmslam.frame.shown})")
    before = page.eval(read)
    moved = page.wait(f"(() => {{ const n = {read}, b = {before}; return Object.keys(b).every((k) => n[k] > b[k]); }})()"
                      .replace("'", '"'), 30)
    check(moved, f"the counters move: {before} -> {page.eval(read)}")
    green = ("(() => { const c = document.getElementById('frame'); const d = c.getContext('2d').getImageData(0, 0, c.width,"
             " c.height).data; let n = 0; for (let i = 0; i < d.length; i += 4) if (d[i] < 110 && d[i + 1] > 190 &&"
             " d[i + 2] < 140) n++; return n; })()")
    check(page.wait(f"{green} > 200", 10), "used features are drawn over the frame in green")
    check(page.eval("dmslam.series.charts.every((c) => c.chart.data.datasets[0].data.length > 3)"), "charts have points")


def life(name):
    return f"(document.querySelector('#processes tr[data-name={name}]') || {{dataset: {{}}}}).dataset.life"


def check_restart(page, system, name, picture):
    check(page.wait(f"{life(name)} === 'up'", 10), f"{name} is up")
    system.kill(name)
    check(page.wait(f"{life(name)} === 'down'", 12), f"the killed {name} shows as down")
    page.screenshot(picture)
    system.start_peer(name)
    check(page.wait(f"{life(name)} === 'back'", 20), f"the restarted {name} shows as back: {page.eval(life(name))}")


def run(options, system):
    has_truth = os.path.exists(os.path.join(options.sequence, "groundtruth.txt"))
    picture = lambda name: os.path.join(options.pictures, name)  # noqa: E731
    system.start("viewer", "--http", "127.0.0.1:0")
    address = system.address("viewer")
    with Browser() as page:
        page.open(address + "?theme=dark")
        if not check(page.wait("dmslam.seen.statuses > 0", 20), "the page is connected before there is a camera"):
            return
        for name in ("mapper", "loopcloser", "frontend"):
            system.start_peer(name)
        system.start("player", "--sequence", options.sequence, "--camera", options.camera, "--speed", options.speed, "--lead", "4",
                     "--frames", options.frames)
        if not check_drawn(page, has_truth):
            return
        check_counters(page)
        page.screenshot(picture("run_dark.png"))
        stalled = stall(address)
        check_restart(page, system, "loopcloser", picture("loopcloser_down.png"))
        system.start("late_viewer", "--http", "127.0.0.1:0", role="viewer")
        late = system.address("late_viewer")
        for _ in range(100):
            points, keyframes = points_of(late)
            if points > 100 and keyframes >= 4:
                break
            time.sleep(0.1)
        check(points > 100 and keyframes >= 4, f"who comes late has the map: {points} landmarks, {keyframes} keyframes")
        page.eval("dmslam.setTheme('light')")
        page.screenshot(picture("run_light.png"))
        check_restart(page, system, "mapper", picture("mapper_down.png"))
        page.screenshot(picture("mapper_back.png"))
        before = page.eval("dmslam.seen.statuses")
        check(page.wait(f"dmslam.seen.statuses > {before} + 4", 10), "browsers that do not read slow nobody")
        for s in stalled:
            s.close()
        try:
            fetch(address + "api/map", data=b"x")
            check(False, "nothing can be sent to the viewer")
        except urllib.error.HTTPError as error:
            check(error.code in (404, 405), f"what is sent to the viewer is refused ({error.code})")
        errors = page.errors()
        check(not errors, f"no error on the console: {errors}")
        check(page.eval("dmslam.seen.errors") == 0, "no error in the page")


def show_log(options, system, log):
    """The same again from the recording: forward, back, pause and play."""
    system.start("log_viewer", "--http", "127.0.0.1:0", "--log", log, role="viewer")
    address = system.address("log_viewer")
    frames = "dmslam.series.data.frame.slice(-1)[0]"
    with Browser() as page:
        page.open(address + "?theme=dark")
        check(page.wait("!document.getElementById('playback').hidden", 20), "a log has a slider")
        duration = page.eval("dmslam.playback.state.duration")
        slide = ("(() => {{ const t = document.getElementById('time'); t.value = {0}; t.dispatchEvent(new Event('input'));"
                 " t.dispatchEvent(new Event('change')); }})()")
        page.eval(slide.format(600))
        there = page.wait(f"dmslam.playback.state.position > {0.58 * duration} && dmslam.store.numPoints > 150", 40)
        check(there, f"pulled to 60 % of {duration} s the log shows {page.eval('dmslam.store.numPoints')} landmarks")
        page.eval("document.getElementById('play').click()")
        check(page.wait("!dmslam.playback.state.playing", 10), "it can be paused")
        held = page.eval("dmslam.playback.state.position")
        time.sleep(1)
        check(page.eval("dmslam.playback.state.position") == held, "it stands still then")
        page.wait("dmslam.frame.shown > 0", 10)
        page.screenshot(os.path.join(options.pictures, "log.png"))
        late = page.eval(frames)
        page.eval(slide.format(round(1000 * (held - 1.5) / duration)))
        back = page.wait(f"dmslam.playback.state.position < {held - 1} && {frames} < {late}", 40)
        check(back, f"pulled back it shows an earlier time: frame {page.eval(frames)}, not {late}")
        page.eval("document.getElementById('speed').value = '4'; document.getElementById('speed').dispatchEvent(new Event('change'));"
                  " document.getElementById('play').click()")
        check(page.wait(f"dmslam.playback.state.speed === 4 && dmslam.playback.state.position > {held + 1}", 40), "it plays on, faster")
        errors = page.errors()
        check(not errors, f"no error on the console with a log: {errors}")


def show_cameras(options, system):
    """Two cameras, each with a player and a frontend: both are drawn, and either can be looked at."""
    cameras = ("--cameras", "2")
    peers = (*cameras, "--peers", "frontend,mapper,loopcloser")
    system.start("two_viewer", "--http", "127.0.0.1:0", *cameras, role="viewer")
    address = system.address("two_viewer")
    with Browser() as page:
        page.open(address + "?theme=dark")
        page.wait("dmslam.seen.connected", 20)
        for name in ("mapper", "loopcloser"):
            system.start(name, *peers)
        for camera, start in (("0", "0"), ("1", "100")):
            system.start("frontend" + camera, *peers, "--camera-id", camera, role="frontend")
            system.start("player" + camera, *cameras, "--camera-id", camera, "--sequence", options.sequence, "--camera",
                         options.camera, "--start", start, "--speed", options.speed, "--lead", "4", role="player")
        of = "[...dmslam.store.path.values()].filter((point) => point.camera === {0}).length"
        both = page.wait(f"{of.format(0)} >= 10 && {of.format(1)} >= 10", 150)
        check(both, f"frames of both cameras have their places: {page.eval(of.format(0))}, {page.eval(of.format(1))}")
        check(page.eval("dmslam.scene.labels.size") == 2, "both cameras are drawn where they are, with their numbers")
        legend = page.eval("document.getElementById('legend').textContent")
        check("camera 0" in legend and "camera 1" in legend, f"the legend names them: {legend}")
        for name in ("frontend", "frontend1", "player1"):
            check(page.wait(f"{life(name)} === 'up'", 10), f"{name} is listed, and up")
        page.eval("document.querySelector('#cameras [data-camera=\"1\"]').click()")
        newest = "dmslam.series.data.frame.slice(-1)[0]"
        check(page.wait("dmslam.series.data.frame[0] >= 100 && dmslam.series.data.frame.length > 10", 20),
              f"the curves of camera 1 are shown: up to frame {page.eval(newest)}")
        shown = page.eval("dmslam.frame.shown")
        check(page.wait(f"dmslam.frame.shown > {shown}", 20), "and its image")
        page.screenshot(os.path.join(options.pictures, "two_cameras.png"))
        errors = page.errors()
        check(not errors, f"no error on the console with two cameras: {errors}")


def main():
    parser = argparse.ArgumentParser()
    for name in ("bin", "logs", "pictures", "sequence", "camera"):
        parser.add_argument("--" + name, required=True)
    parser.add_argument("--speed", default="0.35")
    parser.add_argument("--frames", default="600")
    options = parser.parse_args()
    system = System(options)
    log = os.path.join(options.logs, "run.lcmlog")
    try:
        system.record(log)
        run(options, system)
        system.stop()
        show_log(options, system, log)
        system.stop()
        show_cameras(options, system)
    finally:
        system.stop()
    for name in ("viewer", "late_viewer", "log_viewer", "two_viewer"):
        check(system.processes[name].returncode == 0, f"{name} ends with {system.processes[name].returncode}")
    return 1 if FAILURES else 0


if __name__ == "__main__":
    sys.exit(main())
