#!/usr/bin/env python3
"""Rows of lost.sh's table: lost_table.py SEQUENCE RESULTS-PREFIX FIRST STEP."""
import math
import pathlib
import statistics
import sys

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parent / "lib"))
from trajectories import errors, frame_stamps, read  # noqa: E402

PLACES, DARK, WITHIN, AFTER = 10, 30, 10, 30  # DARK: frames of a second; AFTER: frames whose error is looked at


def angle_deg(p, q):
    return math.degrees(2 * math.acos(min(1.0, abs(sum(a * b for a, b in zip(p[3:], q[3:]))))))


def is_near(p, q):
    return math.dist(p[:3], q[:3]) <= 0.3 and angle_deg(p, q) <= 20


def row(name, frames, truth, folder, plain_error, first, step):
    online = read(folder / "trajectory_online.txt")
    error = errors(truth, read(folder / "trajectory.txt"))
    waits, after, counted = [], [], 0
    for k in range(PLACES):
        begin = first + k * step
        back = begin + DARK + (1 if "jump" in name else 0)
        before = [truth[s] for s in frames[:begin] if s in online and s in truth]
        mapped = next((i for i in range(back, min(back + 60, len(frames)))
                       if frames[i] in truth and any(is_near(truth[frames[i]], p) for p in before)), None)
        if mapped is None:
            continue
        counted += 1
        found = next((i for i in range(back, len(frames)) if frames[i] in online), None)
        waits.append(max(0, found - mapped) if found is not None else None)
        after += [error[s] for s in frames[back:back + AFTER] if s in error and s in online]
    dark = {s for k in range(PLACES) for s in frames[first + k * step:first + k * step + DARK + AFTER]}
    otherwise = [e for s, e in error.items() if s not in dark]
    rms = lambda v: math.sqrt(statistics.fmean(x * x for x in v)) if v else float("nan")
    ok = sum(w is not None and w <= WITHIN for w in waits)
    shown = " ".join("-" if w is None else str(w) for w in waits)
    missed = " missed" if ok < 0.9 * counted else ""
    return (f"| {name} | {ok} of {counted}{missed} | {shown} | {rms(after):.4f} | {rms(otherwise):.4f} | "
            f"{plain_error:.4f} |")


def main():
    if sys.argv[1:2] in (["-h"], ["--help"]):
        print(__doc__.strip())
        return
    sequence, prefix, first, step = pathlib.Path(sys.argv[1]), sys.argv[2], int(sys.argv[3]), int(sys.argv[4])
    frames = frame_stamps(sequence)
    truth = read(sequence / "groundtruth.txt")
    plain = errors(truth, read(pathlib.Path(prefix + "_plain") / "trajectory.txt"))
    plain_error = math.sqrt(statistics.fmean(e * e for e in plain.values()))
    for kind in ("black-out", "jump"):
        folder = pathlib.Path(f"{prefix}_{kind}")
        if (folder / "trajectory_online.txt").exists():
            print(row(f"{sequence.name}, {kind}", frames, truth, folder, plain_error, first, step))


if __name__ == "__main__":
    main()
