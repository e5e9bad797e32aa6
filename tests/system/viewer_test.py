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


# Makes of the run's cameras, maps and processes as many as there can be, with a long name and a weld, as the page hears of them.
AMEND = """(() => {
  const add = EventSource.prototype.addEventListener, count = 9;
  const crowd = (status) => {
    if (!status.sequence) return status;
    while (status.cameras.length < count) status.cameras.push({...status.cameras[0], id: status.cameras.length});
    status.maps = status.cameras.map((_, i) => ({id: i, name: i ? `map 1 of camera ${i}` : 'map 1', colour: i, keyframes: 3, offset: [0, 0, 0]}));
    for (let i = 1; i < count; ++i) status.processes.push({...status.processes[0], name: `frontend${i}`}, {...status.processes[0], name: `player${i}`});
    status.cameras[0].sequence = 'a_sequence_with_a_name_that_says_very_much_of_how_it_was_recorded';
    status.events.push({n: 99999, at: status.now, level: 'good', text: 'map 1 of camera 3 and map 1 of camera 4 are joined'});
    return status;
  };
  EventSource.prototype.addEventListener = function (name, handle) {
    return add.call(this, name, name === 'status' ? (event) => handle({data: JSON.stringify(crowd(JSON.parse(event.data)))}) : handle);
  };
})()"""

# What of the page's labels nobody can read: outside the window or of what holds it (unless that can be scrolled), shortened, or under
# another label.
CUT_OFF = """(() => {
  const cut = [], shown = (e) => e.getClientRects().length > 0 && e.getBoundingClientRect().width > 0;
  const name = (e) => `${e.id || e.className || e.tagName} (${e.textContent.trim().slice(0, 30)})`;
  const beyond = (r, b, style) => (r.right > b.right + 1 || r.left < b.left - 1) && !/auto|scroll/.test(style.overflowX) ||
      (r.bottom > b.bottom + 1 || r.top < b.top - 1) && !/auto|scroll/.test(style.overflowY);
  for (const e of document.querySelectorAll('header *, .bar *, .legend span, .kinds li, h2, h2 *, th, td, #events span, footer *, .hint')) {
    if (!shown(e) || e.tagName === 'OPTION') continue;
    const r = e.getBoundingClientRect(), style = getComputedStyle(e);
    if (style.overflowX === 'hidden' && e.scrollWidth > e.clientWidth + 1) cut.push(`${name(e)} is shortened`);
    if (e.scrollWidth > e.clientWidth + 1 && style.display !== 'inline' && style.overflowX === 'visible') cut.push(`${name(e)} runs over`);
    let scrolls = false;
    for (let box = e.parentElement; box && box !== document.body; box = box.parentElement) {
      const s = getComputedStyle(box);
      if (s.overflowX === 'visible' && s.overflowY === 'visible') continue;
      if (!scrolls && beyond(r, box.getBoundingClientRect(), s)) cut.push(`${name(e)} is cut off by ${name(box)}`);
      scrolls = scrolls || /auto|scroll/.test(s.overflowX + s.overflowY);
    }
    if (!scrolls && (r.left < -0.5 || r.right > innerWidth + 0.5)) cut.push(`${name(e)} is outside`);
  }
  for (const e of document.querySelectorAll('.scroll, aside, #events')) if (e.scrollWidth > e.clientWidth + 1) cut.push(`${name(e)} is too wide`);
  const boxes = [...document.querySelectorAll('.bar .group, .legend, #drawn, #weld')].filter((e) => shown(e) && e.textContent.trim());
  boxes.forEach((a, i) => boxes.slice(i + 1).forEach((b) => {
    const r = a.getBoundingClientRect(), q = b.getBoundingClientRect();
    if (r.left < q.right - 1 && q.left < r.right - 1 && r.top < q.bottom - 1 && q.top < r.bottom - 1) cut.push(`${name(a)} and ${name(b)} overlap`);
  }));
  return cut;
})()"""


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
    check_labels(options, address)


