"""What no path can bring of a scene's light is said by render, by watch and in the job's record.

    missing_light_test.py --bin build/release/bin
"""
import argparse
import pathlib
import subprocess
import sys

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parent))
from farm import GENEROUS_S, Farm  # noqa: E402

SCENE = pathlib.Path(__file__).resolve().parent / "lit_and_seen_by_mirrors.pbrt"


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
        options = [SCENE, "--spp", 32]
        said = said_by(bin_dir, "render", *options, "-o", farm.folder / "mirrors.exr")
        assert said.count("which no path meets") == 1, said

        farm.start_coordinator()
        farm.start_worker(1)
        for integrator in "auto", "bdpt":
            job = farm.submit(*options, "--integrator", integrator)
            said = said_by(bin_dir, "watch", job, "--coordinator", farm.address)
            assert said.count("which no path meets") == 1, said
            lines = farm.json("job", job)["missing_light"]
            assert len(lines) == 1 and lines[0] in said, lines
            said_by(bin_dir, "report", job, "--coordinator", farm.address, "-o", farm.folder / job)
            page = (farm.folder / job / "report.html").read_text()
            assert page.count("which no path meets") == 1, integrator


if __name__ == "__main__":
    main()
