#!/usr/bin/env python3
"""Table of what loops.sh ran: loops_table.py SEQUENCES RESULTS."""
import json
import math
import pathlib
import re
import sys


def path_length(file):
    """Length of a trajectory in TUM format [m]."""
    points = [
        [float(x) for x in line.split()[1:4]]
        for line in file.read_text().splitlines()
        if line and not line.startswith("#")
    ]
    return sum(math.dist(a, b) for a, b in zip(points, points[1:]))


def edges(file):
    """Lines of graph.txt: frame, frame, shared landmarks, whether a loop was closed between them."""
    for line in file.read_text().splitlines():
        if not line.startswith("#"):
            fields = line.split()
            yield int(fields[0]), int(fields[1]), int(fields[2]), len(fields) > 3


def revisit_is_found(revisit, graph, reach=120):
    """Whether keyframes around a revisit (up to `reach` frames after it) hang together with those around the earlier
    view: by a loop, or because they see 15 landmarks or more in common."""
    for a, b, shared, loop in graph:
        early, late = min(a, b), max(a, b)
        near = abs(early - revisit["earlier_frame"]) <= reach and 0 <= late - revisit["frame"] + reach / 2 <= 1.5 * reach
        if near and (loop or shared >= 15):
            return True
    return False


def was_mapped(revisit, graph, reach=120):
    """Whether the map had begun when the earlier view was taken: else nobody can find it again."""
    return any(abs(frame - revisit["earlier_frame"]) <= reach for a, b, _, _ in graph for frame in (a, b))


def poses(file):
    """Camera centres of a trajectory by stamp."""
    return {
        fields[0]: [float(x) for x in fields[1:4]]
        for fields in (line.split() for line in file.read_text().splitlines())
        if fields and not fields[0].startswith("#")
    }


def false_loops(summary, centres, stamps):
    """Loops between frames that are more than 3 m apart by ground truth."""
    wrong = 0
    for correction in summary["loop_closing"]["corrections"]:
        frames = re.findall(r"frame (\d+)", correction["note"])
        if correction["kind"] != "loop" or len(frames) < 2:
            continue
        here, there = (centres.get(stamps[int(f)]) for f in frames[:2])
        if here and there and math.dist(here, there) > 3.0:
            wrong += 1
    return wrong


def row(name, sequence, results):
    runs = {}
    for variant in ("loop", "no-loop"):
        file = results / name / variant / "summary.json"
        if file.exists():
            runs[variant] = json.loads(file.read_text())
    if "loop" not in runs:
        return None
    if any(run["ate_rmse_final"] is None for run in runs.values()):
        return f"| {name} | - | not tracked | | | | | |"
    truth = sequence / "groundtruth.txt"
    length = path_length(truth)
    stamps = [l.split()[0] for l in (sequence / "rgb.txt").read_text().splitlines() if l and l[0] != "#"]
    graph = list(edges(results / name / "loop" / "graph.txt"))
    stated = json.loads((sequence / "loops.json").read_text())["revisits"]
    revisits = [r for r in stated if was_mapped(r, graph)]
    found = sum(revisit_is_found(r, graph) for r in revisits)
    after = runs["loop"]["ate_rmse_final"]
    before = runs["no-loop"]["ate_rmse_final"] if "no-loop" in runs else None
    bar = max((before or 0) / 5, 0.003 * length)
    wrong = false_loops(runs["loop"], poses(truth), stamps)
    run, shown = runs["loop"], "not run" if before is None else f"{before:.4f}"
    unseen = " missed" if found < len(revisits) else ""
    if len(revisits) < len(stated):
        unseen += f" ({len(stated) - len(revisits)} of a place before the map)"
    return (
        f"| {name} | {length:.1f} | {run['tracked_percent']:.1f} | {found} of {len(revisits)}{unseen} | "
        f"{run['loops']} / {wrong} | {shown} | {after:.4f} | {bar:.4f}{'' if after <= bar else ' missed'} |"
    )


def main():
    if sys.argv[1:2] in (["-h"], ["--help"]):
        print(__doc__.strip())
        return
    sequences, results = pathlib.Path(sys.argv[1]), pathlib.Path(sys.argv[2])
    print("| sequence | path [m] | tracked [%] | revisits found | loops / false | ATE --no-loop [m] | ATE [m] | asked [m] |")
    print("|---|---|---|---|---|---|---|---|")
    for folder in sorted(results.iterdir()):
        if (folder / "loop").is_dir():
            text = row(folder.name, sequences / folder.name, results)
            if text:
                print(text)


if __name__ == "__main__":
    main()
