#!/usr/bin/env python3
"""Table of scripts/soak.sh: soak_table.py DIR. Ends with 1 where something grows."""
import csv
import json
import math
import pathlib
import statistics
import sys

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parent / "lib"))
from trajectories import errors, read  # noqa: E402

PROCESSES = ("player", "frontend", "mapper", "loopcloser", "collector")
MB_PER_HOUR, CHANCE_MB = 5.0, 2.0  # allowed, and by how much two means of the same memory may differ
TIMES_LATER = 1.2                  # allowed, of the median from image to pose


def quarter_of(time, begin, end):
    return min(3, int(4 * (time - begin) / (end - begin)))


def memory_rows(path):
    """A row for each process, and whether one grows. Samples without all of them are left out."""
    with open(path) as file:
        samples = [{k: float(v) for k, v in row.items()} for row in csv.DictReader(file)]
    samples = [s for s in samples if all(s[p] > 0 for p in PROCESSES)]
    if len(samples) < 8:
        sys.exit("soak.sh: too short")
    hours = [s["seconds"] / 3600 for s in samples]
    quarters = [quarter_of(h, hours[0], hours[-1]) for h in hours]
    allowed = MB_PER_HOUR * (hours[-1] - hours[0]) / 4 + CHANCE_MB
    rows, grows = [], False
    for process in PROCESSES:
        mb = [s[process] / 1024 for s in samples]
        third, last = (statistics.fmean(m for m, q in zip(mb, quarters) if q == i) for i in (2, 3))
        half = [(h, m) for h, m, q in zip(hours, mb, quarters) if q >= 2]
        slope = statistics.linear_regression(*zip(*half)).slope
        bad = last - third > allowed
        grows |= bad
        rows.append(f"| {process} | {third:.1f} | {last:.1f} | {slope:.1f} | {'grows' if bad else 'flat'} |")
    return rows, grows


def quarter_rows(folder):
    """A row for each quarter: times, poses, errors; and whether frames take longer at the end."""
    times = json.loads((folder / "run/summary.json").read_text())["image_to_pose_ms_by_quarter"]
    online = read(folder / "run/trajectory_online.txt")
    truth_file = folder / "sequence/groundtruth.txt"
    truth = read(truth_file) if truth_file.exists() else {}
    begin, end = min(online), max(online)
    rows = []
    for i, of_quarter in enumerate(times):
        poses = {s: p for s, p in online.items() if quarter_of(s, begin, end) == i}
        error = errors(truth, poses) if truth and poses else {}
        rmse = f"{math.sqrt(statistics.fmean(e * e for e in error.values())):.4f}" if error else "–"
        rows.append(f"| {i + 1} | {of_quarter['p50']:.1f} | {of_quarter['p99']:.1f} | {len(poses)} | {rmse} |")
    return rows, times[3]["p50"] > TIMES_LATER * times[2]["p50"]


def main():
    if sys.argv[1:2] in (["-h"], ["--help"]):
        print(__doc__.strip())
        return
    folder = pathlib.Path(sys.argv[1])
    memory, grows = memory_rows(folder / "memory.csv")
    quarters, later = quarter_rows(folder)
    print("| process | third quarter [MB] | last quarter [MB] | slope of the last half [MB/h] | verdict |")
    print("|---|---|---|---|---|", *memory, sep="\n")
    print("\n| quarter | image to pose, p50 [ms] | p99 [ms] | poses online | ATE online |")
    print("|---|---|---|---|---|", *quarters, sep="\n")
    sys.exit(1 if grows or later else 0)


main()
