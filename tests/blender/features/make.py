"""Writes a .blend file for each feature, or for those named (`lamp_*` names all that begin so).

    blender -b --factory-startup -P make.py -- FOLDER [FEATURE...]

features_test.py renders them with Cycles and with Lightmill. Each module here holds one area's features.
"""
import fnmatch
import importlib
import pathlib
import sys

HERE = pathlib.Path(__file__).resolve().parent
sys.path.insert(0, str(HERE))

import bpy  # noqa: E402
import stage  # noqa: E402

NOT_FEATURES = {"make", "stage", "draw", "features_test"}


def main():
    folder, *wanted = sys.argv[sys.argv.index("--") + 1:]
    for module in sorted(HERE.glob("*.py")):
        if module.stem not in NOT_FEATURES:
            importlib.import_module(module.stem)
    builds = [b for b in stage.FEATURES if not wanted or any(fnmatch.fnmatch(b.__name__, w) for w in wanted)]
    if not builds:
        sys.exit(f"no feature is called {' or '.join(wanted)}")
    out = pathlib.Path(folder).resolve()
    out.mkdir(parents=True, exist_ok=True)
    for build in builds:
        build(stage.Stage())
        bpy.ops.wm.save_as_mainfile(filepath=str(out / f"{build.__name__}.blend"), copy=True)


main()
