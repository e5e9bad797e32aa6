"""How the viewer bears a large map: 5,000 keyframes and 300,000 landmarks, drawn in software while the view turns, beside
browsers that do not read. Prints what was measured; fails below 20 pictures a second, or where the replica falls behind."""

import argparse
import os
import subprocess
import sys
import tempfile
import time

sys.path.insert(0, os.path.dirname(os.path.abspath(__file__)))
from browser import Browser  # noqa: E402
from viewer_test import stall  # noqa: E402


def cpu_seconds(pid):
    fields = open(f"/proc/{pid}/stat", encoding="ascii").read().rsplit(")", 1)[1].split()
    return (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")


def start(program, log, *arguments):
    return subprocess.Popen([program, *arguments], stdin=subprocess.DEVNULL, stdout=log, stderr=log)


def address_of(path):
    for _ in range(200):
        for word in open(path, encoding="utf-8").read().split():
            if word.startswith("http://"):
                return word
        time.sleep(0.05)
    sys.exit("the viewer says no address: " + open(path, encoding="utf-8").read())


def measure(page, options):
    """Pictures per second while the view turns, once it has settled how much it draws."""
    page.eval("dmslam.scene.turning = true")
    time.sleep(options.settle)
    used = page.cpu_seconds()
    page.eval("dmslam.scene.pictures.count = 0; window.begun = performance.now()")
    time.sleep(options.seconds)
    result = page.eval("({pictures: dmslam.scene.pictures.count, landmarks: dmslam.scene.pictures.drawnPoints,"
                       " fps: 1000 * dmslam.scene.pictures.count / (performance.now() - begun),"
                       " sharpness: dmslam.scene.drawnSharpness})")
    result["cpu_ms"] = 1000 * (page.cpu_seconds() - used) / max(1, result["pictures"])
    return result


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("--bin", required=True)
    parser.add_argument("--port", default="27441")
    parser.add_argument("--keyframes", type=int, default=5000)
    parser.add_argument("--landmarks", type=int, default=300000)
    parser.add_argument("--settle", type=float, default=8)
    parser.add_argument("--seconds", type=float, default=10)
    parser.add_argument("--picture", default="")
    options = parser.parse_args()
    url = f"udpm://239.255.76.67:{options.port}?ttl=0&recv_buf_size=4194304"
    problems = []
    with tempfile.TemporaryDirectory() as work:
        log_path = os.path.join(work, "viewer.log")
        with open(log_path, "w", encoding="utf-8") as log:
            viewer = start(os.path.join(options.bin, "dmslam-viewer"), log, "--lcm-url", url, "--http", "127.0.0.1:0")
            address = address_of(log_path)
            stalled = [stall(address) for _ in range(5)]
            tour = start(os.path.join(options.bin, "dmslam-map-tour"), subprocess.DEVNULL, "--lcm-url", url, "--fresh-system",
                         "--rate", "1000", "--keyframes", str(options.keyframes), "--landmarks", str(options.landmarks))
        try:
            with Browser() as page:
                page.open(address)
                begun = time.monotonic()
                if not page.wait(f"dmslam.store.numPoints === {options.landmarks} && dmslam.store.numKeyframes === {options.keyframes}", 180):
                    problems.append("the map did not arrive whole: " + str(page.eval("dmslam.store.numPoints")))
                print(f"the whole map was in the page after {time.monotonic() - begun:.1f} s; viewer: {cpu_seconds(viewer.pid):.1f} s of CPU")
                for view in ("orbit", "follow"):
                    page.eval(f"dmslam.setMode('{view}')")
                    result = measure(page, options)
                    print(f"{view}: {result['fps']:.1f} pictures a second with {result['landmarks']} landmarks each, at"
                          f" {100 * result['sharpness']:.0f} % of the resolution; {result['cpu_ms']:.0f} ms of CPU a picture")
                    if result["fps"] < 20:
                        problems.append(f"{view}: {result['fps']:.1f} pictures a second, wanted 20")
                if options.picture:
                    page.screenshot(options.picture)
                problems += page.errors()
        finally:
            for sockets in stalled:
                for s in sockets:
                    s.close()
            for process in (tour, viewer):
                process.terminate()
                process.wait(timeout=10)
    for problem in problems:
        print("FAILED:", problem)
    return 1 if problems else 0


if __name__ == "__main__":
    sys.exit(main())
