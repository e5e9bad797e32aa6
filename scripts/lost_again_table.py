#!/usr/bin/env python3
"""A row for each run of a sequence of rearrange.py: lost_again_table.py SEQUENCE RESULTS [SEQUENCE RESULTS]..."""
import json
import math
import pathlib
import sys

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parent / "lib"))
from trajectories import read  # noqa: E402


def angle_deg(p, q):
    return math.degrees(2 * math.acos(min(1.0, abs(sum(a * b for a, b in zip(p[3:], q[3:]))))))


def is_near(p, q):
    return math.dist(p[:3], q[:3]) <= 0.3 and angle_deg(p, q) <= 20


def waits(lit, truth, online):
    """Seconds from each return of the light, where what is seen then was mapped, to the first frame with a pose."""
    found = []
    for k in range(1, len(lit)):
        (before_us, before), (stamp_us, frame) = lit[k - 1], lit[k]
        if stamp_us - before_us < 100_000 and frame - before in (0, 1):
            continue
        mapped = [truth[s] for s, _ in lit[:k] if s in online and s in truth]
        seen = next((s for s, _ in lit[k:] if s in truth and any(is_near(truth[s], p) for p in mapped)), None)
        if seen is None:
            found.append("new")
            continue
        again = next((s for s, _ in lit[k:] if s in online and s >= stamp_us), None)
        found.append("-" if again is None else f"{max(0, again - seen) * 1e-6:.2f}")
    return " ".join(found) or "none"


def row(sequence, results):
    lit = [(round(float(line.split()[0]) * 1e6), int(line.split()[1]))
           for line in (sequence / "lit.txt").read_text().splitlines() if not line.startswith("#")]
    truth = read(sequence / "groundtruth.txt")
    online, final = read(results / "trajectory_online.txt"), read(results / "trajectory.txt")
    summary = json.loads((results / "summary.json").read_text())
    share = lambda poses: 100 * sum(s in poses for s, _ in lit) / len(lit)
    dark = sum(s not in {t for t, _ in lit} for s in online)
    number = lambda key: f"{summary[key]:.4f}" if summary[key] is not None else "-"
    apart = " ".join(str(m["frames"]) for m in summary["other_maps"]) or "none"
    return (f"| {sequence.name} | {share(online):.1f} | {share(final):.1f} | {number('ate_rmse_final')} | "
            f"{number('ate_rmse_online')} | {waits(lit, truth, online)} | {apart} | {summary['resets']} | "
            f"{summary['relocalisations']} | {summary['loops']} | {dark} |")


def main():
    if sys.argv[1:2] in (["-h"], ["--help"]):
        print(__doc__.strip())
        return
    print("| run | lit frames online [%] | in the end [%] | ATE [m] | ATE online [m] | found after [s] | "
          "frames of maps apart | maps given up | relocalisations | loops and welds | dark frames with a pose |")
    print("|---|---|---|---|---|---|---|---|---|---|---|")
    for sequence, results in zip(sys.argv[1::2], sys.argv[2::2]):
        if (pathlib.Path(results) / "summary.json").exists():
            print(row(pathlib.Path(sequence), pathlib.Path(results)))


if __name__ == "__main__":
    main()
