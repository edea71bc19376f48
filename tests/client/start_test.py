"""Programs start without the image library; what needs it says so where it is missing.

    start_test.py --bin build/release/bin
"""
import argparse
import os
import pathlib
import shutil
import subprocess
import tempfile

ROOT = pathlib.Path(__file__).resolve().parents[2]
SCENE = ROOT / "scenes" / "cornell-spheres.pbrt"
PROGRAMS = ["lightmill", "lightmill-worker", "lightmill-coordinator"]
MODULE = "lightmill-images.so"
GENEROUS_S = 120  # only a hang takes so long


def run(*command, **environment):
    return subprocess.run(list(map(str, command)), capture_output=True, text=True, timeout=GENEROUS_S,
                          stdin=subprocess.DEVNULL, env={**os.environ, **environment})


def render(program, output):
    return [program, "render", SCENE, "--spp", 1, "--resolution", "16x16", "--threads", 1, "--quiet", "-o", output]


def libraries(*command):
    """What the dynamic linker loads, by its own word; the command must succeed."""
    done = run(*command, LD_DEBUG="files")
    assert done.returncode == 0, done.stderr[-2000:]
    assert "calling init" in done.stderr, "the dynamic linker does not say what it loads"
    return done.stderr


def test_starts_without(programs, folder):
    for program in PROGRAMS:
        for flag in ["--version", "--help"]:
            loaded = libraries(programs / program, flag)
            assert "OpenImageIO" not in loaded and MODULE not in loaded, f"{program} {flag} loads it"
    loaded = libraries(*render(programs / "lightmill", folder / "own.pfm"))
    assert "OpenImageIO" not in loaded, "PFM is our own"
    loaded = libraries(*render(programs / "lightmill", folder / "picture.exr"))
    assert "OpenImageIO" in loaded and MODULE in loaded, "EXR is the library's"


def test_says_what_is_missing(programs, folder):
    alone = folder / "alone"
    alone.mkdir()
    for program in PROGRAMS:
        shutil.copy2(programs / program, alone)
    done = run(*render(alone / "lightmill", folder / "own.pfm"))
    assert done.returncode == 0, done
    commands = {
        "render": render(alone / "lightmill", folder / "none.exr"),
        "worker": [alone / "lightmill-worker", "--coordinator", "127.0.0.1:1", "--idle-timeout", 1],
        "coordinator": [alone / "lightmill-coordinator", "--listen", "127.0.0.1:0", "--http", "127.0.0.1:0", "--data",
                        folder / "data"],
    }
    for name, command in commands.items():
        done = run(*command)
        lines = done.stderr.strip().splitlines()
        assert done.returncode == 1 and len(lines) == 1, f"{name}: {done}"
        assert f"{alone / MODULE}: the module that reads and writes images is not there; copy it" in lines[0], done
    assert not (folder / "none.exr").exists()
    # With it, the same programs do, also by a link from elsewhere.
    shutil.copy2(programs / MODULE, alone)
    (folder / "link").symlink_to(alone / "lightmill")
    done = run(*render(folder / "link", folder / "some.exr"))
    assert done.returncode == 0 and (folder / "some.exr").exists(), done


def test_finds_the_module_of_an_installation(programs, folder):
    (folder / "bin").mkdir()
    (folder / "lib/lightmill").mkdir(parents=True)
    shutil.copy2(programs / "lightmill", folder / "bin")
    shutil.copy2(programs / MODULE, folder / "lib/lightmill")
    (folder / "link").symlink_to(folder / "bin/lightmill")
    done = run(*render(folder / "link", folder / "some.exr"))
    assert done.returncode == 0 and (folder / "some.exr").exists(), done
    # What lies beside the program comes first.
    (folder / "bin" / MODULE).write_text("no library")
    done = run(*render(folder / "link", folder / "none.exr"))
    assert done.returncode == 1 and f"{folder / 'bin' / MODULE}: " in done.stderr, done


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("--bin", required=True, help="folder of the programs")
    programs = pathlib.Path(parser.parse_args().bin).resolve()
    for test in [test_starts_without, test_says_what_is_missing, test_finds_the_module_of_an_installation]:
        with tempfile.TemporaryDirectory(prefix="lightmill-start-") as folder:
            test(programs, pathlib.Path(folder).resolve())
    print("ok")


if __name__ == "__main__":
    main()
