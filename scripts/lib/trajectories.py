"""Trajectories in TUM format, and the similarity that lays one onto another."""
import math
import statistics


def read(file):
    """Lines of numbers of a trajectory (x y z qx qy qz qw), by stamp in microseconds."""
    rows = {}
    for line in file.read_text().splitlines():
        if line and not line.startswith("#"):
            fields = line.split()
            rows[round(float(fields[0]) * 1e6)] = [float(x) for x in fields[1:8]]
    return rows


def frame_stamps(sequence):
    """Stamps of a sequence's frames in microseconds, in their order."""
    return [round(float(line.split()[0]) * 1e6) for line in (sequence / "rgb.txt").read_text().splitlines()
            if line and not line.startswith("#")]


def _matmul(a, b):
    return [[sum(x * y for x, y in zip(row, column)) for column in zip(*b)] for row in a]


def _transpose(a):
    return [list(row) for row in zip(*a)]


def _polar(a):
    """The rotation nearest to a 3x3 matrix, by Higham's iteration."""
    for _ in range(100):
        (p, q, r), (s, t, u), (v, w, x) = a
        cofactors = [[t * x - u * w, u * v - s * x, s * w - t * v],
                     [r * w - q * x, p * x - r * v, q * v - p * w],
                     [q * u - r * t, r * s - p * u, p * t - q * s]]
        determinant = p * cofactors[0][0] + q * cofactors[0][1] + r * cofactors[0][2]
        a = [[(m + c / determinant) / 2 for m, c in zip(row, other)] for row, other in zip(a, cofactors)]
    return a


def _mean(points):
    return [statistics.fmean(c) for c in zip(*points)]


def laid_onto(truth, estimate):
    """Centres of the estimate by stamp, laid onto the truth by one similarity for all (Umeyama)."""
    stamps = [s for s in estimate if s in truth]
    a = [estimate[s][:3] for s in stamps]
    b = [truth[s][:3] for s in stamps]
    mean_a, mean_b = _mean(a), _mean(b)
    da = [[x - m for x, m in zip(p, mean_a)] for p in a]
    db = [[x - m for x, m in zip(p, mean_b)] for p in b]
    covariance = _matmul(_transpose(db), da)
    rotation = _polar(covariance)
    traced = sum(rotation[i][j] * covariance[i][j] for i in range(3) for j in range(3))
    scale = traced / sum(x * x for p in da for x in p)
    result = {}
    for s, p in zip(stamps, da):
        turned = [sum(r * x for r, x in zip(row, p)) for row in rotation]
        result[s] = [scale * x + m for x, m in zip(turned, mean_b)]
    return result


def errors(truth, estimate):
    """Distance of every estimated centre from the true one, after that."""
    return {s: math.dist(p, truth[s][:3]) for s, p in laid_onto(truth, estimate).items()}
