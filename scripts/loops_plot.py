#!/usr/bin/env python3
"""Draws runs of loops.sh with and without loop closing: loops_plot.py SEQUENCES RESULTS PICTURE.svg NAME...

One row per sequence: the path from above (truth, without, with), and the error of every frame over time.
"""
import pathlib
import sys

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parent / "lib"))
from trajectories import errors, laid_onto, read  # noqa: E402

PLAN, CHART, HEIGHT, MARGIN = 300, 460, 300, 46
EVERY = 3  # of the frames, that a curve shows
TRUTH, WITHOUT, WITH = "#999999", "#d95f02", "#1b6fb5"


def text(x, y, words, anchor="middle", colour="#222222", size=12):
    return (f'<text x="{x:.1f}" y="{y:.1f}" text-anchor="{anchor}" font-size="{size}" fill="{colour}">'
            f"{words}</text>")


def polyline(points, colour, width):
    listed = " ".join(f"{x:.1f},{y:.1f}" for x, y in points)
    return f'<polyline points="{listed}" fill="none" stroke="{colour}" stroke-width="{width}"/>'


def frame(left, top, width, height):
    return f'<rect x="{left}" y="{top}" width="{width}" height="{height}" fill="none" stroke="#cccccc"/>'


def plan(left, top, truth, runs):
    """The path along the two axes in which the truth extends most."""
    spans = [max(c) - min(c) for c in zip(*(p[:3] for p in truth.values()))]
    u, v = sorted(sorted(range(3), key=lambda i: -spans[i])[:2])
    us, vs = [p[u] for p in truth.values()], [p[v] for p in truth.values()]
    scale = min((PLAN - 30) / (max(us) - min(us)), (HEIGHT - 30) / (max(vs) - min(vs)))
    at_u, at_v = (max(us) + min(us)) / 2, (max(vs) + min(vs)) / 2

    def place(p):
        return left + PLAN / 2 + scale * (p[u] - at_u), top + HEIGHT / 2 - scale * (p[v] - at_v)

    parts = [frame(left, top, PLAN, HEIGHT), polyline([place(p) for p in list(truth.values())[::EVERY]], TRUTH, 3)]
    for colour, estimate in runs:
        laid = laid_onto(truth, estimate)
        parts.append(polyline([place(laid[s]) for s in sorted(laid)[::EVERY]], colour, 1.2))
    metre = scale * max(1, round(PLAN / scale / 8))
    parts.append(polyline([(left + 10, top + HEIGHT - 10), (left + 10 + metre, top + HEIGHT - 10)], "#222222", 2))
    parts.append(text(left + 14 + metre, top + HEIGHT - 6, f"{metre / scale:.0f} m", "start"))
    return parts


def chart(left, top, truth, runs):
    found = [(colour, errors(truth, estimate)) for colour, estimate in runs]
    most = 1.05 * max(max(e.values()) for _, e in found)
    begin, end = min(truth), max(truth)
    parts = [frame(left, top, CHART, HEIGHT)]
    for i in range(5):
        y = top + HEIGHT - HEIGHT * i / 4
        parts.append(polyline([(left, y), (left + CHART, y)], "#eeeeee", 1))
        parts.append(text(left - 5, y + 4, f"{100 * most * i / 4:.{2 if most < 0.02 else 1}f}", "end"))
        parts.append(text(left + CHART * i / 4, top + HEIGHT + 16, f"{(end - begin) * 1e-6 * i / 4:.0f} s"))
    for colour, error in found:
        points = [(left + CHART * (s - begin) / (end - begin), top + HEIGHT * (1 - error[s] / most))
                  for s in sorted(error)[::EVERY]]
        parts.append(polyline(points, colour, 1.2))
    return parts


def main():
    if sys.argv[1:2] in (["-h"], ["--help"]):
        print(__doc__.strip())
        return
    sequences, results, picture = (pathlib.Path(a) for a in sys.argv[1:4])
    names, parts = sys.argv[4:], []
    for row, name in enumerate(names):
        top = MARGIN + row * (HEIGHT + MARGIN + 14)
        truth = read(sequences / name / "groundtruth.txt")
        runs = [(colour, read(results / name / variant / "trajectory.txt"))
                for colour, variant in ((WITHOUT, "no-loop"), (WITH, "loop"))]
        left = PLAN + 3 * MARGIN // 2 + 20
        parts += plan(MARGIN // 2, top, truth, runs) + chart(left, top, truth, runs)
        parts.append(text(MARGIN // 2, top - 10, name, "start", size=14))
        parts.append(text(left, top - 10, "error [cm]", "start"))
        for i, (colour, words) in enumerate(((TRUTH, "truth"), (WITHOUT, "without loops"), (WITH, "with"))):
            parts.append(text(left + CHART - 230 + 80 * i + 30 * (i > 1), top - 10, words, "start", colour))
    width = PLAN + CHART + 3 * MARGIN
    height = MARGIN + len(names) * (HEIGHT + MARGIN + 14)
    picture.write_text(
        f'<svg xmlns="http://www.w3.org/2000/svg" width="{width}" height="{height}" '
        f'font-family="sans-serif"><rect width="100%" height="100%" fill="white"/>' + "\n".join(parts) + "</svg>\n")


if __name__ == "__main__":
    main()
