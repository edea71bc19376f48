"""The zip file: made twice it has the same bytes; Blender installs it as from its preferences, and it renders.

    zip_test.py --bin build/release/bin
"""
import argparse
import subprocess
import sys

from blender_runs import ROOT, Blender, error_lines, pixels

INSTALL = """
bpy.ops.preferences.addon_install(filepath={zip!r})
bpy.ops.preferences.addon_enable(module="lightmill")
assert bpy.context.preferences.addons["lightmill"].preferences.reconnect_seconds == 60
import lightmill.engine.farm_api as found
assert found.api.__file__.endswith("lightmill/api/__init__.py"), found.api.__file__
bpy.ops.wm.save_userpref()
"""


def make(path):
    subprocess.run([sys.executable, ROOT / "client" / "blender" / "make_zip.py", path], check=True)
    return path


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("--bin", required=True, help="folder of the programs")
    arguments = parser.parse_args()
    with Blender(arguments.bin, addon=None) as blender:
        once, again = (make(blender.folder / name) for name in ("once.zip", "again.zip"))
        assert once.read_bytes() == again.read_bytes(), "equal files make equal zips"
        blender.run_plain(INSTALL.format(zip=str(once)))
        text = blender.run("-f", 1)
        assert not error_lines(text), text
        assert pixels(blender.picture()).shape == (64, 96, 4)
        blender.assert_nothing_left()
        print("ok")


if __name__ == "__main__":
    main()
