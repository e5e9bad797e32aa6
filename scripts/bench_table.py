"""Makes DIR/table.md of what scripts/bench.sh left in DIR: bench_table.py DIR. Ends with 1 where a required bar is missed."""

import json
import pathlib
import sys

ORB = {"features_bench": "BM_CvOrb/1000", "tracking_bench": "BM_CvOrbBeside/1000"}
SCALE = {"ns": 1e-6, "us": 1e-3, "ms": 1.0, "s": 1e3}


class Bench:
    """One program's results: medians where it tells them, else means of CPU time [ms]."""

    def __init__(self, path):
        self.name = path.stem
        self.ms, self.counters = {}, {}
        for b in json.loads(path.read_text(encoding="utf-8"))["benchmarks"]:
            if b.get("run_type") == "aggregate" or b.get("error_occurred"):
                continue
            name = b["name"].split("/iterations:")[0].removesuffix("/manual_time").removesuffix("/process_time")
            self.ms[name] = b.get("p50_ms", b["cpu_time"] * SCALE[b["time_unit"]])
            self.counters[name] = b


def ratio_text(value, orb):
    return f"{value / orb:.3f}" if orb else ""


def rows(benches):
    reference = benches["features_bench"].ms.get(ORB["features_bench"]) if "features_bench" in benches else None
    for bench in benches.values():
        own = bench.ms.get(ORB.get(bench.name, ""), reference)
        yield f"\n## {bench.name}\n\n| what | ms | x cv::ORB | p95 | p99 |\n|---|---|---|---|---|"
        for name, ms in bench.ms.items():
            c = bench.counters[name]
            tail = [f"{c[q]:.3f}" if q in c else "" for q in ("p95_ms", "p99_ms")]
            yield f"| {name.removeprefix('BM_')} | {ms:.4g} | {ratio_text(ms, own)} | {tail[0]} | {tail[1]} |"


def bars(benches):
    """(what, reached, required, aimed at)"""

    def get(bench, name):
        return benches[bench].ms.get(name) if bench in benches else None

    orb, extractor = get("features_bench", "BM_CvOrb/1000"), get("features_bench", "BM_Extractor/1000")
    if orb and extractor:
        yield "extractor, 1000 features [x cv::ORB]", extractor / orb, 1.0, 0.75
    for n in (1000, 2000):
        step, beside = get("tracking_bench", f"BM_FrontendStep/{n}"), get("tracking_bench", f"BM_CvOrbBeside/{n}")
        if not step:
            continue
        yield f"frontend step, {n} features [x cv::ORB with 1000]", step / beside, 2.2, 1.8
        p99 = benches["tracking_bench"].counters[f"BM_FrontendStep/{n}"]["p99_ms"]
        yield f"frontend step, {n} features, p99 [x its median]", p99 / step, 3.0, None
        yield f"keyframe to landmarks, {n} features [ms]", get("tracking_bench", f"BM_KeyframeToLandmarks/{n}"), 60, None
        yield f"keyframe to adjusted, {n} features [ms]", get("tracking_bench", f"BM_KeyframeToAdjusted/{n}"), 150, None
    bundle = get("optimization_bench", "BM_LocalBundle/6")
    if bundle:
        yield "local bundle, 20 keyframes, 2000 landmarks [ms]", bundle, 100, 60


def main():
    if sys.argv[1:2] in (["-h"], ["--help"]):
        print(__doc__.strip())
        return
    folder = pathlib.Path(sys.argv[1])
    benches = {path.stem: Bench(path) for path in sorted(folder.glob("*_bench.json"))}
    table = ["# Benchmarks", "", "CPU times [ms] of one thread, medians where there are quantiles, else means; cv::ORB with 1000 features on the same frames in the same run.", ""]
    table += ["| bar | reached | required | aimed at |", "|---|---|---|---|"]
    missed = []
    for what, value, required, aimed in bars(benches):
        table.append(f"| {what} | {value:.2f} | {required:g} | {'' if aimed is None else f'{aimed:g}'} |")
        if value > required:
            missed.append(f"{what}: {value:.2f}, at most {required:g}")
    table += rows(benches)
    for title, name in (("Quality beside cv::ORB", "quality.txt"), ("Instructions per call", "counts.txt"), ("A growing map", "tour.txt")):
        path = folder / name
        if path.exists():
            table += [f"\n## {title}\n", "```", path.read_text(encoding="utf-8").rstrip(), "```"]
    (folder / "table.md").write_text("\n".join(table) + "\n", encoding="utf-8")
    print((folder / "table.md").read_text(encoding="utf-8"))
    for line in missed:
        print("bench.sh: missed: " + line, file=sys.stderr)
    sys.exit(1 if missed else 0)


if __name__ == "__main__":
    main()
