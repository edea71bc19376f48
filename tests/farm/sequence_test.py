"""Sequences: every frame of a farm whose workers and coordinator die has the bits that it has when it is rendered alone.

    sequence_test.py --bin build/release/bin [frames] [faults] [files] [refusals]
"""
import argparse
import pathlib
import subprocess
import sys

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parent))
from farm import Farm, assert_same_pixels, wait_until  # noqa: E402
from paths import ROOT  # noqa: E402

ANIMATED = ROOT / "scenes" / "windmill.gltf"
STILL = ROOT / "scenes" / "cornell-spheres.pbrt"
OPTIONS = ["--resolution", "48x32", "--spp", 16, "--seed", 3]


def done(farm, sequence):
    status = farm.json("job", sequence)
    return status if status["frames"]["done"] == status["frame_count"] else None


def test_frames(bin_dir):
    """The command line from submit to fetch, and frames rendered on this machine alone."""
    with Farm(bin_dir) as farm:
        farm.start_coordinator()
        farm.start_worker(2)
        shot = farm.submit(ANIMATED, *OPTIONS, "--frames", "0-8x2", "--fps", 12, "--shutter", "0,0.5")
        assert shot == "s1", shot
        farm.lightmill("watch", shot)
        status = done(farm, shot)
        assert status["state"] == "done" and status["frame_count"] == 5 and status["fps"] == 12, status
        frames = farm.json("frames", shot)
        assert [f["frame"] for f in frames] == [0, 2, 4, 6, 8], frames
        assert [f["id"] for f in frames] == ["s1.0", "s1.2", "s1.4", "s1.6", "s1.8"], frames
        assert farm.json("jobs") == [] and len(farm.json("jobs", "--frames")) == 5
        assert [s["id"] for s in farm.json("sequences")] == ["s1"]

        pattern = farm.folder / "shot.%04d.exr"
        first = farm.json("fetch", shot, "-o", pattern)
        assert (first["written"], first["left"]) == (5, 0), first
        (farm.folder / "shot.0004.exr").write_bytes(b"half a file")
        again = farm.json("fetch", shot, "-o", pattern)
        assert (again["written"], again["left"]) == (1, 4), again
        for frame in (0, 4, 8):
            alone = farm.render(f"alone{frame}.exr", ANIMATED, *OPTIONS, "--time-of", frame / 12, "--fps", 12,
                                "--shutter", "0,0.5")
            assert_same_pixels(alone, farm.folder / f"shot.{frame:04d}.exr")
        farm.lightmill("render", ANIMATED, *OPTIONS, "--frames", "0-8x4", "--fps", 12, "--shutter", "0,0.5", "--quiet",
                       "-o", farm.folder / "local.##.exr", connect=False)
        for frame in (0, 4, 8):
            assert_same_pixels(farm.folder / f"local.{frame:02d}.exr", farm.folder / f"shot.{frame:04d}.exr")

        farm.lightmill("extend", shot, "--spp", 32)
        farm.lightmill("watch", shot)
        longer = farm.json("fetch", shot, "-o", pattern, "--frames", "2-6")
        assert (longer["written"], longer["left"]) == (3, 0), longer
        alone = farm.render("alone.exr", ANIMATED, "--resolution", "48x32", "--spp", 32, "--seed", 3, "--time-of", 0.5,
                            "--fps", 12, "--shutter", "0,0.5")
        assert_same_pixels(alone, farm.folder / "shot.0006.exr")


def test_faults(bin_dir):
    """A worker and the coordinator are killed in the middle of a shot; nothing is lost, nothing differs."""
    with Farm(bin_dir) as farm:
        farm.start_coordinator()
        victim = farm.start_worker(1)
        shot = farm.submit(ANIMATED, *OPTIONS, "--frames", "1-12", "--order", "coarse-first")
        wait_until("the first frames", lambda: farm.json("job", shot)["frames"]["done"] >= 2)
        assert farm.json("job", "s1.11")["state"] == "done", "frames 1 and 11 come first"
        victim.kill()
        victim.wait()
        farm.kill_coordinator()
        farm.start_coordinator()
        farm.start_worker(2)
        farm.lightmill("pause", shot)
        assert farm.json("job", shot)["state"] == "paused"
        farm.lightmill("resume", shot)
        farm.lightmill("watch", shot)
        farm.lightmill("fetch", shot, "-o", farm.folder / "shot.%d.exr")
        for frame in (1, 7, 12):
            alone = farm.render(f"alone{frame}.exr", ANIMATED, *OPTIONS, "--time-of", frame / 24)
            assert_same_pixels(alone, farm.folder / f"shot.{frame}.exr")


