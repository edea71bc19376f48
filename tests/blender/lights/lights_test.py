"""Lights, visibility and cameras as Cycles draws them: the scenes of scenes.py by Cycles and by `lightmill render`.

    lights_test.py --bin build/release/bin [--keep FOLDER] [CASE...]

A case is right if the mean is within 3 % of Cycles' and the error of 4x4 box means, mean((a-b)^2 / (a^2+1e-3)), is at
most 0.01. Each is rendered as `auto` chooses, and by pt. Skipped without Blender.
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
try:
    import numpy as np
    import OpenImageIO as oiio
except ImportError as e:
    print(f"skipped: {e} (Debian's packages python3-numpy and python3-openimageio)")
    sys.exit(77)

HERE = pathlib.Path(__file__).resolve().parent
SAMPLES = "1024"


def read(path):
    file = oiio.ImageInput.open(str(path))
    pixels = np.asarray(file.read_image(oiio.FLOAT))[..., :3]
    file.close()
    return pixels


def boxes(a, k=4):
    h, w = a.shape[0] // k * k, a.shape[1] // k * k
    return a[:h, :w].reshape(h // k, k, w // k, k, 3).mean((1, 3))


def figures(theirs, ours):
    a, b = boxes(theirs), boxes(ours)
    return ours.mean() / theirs.mean(), ((a - b) ** 2 / (a ** 2 + 1e-3)).mean()


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("--bin", required=True, type=pathlib.Path)
    parser.add_argument("--keep", type=pathlib.Path)
    parser.add_argument("case", nargs="*")
    options = parser.parse_args()
    program = options.bin.resolve() / "lightmill"
    bad = 0
    with tempfile.TemporaryDirectory() as temporary:
        folder = options.keep or pathlib.Path(temporary)
        if not (options.keep and list(folder.glob("*.pbrt"))):
            subprocess.run(["blender", "-b", "--factory-startup", "--python-exit-code", "1", "-P",
                            str(HERE / "scenes.py"), "--", str(folder), *options.case], check=True,
                           stdout=subprocess.DEVNULL)
        for scene in sorted(folder.glob("*.pbrt")):
            if options.case and scene.stem not in options.case:
                continue
            theirs = read(scene.with_suffix(".exr"))
            for integrator in ("auto", "pt"):
                out = folder / f"{scene.stem}.{integrator}.exr"
                done = subprocess.run([program, "render", scene, "-o", out, "--integrator", integrator, "--spp", SAMPLES,
                                       "--quiet"], capture_output=True, text=True)
                if done.returncode != 0:
                    good, text = False, done.stderr.strip()
                else:
                    mean, error = figures(theirs, read(out))
                    good, text = abs(mean - 1) <= 0.03 and error <= 0.01, f"mean {mean:.3f} error {error:.4f}"
                bad += not good
                print(f'{"ok  " if good else "FAIL"} {scene.stem:28s} {integrator:5s} {text}', flush=True)
    print(f"{bad} fell short")
    return bad > 0


if __name__ == "__main__":
    sys.exit(main())
