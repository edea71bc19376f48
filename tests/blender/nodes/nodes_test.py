"""Node trees of Blender: what the add-on writes, next to Cycles. In background mode.

    nodes_test.py --bin build/release/bin values|lines|worlds
"""
import argparse
import json
import pathlib
import shutil
import subprocess
import sys
import tempfile

if not shutil.which("blender"):
    print("skipped: Blender is not installed (Debian's package blender)")
    sys.exit(77)
try:
    import numpy as np
    import OpenImageIO as oiio
except ImportError:
    print("skipped: needs Debian's python3-numpy and python3-openimageio")
    sys.exit(77)

HERE = pathlib.Path(__file__).resolve().parent
PACKAGE = HERE.parents[2] / "client" / "blender"
# Of a square's pixels: how far the middle one of all differences may be, and how many may lie on the other side of an edge.
MOST_DIFFERENCE, EDGE, MOST_AT_EDGES = 5e-4, 2e-3, 0.15


def blender(script, *arguments):
    done = subprocess.run(["blender", "-b", "--factory-startup", "--python-exit-code", "1", "-P", str(HERE / script), "--", str(PACKAGE), *map(str, arguments)],
                          stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True, timeout=800, check=False)
    if done.returncode != 0:
        sys.exit(f"{script} failed:\n{done.stdout[-4000:]}")
    return done.stdout


def picture(path, *channels):
    """Channels whose names end like these, the top row first."""
    file = oiio.ImageInput.open(str(path))
    spec = file.spec()
    pixels = np.asarray(file.read_image(0, 0, 0, spec.nchannels, oiio.FLOAT)).reshape(spec.height, spec.width, -1)
    file.close()
    names = list(spec.channelnames)
    return pixels[..., [names.index(c) for c in channels]]


def render(program, scene, out, *options):
    done = subprocess.run([program, "render", str(scene), "-q", "-o", str(out), *options], stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True,
                          timeout=600, check=False)
    if done.returncode != 0:
        sys.exit(f"lightmill render failed:\n{done.stdout[-4000:]}")


def values(program, folder):
    """Every case of value_cases.py has the colours that Cycles gives it."""
    blender("values.py", folder)
    render(program, folder / "scene.pbrt", folder / "ours.exr", "--spp", "1", "--integrator", "pt", "--max-depth", "1", "--aov", "albedo")
    board = json.loads((folder / "cases.json").read_text())
    theirs = picture(folder / "cycles.exr", "R", "G", "B").clip(0, 1)
    ours = picture(folder / "ours.exr", "albedo.R", "albedo.G", "albedo.B").clip(0, 1)
    side, bad = board["side"], 0
    for k, name in enumerate(board["names"]):
        x, y = k % board["columns"] * side, len(theirs) - (k // board["columns"] + 1) * side
        area = np.s_[y + 1:y + side - 1, x + 1:x + side - 1]
        error = np.abs(theirs[area] - ours[area]).max(axis=-1)
        if np.median(error) > MOST_DIFFERENCE or (error > EDGE).mean() > MOST_AT_EDGES:
            bad += 1
            print(f"FAIL {name}: median {np.median(error):.5f}, {(error > EDGE).mean():.2f} differ, theirs {theirs[area][5, 5]}, ours {ours[area][5, 5]}")
    print(f"{len(board['names'])} cases, {bad} differ from Cycles")
    assert bad == 0
    # Only these have no equal here.
    expected = {"image that is not there"}
    assert {m.split(",")[0] for m in board["messages"]} == expected, board["messages"]


def lines(program, folder):
    """The lines, messages and bounds that lines.py checks."""
    print(blender("lines.py", folder).splitlines()[-3])


def worlds(program, folder):
    """Pictures of worlds have the radiance of Cycles in all directions, and suns its irradiance."""
    print(blender("worlds.py", folder))


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("--bin", required=True)
    parser.add_argument("part", choices=["values", "lines", "worlds"])
    arguments = parser.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        globals()[arguments.part](str(pathlib.Path(arguments.bin) / "lightmill"), pathlib.Path(folder))


main()
