#!/usr/bin/env python3
"""Which scenes of a folder load: `lightmill check` over every .pbrt, .pbrt.gz, .gltf and .glb below it.

    corpus.py --bin build/release/bin FOLDER... [--output new.tsv] [--render] [--compare old.tsv] [--jobs 2]

Writes a line for each file, as TSV: its path, "loads", "warns", "refused", "incomplete" (a file that it names is
missing), "no scene" (a .pbrt file that others include, or nothing that can be seen), "version" (of another version of glTF) or
"FAILED" (a crash, or no end), how many warnings, the
seconds, the mean colour of a small picture (with --render), and the first reason. At the end: how many of each, and
of all complete files the share that loads. --compare lists what differs from an earlier table. Exit status 1 if a
file FAILED, or if one that loaded in the earlier table does not load any more.
"""
import argparse
import concurrent.futures
import json
import pathlib
import subprocess
import sys
import tempfile
import time

SUFFIXES = (".pbrt", ".pbrt.gz", ".gltf", ".glb")
COLUMNS = ("file", "result", "warnings", "seconds", "colour", "why")
# A file that says this lacks another.
MISSING = ("there is no file", "no such file", "No such file", "is no file beside the scene",
           "Git LFS")

# What is no scene of ours to begin with.
OTHER_KINDS = {"no scene": ("WorldBegin", "the file shows nothing"), "version": ("this is glTF", ".glb file is of version")}


def scenes_below(folders):
    """(name in the table, path) of every scene, in a fixed order."""
    for folder in map(pathlib.Path, folders):
        for path in sorted(folder.rglob("*")):
            if path.is_file() and path.name.lower().endswith(SUFFIXES):
                yield str(pathlib.Path(folder.name) / path.relative_to(folder)), path


def run(command, timeout):
    """Exit status (None: no end) and output of a command."""
    try:
        done = subprocess.run(command, capture_output=True, text=True, errors="replace", timeout=timeout, check=False)
        return done.returncode, done.stdout, done.stderr
    except subprocess.TimeoutExpired:
        return None, "", ""


def short(text):
    """One line without tabs, not too long."""
    text = " ".join(text.split())
    return text if len(text) <= 160 else text[:157] + "..."


def mean_colour(program, path, timeout):
    """Mean of a picture of 64 pixels' width at 4 samples, or why there is none."""
    with tempfile.TemporaryDirectory() as folder:
        image = pathlib.Path(folder) / "image.pfm"
        status, _, error = run([program, "render", path, "--quiet", "--spp", "4", "--resolution", "64x36",
                                "--integrator", "pt", "-o", image], timeout)
        if status != 0 or not image.exists():
            return "none: " + short(error or "no end")
        header, values = image.read_bytes().split(b"-1.0\n", 1)
        channels = 3 if header.startswith(b"PF") else 1
        floats = memoryview(values[: len(values) // 4 * 4]).cast("f")
        means = [sum(floats[c::channels]) / max(1, len(floats) // channels) for c in range(channels)]
        return " ".join(f"{m:.4g}" for m in means)


def look_at(program, path, options):
    """The columns of one file but its name."""
    start = time.monotonic()
    status, out, error = run([program, "check", "--json", path], options.timeout)
    seconds = f"{time.monotonic() - start:.1f}"
    if status is None or status < 0 or status > 5:
        return ["FAILED", 0, seconds, "", "no end" if status is None else f"status {status}: {short(error)}"]
    try:
        problems = json.loads(out)["problems"]
    except (ValueError, KeyError):
        return ["FAILED", 0, seconds, "", "no JSON: " + short(error)]
    errors = [p["message"] for p in problems if p["severity"] == "error"]
    warnings = [p["message"] for p in problems if p["severity"] == "warning"]
    if errors:
        missing = [e for e in errors if any(m in e for m in MISSING)]
        others = [e for e in errors if e not in missing and not (missing and "too many errors" in e)]
        result = "refused" if others else "incomplete"
        for kind, words in OTHER_KINDS.items():
            result = kind if any(word in e for word in words for e in others) else result
        return [result, len(warnings), seconds, "", short((others or missing)[0])]
    colour = mean_colour(program, path, options.timeout) if options.render else ""
    return ["warns" if warnings else "loads", len(warnings), seconds, colour, short(warnings[0]) if warnings else ""]


def compare(old_table, rows):
    """Prints what differs; the number of files that loaded and do not any more."""
    lines = pathlib.Path(old_table).read_text(encoding="utf-8").splitlines()[1:]
    old = {line.split("\t")[0]: line.split("\t")[1:] for line in lines}
    loads = ("loads", "warns")
    lost = 0
    for name, *row in rows:
        before = old.get(name)
        if before is None or (before[0], before[3]) == (row[0], row[3]):
            continue
        lost += before[0] in loads and row[0] not in loads
        print(f"{name}: {before[0]} {before[3]} -> {row[0]} {row[3]}  {row[4]}")
    return lost


def main():
    """The command line."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("folders", nargs="+", metavar="FOLDER")
    parser.add_argument("--bin", required=True, help="folder of the programs")
    parser.add_argument("--output", help="the table; else it goes to standard output")
    parser.add_argument("--render", action="store_true", help="renders a small picture of what loads")
    parser.add_argument("--compare", help="an earlier table")
    parser.add_argument("--jobs", type=int, default=2)
    parser.add_argument("--timeout", type=float, default=120, help="seconds for a file")
    options = parser.parse_args()
    program = pathlib.Path(options.bin).resolve() / "lightmill"
    scenes = list(scenes_below(options.folders))
    with concurrent.futures.ThreadPoolExecutor(options.jobs) as pool:
        looked = pool.map(lambda scene: look_at(program, scene[1], options), scenes)
        rows = [[name, *row] for (name, _), row in zip(scenes, looked)]
    table = "\n".join("\t".join(map(str, row)) for row in [COLUMNS, *rows]) + "\n"
    if options.output:
        pathlib.Path(options.output).write_text(table, encoding="utf-8")
    else:
        print(table, end="")
    count = {}
    for row in rows:
        count[row[1]] = count.get(row[1], 0) + 1
    loaded = count.get("loads", 0) + count.get("warns", 0)
    complete = loaded + count.get("refused", 0) + count.get("FAILED", 0)
    print(", ".join(f"{n} {kind}" for kind, n in sorted(count.items())) or "no scenes")
    print(f"{loaded} of {complete} complete files load: {100 * loaded / max(1, complete):.1f} %")
    lost = compare(options.compare, rows) if options.compare else 0
    sys.exit(1 if lost or count.get("FAILED", 0) else 0)


if __name__ == "__main__":
    main()
