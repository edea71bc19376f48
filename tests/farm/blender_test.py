"""The Blender add-on in background mode: exports Blender's first scene, renders it on a farm, loads the picture.

    blender_test.py --bin build/release/bin
"""
import argparse
import pathlib
import shutil
import subprocess
import sys

if not shutil.which("blender"):
    print("skipped: Blender is not installed (Debian's package blender)")
    sys.exit(77)

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parent))
from farm import GENEROUS_S, Farm, pixels  # noqa: E402
from paths import ROOT  # noqa: E402

ADDON = ROOT / "client" / "blender" / "lightmill_render.py"
SMALL = "import bpy; r = bpy.context.scene.render; r.resolution_x, r.resolution_y = 96, 64"
# As installed: registered under its module's name, its operator called from a script.
OPERATOR = """
import importlib.util, sys, bpy
spec = importlib.util.spec_from_file_location("lightmill_render", {addon!r})
module = sys.modules["lightmill_render"] = importlib.util.module_from_spec(spec)
spec.loader.exec_module(module)
bpy.context.preferences.addons.new().module = "lightmill_render"
module.register()
p = bpy.context.preferences.addons["lightmill_render"].preferences
p.program, p.coordinator, p.spp = {program!r}, {coordinator!r}, 4
assert bpy.ops.render.lightmill() == {{"FINISHED"}}
image = bpy.data.images["Lightmill"]
assert tuple(image.size) == (96, 64), tuple(image.size)
assert max(image.pixels[:]) > 0
module.unregister()
print("the add-on works")
"""


def blender(*arguments):
    return subprocess.run(["blender", "-b", "--factory-startup", "--python-exit-code", "1", "--python-expr", SMALL,
                           *map(str, arguments)], capture_output=True, text=True, timeout=GENEROUS_S)


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("--bin", required=True, help="folder of the programs")
    arguments = parser.parse_args()
    with Farm(arguments.bin) as farm:
        farm.start_coordinator()
        farm.start_worker(2)
        program, picture = farm.bin.resolve() / "lightmill", farm.folder / "cube.exr"
        both = f"127.0.0.1:1,{farm.address}"  # of which one is away
        script = ["-P", ADDON, "--", "--program", program, "--coordinator", both, "--spp", 16, "-o", picture]
        done = blender(*script)
        assert done.returncode == 0, done.stdout[-2000:] + done.stderr[-2000:]
        assert "relMSE" in done.stdout or "16 spp" in done.stdout, done.stdout[-1000:]
        image = pixels(picture)
        assert image.shape == (64, 96, 3), image.shape
        # The cube is in the middle of Blender's first view, the empty background at its corners.
        assert image[32, 48].sum() > 4 * image[2, 2].sum(), (image[32, 48], image[2, 2])

        done = blender("--python-expr", OPERATOR.format(addon=str(ADDON), program=str(program),
                                                        coordinator=both))
        assert "the add-on works" in done.stdout, done.stdout[-2000:] + done.stderr[-2000:]

        script[script.index(both)] = "127.0.0.1:1"
        done = blender(*script)
        assert done.returncode == 1 and "127.0.0.1:1" in done.stderr, done.stderr[-1000:]
        print("ok")


if __name__ == "__main__":
    main()
