"""Runs a sequence with scripts/run.sh --viewer, and takes a picture of the page when three quarters of it are through."""

import argparse
import os
import re
import subprocess
import sys
import time

sys.path.insert(0, os.path.dirname(os.path.abspath(__file__)))
from browser import Browser  # noqa: E402


def address_of(log, run):
    while run.poll() is None:
        said = open(log, encoding="utf-8").read()
        found = re.search(r"watch it (?:live )?at (http://\S+)", said)
        if found:
            return found.group(1)
        time.sleep(0.1)
    sys.exit("the run ended before the viewer was there: " + open(log, encoding="utf-8").read())


def main():
    parser = argparse.ArgumentParser()
    for name in ("top", "sequence", "work", "out"):
        parser.add_argument("--" + name, required=True)
    parser.add_argument("--theme", default="dark")
    parser.add_argument("--build-dir", default="", help="where the programs are; default: built where needed")
    options = parser.parse_args()
    with open(os.path.join(options.sequence, "rgb.txt"), encoding="utf-8") as listed:
        frames = sum(1 for line in listed if line.strip() and not line.startswith("#"))
    log = os.path.join(options.work, "run.log")
    camera = os.path.join(options.top, "config/synthetic.yaml")
    build = ["--build-dir", options.build_dir] if options.build_dir else []
    with open(log, "w", encoding="utf-8") as said:
        run = subprocess.Popen(
            [os.path.join(options.top, "scripts/run.sh"), "--sequence", options.sequence, "--camera", camera, "--lockstep",
             "--http", "127.0.0.1:0", *build, "--out", os.path.join(options.work, "out")], stdin=subprocess.DEVNULL, stdout=said, stderr=said)
        address = address_of(log, run)
    with Browser(width=1440, height=900) as page:
        page.open(address + "?theme=" + options.theme)
        page.wait(f"parseInt(document.getElementById('count-frame').textContent) >= {3 * frames // 4}", 600)
        page.wait("!dmslam.scene.needsPicture", 2)
        page.screenshot(options.out)
        errors = page.errors()
    run.wait()
    if errors:
        sys.exit(f"the page said: {errors}")
    print(options.out)


if __name__ == "__main__":
    main()
