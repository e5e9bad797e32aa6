#!/usr/bin/env python3
"""Rows of lost.sh's table: lost_table.py SEQUENCE RESULTS-PREFIX FIRST STEP."""
import math
import pathlib
import statistics
import sys

PLACES, DARK, WITHIN, AFTER = 10, 30, 10, 30  # DARK: frames of a second; AFTER: frames whose error is looked at


def read(file):
    """Lines of numbers of a trajectory, by stamp in microseconds."""
    rows = {}
    for line in file.read_text().splitlines():
        if line and not line.startswith("#"):
            fields = line.split()
            rows[round(float(fields[0]) * 1e6)] = [float(x) for x in fields[1:8]]
    return rows


def angle_deg(p, q):
    return math.degrees(2 * math.acos(min(1.0, abs(sum(a * b for a, b in zip(p[3:], q[3:]))))))


def is_near(p, q):
    return math.dist(p[:3], q[:3]) <= 0.3 and angle_deg(p, q) <= 20


def matmul(a, b):
    return [[sum(x * y for x, y in zip(row, column)) for column in zip(*b)] for row in a]


def transpose(a):
    return [list(row) for row in zip(*a)]


def polar(a):
    """The rotation nearest to a 3x3 matrix, by Higham's iteration."""
    for _ in range(100):
        (p, q, r), (s, t, u), (v, w, x) = a
        cofactors = [[t * x - u * w, u * v - s * x, s * w - t * v],
                     [r * w - q * x, p * x - r * v, q * v - p * w],
                     [q * u - r * t, r * s - p * u, p * t - q * s]]
        determinant = p * cofactors[0][0] + q * cofactors[0][1] + r * cofactors[0][2]
        a = [[(m + c / determinant) / 2 for m, c in zip(row, other)] for row, other in zip(a, cofactors)]
    return a


def errors(truth, estimate):
    """Distance of every estimated centre from the true one, after one similarity for all (Umeyama)."""
    stamps = [s for s in estimate if s in truth]
    a = [estimate[s][:3] for s in stamps]
    b = [truth[s][:3] for s in stamps]
    mean = lambda points: [statistics.fmean(c) for c in zip(*points)]
    ma, mb = mean(a), mean(b)
    da = [[x - m for x, m in zip(p, ma)] for p in a]
    db = [[x - m for x, m in zip(p, mb)] for p in b]
    covariance = matmul(transpose(db), da)
    rotation = polar(covariance)
    scale = sum(rotation[i][j] * covariance[i][j] for i in range(3) for j in range(3)) / sum(x * x for p in da for x in p)
    result = {}
    for s, p, q in zip(stamps, da, db):
        turned = [sum(r * x for r, x in zip(row, p)) for row in rotation]
        result[s] = math.dist([scale * x for x in turned], q)
    return result


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
    return (f"| {name} | {ok} of {counted} | {shown} | {rms(after):.4f} | {rms(otherwise):.4f} | {plain_error:.4f} |")


def main():
    sequence, prefix, first, step = pathlib.Path(sys.argv[1]), sys.argv[2], int(sys.argv[3]), int(sys.argv[4])
    frames = [round(float(l.split()[0]) * 1e6) for l in (sequence / "rgb.txt").read_text().splitlines()
              if l and not l.startswith("#")]
    truth = read(sequence / "groundtruth.txt")
    plain = errors(truth, read(pathlib.Path(prefix + "_plain") / "trajectory.txt"))
    plain_error = math.sqrt(statistics.fmean(e * e for e in plain.values()))
    for kind in ("black-out", "jump"):
        folder = pathlib.Path(f"{prefix}_{kind}")
        if (folder / "trajectory_online.txt").exists():
            print(row(f"{sequence.name}, {kind}", frames, truth, folder, plain_error, first, step))


if __name__ == "__main__":
    main()
