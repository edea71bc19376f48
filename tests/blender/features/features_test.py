"""Features of Blender's files as Cycles shows them: each .blend of make.py by Cycles and by Lightmill, compared.

    features_test.py --bin build/release/bin [--quick] [--samples N] [--percent P] [--keep FOLDER] [--write] [FEATURE...]

A feature is right if its mean is within 3 % of Cycles', the error of 4x4 box means, mean((a-b)^2 / (a^2+1e-3)), is at most
0.01, and alpha differs by 0.01 at most on average. --quick takes one of each area. --keep keeps files and pictures; Cycles'
are not drawn again. --write writes the table of docs/blender-features.md. Skipped without Blender.
"""
import argparse
import os
import pathlib
import re
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
ROOT = HERE.parents[2]
PAGE = ROOT / "docs" / "blender-features.md"
QUICK = ("lamp_ies", "world_sky_hosek", "cam_clip_end", "cam_fisheye_polynomial", "film_filter_box", "geo_nodes_points",
         "vol_camera_inside", "mat_displacement_bump", "tex_pointiness", "tex_second_uv")


class Pictures:
    """Files and pictures of features, in a folder."""

    def __init__(self, folder, bin_dir):
        self.folder = pathlib.Path(folder).resolve()
        addons = self.folder / "scripts" / "addons"
        addons.mkdir(parents=True, exist_ok=True)
        if not (addons / "lightmill").exists():
            (addons / "lightmill").symlink_to(ROOT / "client" / "blender" / "lightmill")
        self.environment = {**os.environ, "BLENDER_USER_SCRIPTS": str(self.folder / "scripts"),
                            "BLENDER_USER_CONFIG": str(self.folder / "config"),
                            "LIGHTMILL_PROGRAM": str(bin_dir.resolve() / "lightmill")}

    def blender(self, *arguments):
        done = subprocess.run(["blender", "-b", "--factory-startup", "--python-exit-code", "1", *map(str, arguments)],
                              env=self.environment, stdin=subprocess.DEVNULL, stdout=subprocess.PIPE,
                              stderr=subprocess.STDOUT, text=True, errors="replace")
        return done.returncode, done.stdout

    def make(self, wanted):
        """The .blend files, anew."""
        shutil.rmtree(self.folder / "blend", ignore_errors=True)
        code, said = self.blender("-P", HERE / "make.py", "--", self.folder / "blend", *wanted)
        if code:
            sys.exit(f"make.py failed:\n{said[-3000:]}")
        return sorted(blend.stem for blend in (self.folder / "blend").glob("*.blend"))

    def draw(self, engine, samples, percent):
        """Returns {feature: what was said of it}; a picture that is there already stays."""
        out = self.folder / engine.lower()
        out.mkdir(exist_ok=True)
        addons = ["--addons", "lightmill"] if engine == "LIGHTMILL" else []
        _, said = self.blender(*addons, "-P", HERE / "draw.py", "--", engine, samples, percent, self.folder / "blend", out)
        (self.folder / f"{engine.lower()}.log").write_text(said)
        parts = re.split(r"^feature (\w+)$", said, flags=re.M)
        return dict(zip(parts[1::2], parts[2::2]))

    def read(self, engine, feature):
        path = self.folder / engine.lower() / f"{feature}.exr"
        if not path.exists():
            return None
        file = oiio.ImageInput.open(str(path))
        pixels = np.nan_to_num(np.asarray(file.read_image(oiio.FLOAT))[..., :4], nan=1e6)
        file.close()
        return pixels


def boxes(a, k=4):
    h, w = a.shape[0] // k * k, a.shape[1] // k * k
    return a[:h, :w].reshape(h // k, k, w // k, k, -1).mean((1, 3))


class Verdict:
    """How near one picture is to Cycles'."""

    def __init__(self, theirs, ours, said):
        warnings = re.findall(r"^lightmill: warning: (.*)$", said, re.M)
        self.said = "; ".join(dict.fromkeys(warnings))
        self.mean = self.error = self.alpha = None
        if theirs is None or ours is None or theirs.shape != ours.shape:
            self.good, self.said = False, f"no picture, or of another size: {' '.join(said.split())[-300:]}"
            return
        a, b = boxes(theirs), boxes(ours)
        self.mean = ours[..., :3].mean() / theirs[..., :3].mean()
        self.error = ((a[..., :3] - b[..., :3]) ** 2 / (a[..., :3] ** 2 + 1e-3)).mean()
        self.alpha = abs(a[..., 3] - b[..., 3]).mean()
        self.good = abs(self.mean - 1) <= 0.03 and self.error <= 0.01 and self.alpha <= 0.01

    def __str__(self):
        figures = "" if self.mean is None else f"mean {self.mean:.3f} error {self.error:.4f} alpha {self.alpha:.4f} "
        return figures + self.said


def write(verdicts, samples, percent):
    """The table of the page, between its markers, two features in a row."""
    rows = [f"Pictures of {192 * percent // 100}x{128 * percent // 100} pixels, {samples} samples.", "", "| feature | mean | error | feature | mean | error |", "| --- | --- | --- | --- | --- | --- |"]
    cells = [f"{name} | {'-' if v.mean is None else f'{v.mean:.3f}'} | {'-' if v.error is None else f'{v.error:.4f}'}"
             f"{'' if v.good else ' **no**'}" for name, v in verdicts.items()]
    rows += [f"| {left} | {right} |" for left, right in zip(cells[::2], [*cells[1::2], *([" | | "] * (len(cells) % 2))])]
    before, _, after = re.split(r"(?s)(<!-- table -->.*<!-- end of table -->)", PAGE.read_text())
    PAGE.write_text(before + "\n".join(["<!-- table -->", *rows, "<!-- end of table -->"]) + after)


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("--bin", required=True, type=pathlib.Path)
    parser.add_argument("--quick", action="store_true")
    parser.add_argument("--samples", type=int, default=512)
    parser.add_argument("--percent", type=int, default=100)
    parser.add_argument("--keep", type=pathlib.Path)
    parser.add_argument("--write", action="store_true")
    parser.add_argument("feature", nargs="*")
    options = parser.parse_args()
    with tempfile.TemporaryDirectory(prefix="lightmill-features-") as temporary:
        pictures = Pictures(options.keep or temporary, options.bin)
        features = pictures.make(QUICK if options.quick else options.feature)
        shutil.rmtree(pictures.folder / "lightmill", ignore_errors=True)
        pictures.draw("CYCLES", options.samples, options.percent)
        said = pictures.draw("LIGHTMILL", options.samples, options.percent)
        verdicts = {name: Verdict(pictures.read("CYCLES", name), pictures.read("LIGHTMILL", name), said.get(name, ""))
                    for name in features}
    for name, verdict in verdicts.items():
        print(f'{"ok  " if verdict.good else "FAIL"} {name:28s} {verdict}')
    if options.write:
        write(verdicts, options.samples, options.percent)
    bad = sum(not v.good for v in verdicts.values())
    print(f"{bad} of {len(verdicts)} fell short")
    sys.exit(bad > 0)


if __name__ == "__main__":
    main()
