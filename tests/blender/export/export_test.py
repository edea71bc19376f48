"""What the Blender add-on writes of scenes, in background mode.

    export_test.py geometry|motion|views|lamps|light_groups|cryptomatte
    export_test.py loads --bin build/release/bin
"""
import argparse
import pathlib
import shutil
import subprocess
import sys
import tempfile

if not shutil.which("blender"):
    print("skipped: Blender is not installed (Debian's package blender)")
    sys.exit(77)

HERE = pathlib.Path(__file__).resolve().parent


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("part", choices=["geometry", "motion", "views", "lamps", "light_groups", "cryptomatte", "loads"])
    parser.add_argument("--bin", help="folder of the programs")
    arguments = parser.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        done = subprocess.run(["blender", "-b", "--factory-startup", "--python-exit-code", "1", "-P",
                               str(HERE / f"{arguments.part}.py"), "--", folder],
                              stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True, timeout=550, check=False)
        if done.returncode != 0:
            sys.exit(f"{arguments.part} failed:\n{done.stdout[-6000:]}")
        if arguments.part == "loads":
            program = pathlib.Path(arguments.bin).resolve() / "lightmill"
            for scene in sorted(pathlib.Path(folder).glob("*/scene.pbrt")):
                checked = subprocess.run([str(program), "check", str(scene)], capture_output=True, text=True, timeout=300,
                                         check=False)
                print(scene.parent.name, checked.returncode, checked.stdout[-1500:], checked.stderr[-1500:])
                assert checked.returncode == 0, scene.parent.name
                assert "no errors" in checked.stdout, scene.parent.name
    print(f"{arguments.part}: as expected")


if __name__ == "__main__":
    main()
