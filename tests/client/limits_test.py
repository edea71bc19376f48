"""Programs that are allowed little memory or few threads: they end by an exit code and with a line, never by a signal.

    limits_test.py --bin build/release/bin
"""
import argparse
import pathlib
import resource
import subprocess
import tempfile

ROOT = pathlib.Path(__file__).resolve().parents[2]
SCENE = ROOT / "scenes" / "cornell-spheres.pbrt"
MIB = 1 << 20
GENEROUS_S = 120  # only a hang takes so long
NOT_STARTED = 127  # what the dynamic linker exits with, after a line of its own


def run(command, data_mib):
    """With the limit on private memory, which also bounds what threads can have as stacks."""
    def limit():
        resource.setrlimit(resource.RLIMIT_DATA, (data_mib * MIB, data_mib * MIB))
        resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
    return subprocess.run(list(map(str, command)), capture_output=True, text=True, timeout=GENEROUS_S, preexec_fn=limit)


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("--bin", required=True, help="folder of the programs")
    programs = pathlib.Path(parser.parse_args().bin).resolve()
    with tempfile.TemporaryDirectory(prefix="lightmill-limits-") as folder:
        picture = pathlib.Path(folder) / "picture.exr"
        commands = {
            "check": [programs / "lightmill", "check", SCENE],
            "render": [programs / "lightmill", "render", SCENE, "--spp", 1, "--resolution", "16x16", "--threads", 1,
                       "--quiet", "-o", picture],
            # More stacks than there is room for.
            "render with many threads": [programs / "lightmill", "render", SCENE, "--spp", 1, "--resolution", "16x16",
                                         "--threads", 64, "--quiet", "-o", picture],
            "explain": [programs / "lightmill", "explain", SCENE, "--resolution", "16x16"],
            "coordinator": [programs / "lightmill-coordinator", "--version"],
            "worker": [programs / "lightmill-worker", "--version"],
        }
        explained = 0  # limits at which a program of ours said that it can't start, or go on
        for name, command in commands.items():
            codes = {}
            for mib in [40, 50, 60, 70, 80, 90, 100, 115, 130, 150, 175, 200, 300]:
                done = run(command, mib)
                codes[mib] = done.returncode
                assert done.returncode in (0, 1, 2, NOT_STARTED), f"{name} at {mib} MiB: {done}"
                lines = done.stderr.strip().splitlines()
                assert done.returncode == 0 or len(lines) == 1, f"{name} at {mib} MiB: {done}"
                explained += done.returncode in (1, 2)
                if done.returncode in (1, 2):
                    assert lines[0].startswith(command[0].name + ": "), done.stderr
            print(f"{name}: {codes}")
        assert explained > 0, "no limit was in the way"
    print("ok")


if __name__ == "__main__":
    main()
