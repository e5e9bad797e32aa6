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


def similarity(truth, estimate):
    """Scale, rotation and both means of the similarity that lays the estimate's centres onto the true ones (Umeyama)."""
    stamps = [s for s in estimate if s in truth]
    a = [estimate[s][:3] for s in stamps]
    b = [truth[s][:3] for s in stamps]
    mean_a, mean_b = _mean(a), _mean(b)
    da = [[x - m for x, m in zip(p, mean_a)] for p in a]
    db = [[x - m for x, m in zip(p, mean_b)] for p in b]
    covariance = _matmul(_transpose(db), da)
    rotation = _polar(covariance)
    traced = sum(rotation[i][j] * covariance[i][j] for i in range(3) for j in range(3))
    return traced / sum(x * x for p in da for x in p), rotation, mean_a, mean_b


def laid_onto(truth, estimate):
    """Centres of the estimate by stamp, laid onto the truth by one similarity for all."""
    scale, rotation, mean_a, mean_b = similarity(truth, estimate)
    result = {}
    for s, pose in estimate.items():
        if s not in truth:
            continue
        turned = [sum(r * (x - m) for r, x, m in zip(row, pose, mean_a)) for row in rotation]
        result[s] = [scale * x + m for x, m in zip(turned, mean_b)]
    return result


def rotation_of(pose):
    """The rotation matrix of x y z qx qy qz qw."""
    x, y, z, w = pose[3:7]
    return [[1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
            [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
            [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)]]


def relative(a, b):
    """Pose b seen from pose a: its position, and its rotation as a matrix."""
    inverse = _transpose(rotation_of(a))
    offset = [q - p for p, q in zip(a[:3], b[:3])]
    return [sum(r * x for r, x in zip(row, offset)) for row in inverse], _matmul(inverse, rotation_of(b))


def angle_between(a, b):
    """Of two rotation matrices [degrees]."""
    trace = sum(a[i][j] * b[i][j] for i in range(3) for j in range(3))
    return math.degrees(math.acos(max(-1.0, min(1.0, (trace - 1) / 2))))


def errors(truth, estimate):
    """Distance of every estimated centre from the true one, after that."""
    return {s: math.dist(p, truth[s][:3]) for s, p in laid_onto(truth, estimate).items()}
