"""Every tile rendered twice, by workers of different thread counts: they agree to the last counted ray.

    spot_check_test.py --bin build/release/bin
"""
import argparse
import os
import pathlib
import re
import sys

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parent))
from farm import Farm, assert_same_pixels, wait_until  # noqa: E402
from paths import ROOM  # noqa: E402

OPTIONS = [ROOM, "--resolution", "96x64", "--seed", "7", "--spp", "48"]


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--bin", type=pathlib.Path, required=True)
    arguments = parser.parse_args()
    os.environ["LIGHTMILL_SPOT_CHECK"] = "1"
    with Farm(arguments.bin) as farm:
        reference = farm.render("local.exr", *OPTIONS, "--integrator", "bdpt", "--aov", "all")
        farm.start_coordinator()
        farm.start_worker(1)
        farm.start_worker(3)
        wait_until("two workers", lambda: len(farm.json("workers")) == 2)
        job = farm.submit(*OPTIONS, "--integrator", "bdpt", "--aov", "all")
        assert_same_pixels(reference, farm.finish_and_fetch(job, "farm.exr"))
        tiles = len(farm.json("tiles", job))
        committed = sum(w["tiles_committed"] for w in farm.json("workers"))
        assert committed >= 2 * tiles, f"{committed} tiles were rendered, the job has {tiles}"
        auto = farm.submit(*OPTIONS, "--integrator", "auto", "--after", job, "--max-workers", "2")
        status = farm.json("job", auto)
        assert status["after"] == [job] and status["max_workers"] == 2, status
        farm.finish_and_fetch(auto, "auto.exr")
        log = (farm.folder / "coordinator.log").read_text()
        assert not re.search("spot check|unchecked|wrongly", log), log[-2000:]
        assert all(w["state"] != "benched" for w in farm.json("workers"))
    print("ok")


if __name__ == "__main__":
    main()
