"""What no path can bring of a scene's light is said by render, by watch and in the job's record.

    missing_light_test.py --bin build/release/bin
"""
import argparse
import pathlib
import subprocess
import sys

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parent))
from farm import GENEROUS_S, Farm  # noqa: E402

# A light at a point over a screen; it comes to the floor off the mirror above, and the floor is seen in a mirror.
LIT_AND_SEEN_BY_MIRRORS = """
LookAt 0 1.2 -0.95  0 0.4 1.2  0 1 0
Camera "perspective" "float fov" 8
Film "rgb" "integer xresolution" 32 "integer yresolution" 32
WorldBegin
LightSource "point" "point3 from" [0 1 0] "rgb I" [2 2 2]
Material "conductor" "rgb reflectance" [0.9 0.9 0.9]
Shape "bilinearmesh" "point3 P" [-1 1.5 -1  1 1.5 -1  -1 1.5 1  1 1.5 1]
Shape "bilinearmesh" "point3 P" [-1 0 1.2  1 0 1.2  -1 2 1.2  1 2 1.2]
Material "diffuse" "rgb reflectance" [0.7 0.7 0.7]
Shape "bilinearmesh" "point3 P" [-1 0 -1  1 0 -1  -1 0 1  1 0 1]
Shape "bilinearmesh" "point3 P" [-1 0 -1  -1 1.5 -1  -1 0 1.2  -1 1.5 1.2]
Shape "bilinearmesh" "point3 P" [-0.3 0.98 -0.3  0.3 0.98 -0.3  -0.3 0.98 0.3  0.3 0.98 0.3]
"""


def said_by(bin_dir, *arguments):
    """stderr of a verb that ends well."""
    done = subprocess.run([pathlib.Path(bin_dir) / "lightmill", *map(str, arguments)], capture_output=True, text=True,
                          timeout=GENEROUS_S)
    assert done.returncode == 0, done.stderr
    return done.stderr


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("--bin", required=True, help="folder of the programs")
    bin_dir = parser.parse_args().bin
    with Farm(bin_dir) as farm:
        scene = farm.folder / "mirrors.pbrt"
        scene.write_text(LIT_AND_SEEN_BY_MIRRORS)
        options = [scene, "--spp", 32]
        said = said_by(bin_dir, "render", *options, "-o", farm.folder / "mirrors.exr")
        assert said.count("which no path meets") == 1, said

        farm.start_coordinator()
        farm.start_worker(1)
        job = farm.submit(*options)
        said = said_by(bin_dir, "watch", job, "--coordinator", farm.address)
        assert said.count("which no path meets") == 1, said
        lines = farm.json("job", job)["pilot"]["missing_light"]
        assert len(lines) == 1 and lines[0] in said, lines


if __name__ == "__main__":
    main()
