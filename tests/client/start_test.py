"""Programs start, and make EXR and PFM files, without the image library; what needs it says so where it is missing.

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
GLTF_SCENE = ROOT / "scenes" / "materials.gltf"
PROGRAMS = ["lightmill", "lightmill-worker", "lightmill-coordinator"]
MODULE = "lightmill-images.so"
GENEROUS_S = 120  # only a hang takes so long


def run(*command, **environment):
    return subprocess.run(list(map(str, command)), capture_output=True, text=True, timeout=GENEROUS_S,
                          stdin=subprocess.DEVNULL, env={**os.environ, **environment})


def render(program, output, *options, scene=SCENE):
    return [program, "render", scene, "--spp", 1, "--resolution", "16x16", "--threads", 1, "--quiet", "-o", output,
            *options]


def under_a_sky(program, folder, output):
    """A scene with an image that the library is not needed for."""
    sky = folder / "sky.pfm"
    sky.write_bytes(b"PF\n4 2\n-1.0\n" + b"\0\0\x80\x3f" * (4 * 2 * 3))
    return render(program, output, "--environment", sky, scene=GLTF_SCENE)


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
    for output in ["own.pfm", "own.exr"]:
        loaded = libraries(*under_a_sky(programs / "lightmill", folder, folder / output))
        assert "OpenImageIO" not in loaded and MODULE not in loaded, f"{output} and PFM are our own"
    loaded = libraries(*render(programs / "lightmill", folder / "picture.png"))
    assert "OpenImageIO" in loaded and MODULE in loaded, "PNG is the library's"


def test_says_what_is_missing(programs, folder):
    alone = folder / "alone"
    alone.mkdir()
    for program in PROGRAMS:
        shutil.copy2(programs / program, alone)
    for output in ["own.pfm", "own.exr"]:
        done = run(*under_a_sky(alone / "lightmill", folder, folder / output))
        assert done.returncode == 0 and (folder / output).exists(), done
    commands = {
        "render": render(alone / "lightmill", folder / "none.png"),
        "report": render(alone / "lightmill", folder / "none.exr", "--report", folder / "report"),
        "diagnosis": render(alone / "lightmill", folder / "none.exr", "--diagnose", folder / "diagnosis"),
        "worker": [alone / "lightmill-worker", "--coordinator", "127.0.0.1:1", "--idle-timeout", 1],
        "coordinator": [alone / "lightmill-coordinator", "--listen", "127.0.0.1:0", "--http", "127.0.0.1:0", "--data",
                        folder / "data"],
    }
    for name, command in commands.items():
        done = run(*command)
        lines = done.stderr.strip().splitlines()
        assert done.returncode == 1 and len(lines) == 1, f"{name}: {done}"
        assert f"{alone / MODULE}: the module that reads and writes images is not there; copy it" in lines[0], done
    assert not list(folder.glob("none.*"))
    # With it, the same programs do, also by a link from elsewhere.
    shutil.copy2(programs / MODULE, alone)
    (folder / "link").symlink_to(alone / "lightmill")
    done = run(*render(folder / "link", folder / "some.png"))
    assert done.returncode == 0 and (folder / "some.png").exists(), done


def test_finds_the_module_of_an_installation(programs, folder):
    (folder / "bin").mkdir()
    (folder / "lib/lightmill").mkdir(parents=True)
    shutil.copy2(programs / "lightmill", folder / "bin")
    shutil.copy2(programs / MODULE, folder / "lib/lightmill")
    (folder / "link").symlink_to(folder / "bin/lightmill")
    done = run(*render(folder / "link", folder / "some.png"))
    assert done.returncode == 0 and (folder / "some.png").exists(), done
    # What lies beside the program comes first.
    (folder / "bin" / MODULE).write_text("no library")
    done = run(*render(folder / "link", folder / "none.png"))
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
