#!/usr/bin/env python3
"""Table of what welds.sh ran: welds_table.py SEQUENCES RESULTS. Ends with 1 where a weld is false."""
import json
import math
import pathlib
import statistics
import sys

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parent / "lib"))
from trajectories import errors, frame_stamps, read  # noqa: E402

FAR_M = 3.0      # two views of one place are not farther apart
TORN_M = 0.5     # nor is a camera, in a map that is one, farther from where it should be
ASKED = 0.003    # joint error, of the path


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
        return list(errors(self.together(self.truth), self.together(self.final)).values())

    def welds(self):
        """Loops and welds, and of them those that put together what is apart."""
        loops = [c for c in self.summary["loop_closing"]["corrections"] if c["kind"] == "loop"]
        return loops, [c for c in loops if self.is_false(c)]

    def is_false(self, correction):
        places = []
        for camera, frame in (("camera", "frame"), ("matched_camera", "matched_frame")):
            k = correction[camera]
            places.append(self.truth[k].get(self.stamps[k][correction[frame]]))
        return None not in places and math.dist(places[0][:3], places[1][:3]) > FAR_M


def row(run):
    cameras, joined = len(run.final), run.joined()
    loops, false = run.welds()
    found = run.joint_errors() if any(run.final) else []
    torn = sum(e > TORN_M for e in found)
    length = sum(path_length(truth) for truth in run.truth)
    joint = math.sqrt(statistics.fmean(e * e for e in found)) if found else math.nan
    missed = 0 if run.name.endswith("_apart") else cameras - joined
    apart = " ".join(str(m["frames"]) for c in run.summary["cameras"] for m in c["other_maps"]) or "none"
    shares = " ".join(f"{100 * len(p) / len(s):.0f}" for p, s in zip(run.final, run.stamps))
    wrong = len(false) > 0 or torn > 0.01 * len(found)
    print(f"| {run.name} | {joined} of {cameras} | {shares} | {apart} | {len(loops)} / {len(false)} | {joint:.4f} | "
          f"{ASKED * length:.4f}{'' if joint <= ASKED * length else ' missed'} | {torn} | "
          f"{'FALSE' if wrong else 'missed' if missed else 'good'} |")
    return wrong, missed


def main():
    sequences, results = map(pathlib.Path, sys.argv[1:3])
    print("| run | cameras in one map | with a pose in it [%] | frames of maps apart | loops and welds / false | joint ATE [m] | "
          "asked [m] | poses off by > 0.5 m | |")
    print("|---|---|---|---|---|---|---|---|---|")
    verdicts = [row(Run(sequences, folder)) for folder in sorted(results.iterdir())
                if (folder / "summary.json").exists() and not folder.name.endswith(".part")]
    false = sum(wrong for wrong, _ in verdicts)
    print(f"\n{len(verdicts)} runs: {false} with a false weld, {sum(missed > 0 for _, missed in verdicts)} with a missed one.")
    sys.exit(1 if false else 0)


if __name__ == "__main__":
    main()
