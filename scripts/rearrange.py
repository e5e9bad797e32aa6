#!/usr/bin/env python3
"""Plays a sequence in another order: rearrange.py SEQUENCE OUT PIECE...

Writes OUT, a TUM RGB-D folder with frames of SEQUENCE, restamped evenly from the first stamp on. A PIECE is
  A-B      frames A to B; backwards where B is the smaller one
  A*S      frame A for S seconds: a camera that stands still
  dark*S   S seconds of darkness, in which the camera stays where the frame before was taken
  A-B/dark the same as A-B, in darkness
  gap*S    S seconds without any frame, as while a camera is carried from one place to another
Images are linked, not copied. OUT/lit.txt has a line "stamp frame" for each frame that is not dark.
"""
import pathlib
import statistics
import struct
import sys
import zlib


def rows(file):
    return [line.split() for line in file.read_text().splitlines() if line and not line.startswith("#")]


def size_of(image):
    """Width and height of a PNG or JPEG file."""
    data = image.read_bytes()
    if data[:4] == b"\x89PNG":
        return struct.unpack(">II", data[16:24])
    at = 2
    while data[at + 1] not in range(0xC0, 0xC4):
        at += 2 + struct.unpack(">H", data[at + 2:at + 4])[0]
    height, width = struct.unpack(">HH", data[at + 5:at + 9])
    return width, height


def write_black(file, width, height):
    def chunk(kind, data):
        return struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))
    pixels = zlib.compress((b"\0" + bytes(width)) * height)
    file.write_bytes(b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", struct.pack(">IIBBBBB", width, height, 8, 0, 0, 0, 0)) +
                     chunk(b"IDAT", pixels) + chunk(b"IEND", b""))


def order_of(pieces, period_s, count):
    """Triples (frame, dark, periods of time since the first one)."""
    order, now = [], 0
    for piece in pieces:
        what, _, dark = piece.partition("/")
        kind, _, seconds = what.partition("*")
        if seconds:
            number = round(float(seconds) / period_s)
            frame = order[-1][0] if kind == "dark" else None if kind == "gap" else int(kind)
            added = [(frame, kind == "dark")] * number
        else:
            first, last = (int(x) for x in what.split("-"))
            if not (0 <= first < count and 0 <= last < count):
                raise SystemExit(f"rearrange.py: {piece}: the sequence has frames 0 to {count - 1}")
            step = 1 if first <= last else -1
            added = [(frame, dark == "dark") for frame in range(first, last + step, step)]
        order += [(frame, is_dark, now + i) for i, (frame, is_dark) in enumerate(added) if frame is not None]
        now += len(added)
    return order


def main():
    if sys.argv[1:2] in (["-h"], ["--help"]):
        print(__doc__)
        return
    if len(sys.argv) < 4:
        raise SystemExit(__doc__)
    source, out = pathlib.Path(sys.argv[1]).resolve(), pathlib.Path(sys.argv[2])
    frames = rows(source / "rgb.txt")
    stamps = [float(row[0]) for row in frames]
    period_s = statistics.median(b - a for a, b in zip(stamps, stamps[1:]))
    truth = rows(source / "groundtruth.txt")
    truth_stamps = [float(row[0]) for row in truth]
    out.mkdir(parents=True, exist_ok=True)
    (out / "rgb").unlink(missing_ok=True)
    (out / "rgb").symlink_to(source / "rgb")
    write_black(out / "dark.png", *size_of(source / frames[0][1]))
    images, poses, lit = [], [], []
    nearest = 0
    for frame, dark, i in order_of(sys.argv[3:], period_s, len(frames)):
        stamp = f"{stamps[0] + i * period_s:.6f}"
        images.append(f"{stamp} {'dark.png' if dark else frames[frame][1]}")
        nearest = min(range(len(truth)), key=lambda k: abs(truth_stamps[k] - stamps[frame]))
        if abs(truth_stamps[nearest] - stamps[frame]) < 0.01:
            poses.append(" ".join([stamp] + truth[nearest][1:8]))
        if not dark:
            lit.append(f"{stamp} {frame}")
    (out / "rgb.txt").write_text("# timestamp filename\n" + "\n".join(images) + "\n")
    (out / "groundtruth.txt").write_text("# timestamp tx ty tz qx qy qz qw\n" + "\n".join(poses) + "\n")
    (out / "lit.txt").write_text("# timestamp frame\n" + "\n".join(lit) + "\n")


if __name__ == "__main__":
    main()