def test_files(bin_dir):
    """Frames that are files: by a pattern, and by a list on standard input; --wait fetches them as they come."""
    with Farm(bin_dir) as farm:
        text = STILL.read_text()
        for frame in (1, 2, 3):
            (farm.folder / f"scene.{frame:03d}.pbrt").write_text(text + f"# {frame}\n")
        farm.start_coordinator()
        farm.start_worker(2)
        out = farm.folder / "out.%02d.exr"
        farm.lightmill("submit", farm.folder / "scene.%03d.pbrt", *OPTIONS, "--frames", "1-3", "--wait", "-o", out)
        reference = farm.render("alone.exr", STILL, *OPTIONS)
        for frame in (1, 2, 3):
            assert_same_pixels(reference, farm.folder / f"out.{frame:02d}.exr")
        listed = subprocess.run(
            [farm.bin / "lightmill", "submit", "-", *map(str, OPTIONS), "--coordinator", farm.address],
            input="".join(f"{farm.folder}/scene.{frame:03d}.pbrt\n" for frame in (3, 1)), capture_output=True, text=True)
        assert listed.returncode == 0, listed.stderr
        shot = listed.stdout.strip()
        farm.lightmill("watch", shot)
        assert [f["frame"] for f in farm.json("frames", shot)] == [1, 2]
        scenes = {f["frame"]: f["scene"] for f in farm.json("frames", "s1")}
        assert [f["scene"] for f in farm.json("frames", shot)] == [scenes[3], scenes[1]]


def test_refusals(bin_dir):
    """One clear line each, and nothing on the farm."""
    with Farm(bin_dir) as farm:
        farm.start_coordinator()
        missing = farm.folder / "none.%02d.pbrt"
        for arguments, says in (
                ([ANIMATED, "--frames", "1-1000000000"], "at most 20000 frames"),
                ([ANIMATED, "--frames", "5-1"], "expected numbers and ranges"),
                ([STILL, "--frames", "1-2"], "is one picture"),
                ([missing, "--frames", "1-2"], "none.01.pbrt"),
                ([ANIMATED, "--order", "coarse-first"], "--frames"),
                ([ANIMATED, "--frames", "1-2", "--quality", "equal"], "--target-error"),
                ([ANIMATED, "--frames", "1-2", "--wait", "-o", "picture.exr"], "picture.exr"),
                ([ANIMATED, "--frames", "1-2", "--time-of", "1"], "--time-of")):
            command = [farm.bin / "lightmill", "submit", *map(str, arguments), "--coordinator", farm.address]
            found = subprocess.run(command, capture_output=True, text=True)
            assert found.returncode == 2, (arguments, found.returncode, found.stderr)
            lines = found.stderr.strip().splitlines()
            assert len(lines) == 1 and says in lines[0], (arguments, found.stderr)
        for verb, extra in (("watch", []), ("pause", []), ("frames", []), ("fetch", ["-o", "x.%d.exr"]),
                            ("extend", ["--spp", "9"]), ("priority", ["3"])):
            command = [farm.bin / "lightmill", verb, "s99", *extra, "--coordinator", farm.address]
            found = subprocess.run(command, capture_output=True, text=True)
            assert found.returncode == 1 and 'no sequence "s99"' in found.stderr, (verb, found.returncode, found.stderr)
        assert farm.json("sequences") == []


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("--bin", required=True)
    parser.add_argument("parts", nargs="*", default=[])
    arguments = parser.parse_args()
    parts = {"frames": test_frames, "faults": test_faults, "files": test_files, "refusals": test_refusals}
    for name in arguments.parts or parts:
        parts[name](arguments.bin)
        print(f"{name}: ok")


main()