def show_whole_log(options, system):
    """The recording of a run in one process, from its beginning to its end."""
    system.start("whole_viewer", "--http", "127.0.0.1:0", "--log", options.whole_log, role="viewer")
    with Browser() as page:
        page.open(system.address("whole_viewer") + "?theme=dark")
        check(page.wait("dmslam.store.numPoints > 150 && dmslam.store.numKeyframes >= 3", 40),
              f"its map is shown: {page.eval('dmslam.store.numPoints')} landmarks")
        check_end(page)
        page.screenshot(os.path.join(options.pictures, "finished.png"))
        check_together(page)
        errors = page.errors()
        check(not errors, f"no error on the console with a whole log: {errors}")


def check_end(page):
    """Once the sequence is over, nobody is told that the camera is lost, or tracked."""
    pill = "document.getElementById('state').textContent"
    check(page.wait(f"{pill} === 'finished'", 40), f"at its end the run is finished: {page.eval(pill)}")
    page.eval("dmslam.header.onPose({camera: 0, frame: 7, state: 5, word: 'lost'})")
    shown = page.eval(f"{pill} + ' ' + document.getElementById('state').dataset.state")
    check(shown == "finished done", f"however its last frame was tracked: {shown}")


def check_together(page):
    """A pose that is told among maps which the page does not have yet waits for them."""
    pose = "{camera: 0, arrangement: dmslam.store.arrangement + %d, p: [%d, 0, 0], q: [0, 0, 0, 1], word: 'tracking'}"
    at = "(dmslam.scene.poses.get(0) || {p: ['nowhere']}).p[0]"
    page.eval(f"dmslam.placeCamera({pose % (0, 5)})")
    check(page.eval(at) == 5, "a pose among the maps that are drawn is drawn")
    page.eval(f"dmslam.placeCamera({pose % (1, 77)})")
    check(page.eval(at) == 5, "one among maps that are not there yet is not")
    page.eval("dmslam.moveCameras()")
    check(page.eval(at) not in (5, 77), f"with the maps the cameras are where those have them: {page.eval(at)}")


def check_labels(options, address):
    with Browser() as page:
        page.call("Page.addScriptToEvaluateOnNewDocument", source=AMEND)
        page.open(address + "?theme=dark")
        page.wait("document.querySelectorAll('#legend span').length > 18 && dmslam.store.numPoints > 150", 20)
        page.eval("document.getElementById('weld').textContent = 'map 1 of camera 3 and map 1 of camera 4 are joined'")
        for width, height, text in ((1440, 900, "normal"), (1440, 900, "large"), (1280, 720, "normal"), (1000, 700, "normal"),
                                    (760, 900, "normal"), (400, 800, "normal")):
            page.call("Emulation.setDeviceMetricsOverride", width=width, height=height, deviceScaleFactor=1, mobile=False)
            page.eval(f"dmslam.setText('{text}')")
            time.sleep(0.5)
            page.eval("document.getElementById('weld').hidden = false")
            page.screenshot(os.path.join(options.pictures, f"labels_{width}_{text}.png"))
            cut = page.eval(CUT_OFF)
            check(not cut, f"nothing is cut off at {width}x{height}, {text} text: {cut}")
            view = page.eval("document.querySelector('.view').clientHeight")
            check(view >= 150, f"and there is room for the map: {view} px")


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
    for name in ("bin", "logs", "pictures", "sequence", "camera", "whole-log"):
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
        show_whole_log(options, system)
        system.stop()
        show_cameras(options, system)
    finally:
        system.stop()
    for name in ("viewer", "late_viewer", "log_viewer", "whole_viewer", "two_viewer"):
        check(system.processes[name].returncode == 0, f"{name} ends with {system.processes[name].returncode}")
    return 1 if FAILURES else 0


if __name__ == "__main__":
    sys.exit(main())
