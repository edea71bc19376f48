"""The suite of scenes, and intervals of ratios that are paired by seed."""
import hashlib
import math
import pathlib
import re
import statistics

from bench_common import LIGHTMILL, ROOT, SHARED, last_row, output

SCENES = {name: (ROOT / "scenes" / f"{name}.pbrt", "96x96") for name in ("cornell-spheres", "ring-caustic", "pool")}
SCENES |= {f"cornell-{name}": (SHARED / "cornell-peers" / f"{name}.pbrt", "96x96") for name in ("diffuse", "glass")}
SCENES |= {name: (SHARED / name / "scene-v4.pbrt", size)
           for name, size in {"cornell-box": "96x96", "veach-mis": "128x72", "veach-bidir": "96x96", "coffee": "72x90",
                              "staircase2": "80x80", "dining-room": "128x72", "veach-ajar": "128x72",
                              "water-caustic": "96x96", "volumetric-caustic": "96x96", "kitchen": "128x72"}.items()}
# Of larger images a pilot sees some pixels only.
SCENES |= {f"{name}-480": (SCENES[name][0], "480x480") for name in ("ring-caustic", "cornell-box")}
T975 = [12.706, 4.303, 3.182, 2.776, 2.571, 2.447, 2.365, 2.306, 2.262, 2.228, 2.201, 2.179, 2.160, 2.145, 2.131]


def scene_of(text):
    """The name in SCENES of a scene of the suite, or of a file, which comes to be in it; None: there is neither."""
    if text in SCENES:
        return text
    path, _, size = text.rpartition(":") if re.search(r":\d+x\d+$", text) else (text, "", "96x96")
    path = pathlib.Path(path)
    if not path.is_file():
        return None
    # References are kept by name: another file of this name, or what was changed in it, gets its own.
    name = f"{path.stem}-{hashlib.sha256(path.read_bytes()).hexdigest()[:8]}"
    SCENES[name] = (path.resolve(), size)
    return name


def t975(dof):
    return T975[dof - 1] if dof <= len(T975) else 1.96 * (1 + 1.15 / dof)


def interval_of_logs(logs):
    """Geometric mean of what `logs` are the logarithms of: (mean, low, high); of one value there is no interval."""
    mean = statistics.fmean(logs)
    if len(logs) < 2:
        return math.exp(mean), 0.0, math.inf
    half = t975(len(logs) - 1) * statistics.stdev(logs) / math.sqrt(len(logs))
    return math.exp(mean), math.exp(mean - half), math.exp(mean + half)


def render(scene, report, picture, threads, *flags):
    """Renders a scene of the suite at its size; returns the last row of its report. `threads`: None: as many as may be."""
    path, size = SCENES[scene]
    flags += ("--threads", threads) if threads else ()
    output(LIGHTMILL, "render", path, "--quiet", "--resolution", size, "--report", report, "-o", picture, *flags)
    return last_row(report)
