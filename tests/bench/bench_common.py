"""What the benches share: where things are, running a program, medians."""
import csv
import json
import os
import pathlib
import statistics
import subprocess
import sys
import tempfile

ROOT = pathlib.Path(__file__).resolve().parents[2]
BUILD = pathlib.Path(os.environ.get("LIGHTMILL_BUILD", ROOT / "build" / "release"))
LIGHTMILL = BUILD / "bin" / "lightmill"
BENCH = BUILD / "bench"
SHARED = ROOT.parent / "shared" / "scenes"
CORES = len(os.sched_getaffinity(0))


def need(*paths):
    """Ends with one line if a program has not been built."""
    for path in paths:
        if not path.exists():
            sys.exit(f"{path} is not there; first: cmake --build --preset release --target benches")


def output(*command):
    """The program's stdout; its error message on failure."""
    done = subprocess.run([str(c) for c in command], capture_output=True, text=True, check=False)
    if done.returncode != 0:
        sys.exit(f"{' '.join(map(str, command))}: exit {done.returncode}: {done.stderr.strip()}")
    return done.stdout


def figures(program, scene, *flags, **options):
    """What a bench program says of a scene: one line of JSON. Options whose value is None are left out."""
    flags += tuple(x for k, v in options.items() if v is not None for x in (f"--{k.replace('_', '-')}", v))
    return json.loads(output(BENCH / program, scene, *flags))


def farm_render(scene, out, *flags):
    """`lightmill render` (the embedded farm): (render wall seconds, worker CPU seconds)."""
    with tempfile.TemporaryDirectory() as report:
        output(LIGHTMILL, "render", scene, "--quiet", "--report", report, "-o", out, *flags)
        rows = (pathlib.Path(report) / "error.csv").read_text().splitlines()
    last = dict(zip(rows[0].split(","), rows[-1].split(",")))
    return float(last["wall_s"]), float(last["cpu_s"])


def last_row(report):
    """The last row of a report's error.csv, and "cpu_per_spp"."""
    with open(pathlib.Path(report) / "error.csv", newline="") as file:
        rows = list(csv.DictReader(file))
    first, last = ({k: float(v) if v else None for k, v in rows[i].items()} for i in (0, -1))
    # What a sample costs once the job runs: without the pilot, which is a fixed cost.
    more = last["spp"] - first["spp"]
    last["cpu_per_spp"] = (last["cpu_s"] - first["cpu_s"]) / more if more > 0 else last["cpu_s"] / last["spp"]
    return last


def spread(values, digits=3):
    """'median [min, max]' of a list of figures."""
    return f"{statistics.median(values):.{digits}g} [{min(values):.{digits}g}, {max(values):.{digits}g}]"
