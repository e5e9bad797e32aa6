#!/usr/bin/env python3
"""Table of what welds.sh ran: welds_table.py SEQUENCES RESULTS. Ends with 1 where a run is not good."""
import json
import math
import pathlib
import re
import statistics
import sys

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parent / "lib"))
from trajectories import angle_between, errors, frame_stamps, read, relative, rotation_of, similarity  # noqa: E402

FALSE_M = 0.5    # a weld's two views lie otherwise to one another by more than this, or
FALSE_DEG = 10   # are turned otherwise by more than this: it joins what is apart
TORN_M = 0.5     # no camera, in a map that is one, is farther from where it should be
ASKED = 0.003    # error of each camera, in the similarity of all, of the path of all
WORST = 10       # times that is the most that a single pose may be off
CARRIED = re.compile(r"scales by ([\d.]+); map (\d+) becomes part of map (\d+)")


def path_length(truth):
    points = [truth[s][:3] for s in sorted(truth)]
    return sum(math.dist(a, b) for a, b in zip(points, points[1:]))


class Run:
    def __init__(self, sequences, results):
        self.name = results.name
        self.summary = json.loads((results / "summary.json").read_text())
        cameras = range(len(self.summary["cameras"]))
        folders = [sequences / f"{self.name}_{k}" for k in cameras]
        self.truth = [read(folder / "groundtruth.txt") for folder in folders]
        self.stamps = [frame_stamps(folder) for folder in folders]
        suffix = [f"_{k}" if k else "" for k in cameras]
        self.final = [read(results / f"trajectory{s}.txt") for s in suffix]

    def joined(self):
        """How many cameras have most of their poses in the map of the results."""
        return sum(len(poses) >= 0.5 * len(stamps) for poses, stamps in zip(self.final, self.stamps))

    def together(self, of):
        """Trajectories of all cameras as one."""
        return {(k, s): pose for k, poses in enumerate(of) for s, pose in poses.items()}

    def joint_errors(self):
        """Of all poses of each camera, laid onto the truth by one similarity for all cameras."""
        found = [[] for _ in self.final]
        if any(self.final):
            for (k, _), error in errors(self.together(self.truth), self.together(self.final)).items():
                found[k].append(error)
        return found

    def welds(self):
        """Loops and welds, and of them those that put together what is apart."""
        loops = self.welds_and_loops()
        return loops, [c for c in loops if self.is_false(c)]

    def welds_and_loops(self):
        return [c for c in self.summary["loop_closing"]["corrections"] if c["kind"] == "loop"]

    def growth_since(self, weld):
        """How many units of the whole are one of the map to which it joined another: that one was carried into others since."""
        loops = self.welds_and_loops()
        grown, within = 1.0, CARRIED.search(weld.get("note", ""))
        for later in loops[loops.index(weld) + 1:]:
            carried = CARRIED.search(later.get("note", ""))
            if within and carried and carried[2] == within[3]:
                grown, within = grown * float(carried[1]), carried
        return grown

    def is_false(self, correction):
        """Whether the two views that it joined do not lie to one another as it says (in metres by the scale of the whole)."""
        views = []
        for camera, frame in (("matched_camera", "matched_frame"), ("camera", "frame")):
            k = correction[camera]
            views.append(self.truth[k].get(self.stamps[k][correction[frame]]))
        if None in views:
            return False
        scale = similarity(self.together(self.truth), self.together(self.final))[0] * self.growth_since(correction)
        position, rotation = relative(*views)
        found = correction["T_matched_keyframe"]
        return (math.dist(position, [scale * x for x in found[:3]]) > FALSE_M
                or angle_between(rotation, rotation_of(found)) > FALSE_DEG)


def rms(found):
    return math.sqrt(statistics.fmean(e * e for e in found)) if found else math.nan


def verdict_of(run, found, asked):
    together = sum(found, [])
    torn = sum(e > TORN_M for e in together)
    if run.welds()[1] or torn > 0.01 * len(together):
        return "FALSE"
    if not run.name.endswith("_apart") and run.joined() < len(run.final):
        return "missed"
    precise = all(rms(of_camera) <= asked for of_camera in found if of_camera)
    return "good" if together and precise and max(together) <= WORST * asked else "OFF"


def row(run):
    loops, false = run.welds()
    found = run.joint_errors()
    asked = ASKED * sum(path_length(truth) for truth in run.truth)
    verdict = verdict_of(run, found, asked)
    apart = " ".join(str(m["frames"]) for c in run.summary["cameras"] for m in c["other_maps"]) or "none"
    shares = " ".join(f"{100 * len(p) / len(s):.0f}" for p, s in zip(run.final, run.stamps))
    of_each = " ".join(f"{rms(of_camera):.4f}" if of_camera else "none" for of_camera in found)
    print(f"| {run.name} | {run.joined()} of {len(run.final)} | {shares} | {apart} | {len(loops)} / {len(false)} | "
          f"{rms(sum(found, [])):.4f} | {of_each} | {asked:.4f} | {max(sum(found, []), default=math.nan):.3f} | {verdict} |")
    return verdict


def main():
    if sys.argv[1:2] in (["-h"], ["--help"]):
        print(__doc__.strip())
        return
    sequences, results = map(pathlib.Path, sys.argv[1:3])
    print("| run | cameras in one map | with a pose in it [%] | frames of maps apart | loops and welds / false | joint ATE [m] | "
          "of each camera [m] | asked [m] | worst pose [m] | |")
    print("|---|---|---|---|---|---|---|---|---|---|")
    verdicts = [row(Run(sequences, folder)) for folder in sorted(results.iterdir())
                if (folder / "summary.json").exists() and not folder.name.endswith(".part")]
    count = {kind: verdicts.count(kind) for kind in ("good", "FALSE", "missed", "OFF")}
    print(f"\n{len(verdicts)} runs: {count['good']} good, {count['FALSE']} with a false weld, {count['missed']} with a missed one, "
          f"{count['OFF']} with poses that are off.")
    sys.exit(0 if count["good"] == len(verdicts) else 1)


if __name__ == "__main__":
    main()
