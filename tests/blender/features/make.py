"""Writes a .blend file for each feature, or for those named.

    blender -b --factory-startup -P make.py -- FOLDER [FEATURE...]

features_test.py renders them with Cycles and with Lightmill. Each module here holds one area's features.
"""
import importlib
import pathlib
import sys

HERE = pathlib.Path(__file__).resolve().parent
sys.path.insert(0, str(HERE))

import bpy  # noqa: E402
import stage  # noqa: E402

NOT_FEATURES = {"make", "stage", "features_test"}


def main():
    folder, *wanted = sys.argv[sys.argv.index("--") + 1:]
    for module in sorted(HERE.glob("*.py")):
        if module.stem not in NOT_FEATURES:
            importlib.import_module(module.stem)
    unknown = set(wanted) - {build.__name__ for build in stage.FEATURES}
    if unknown:
        sys.exit(f"no feature is called {', '.join(sorted(unknown))}")
    out = pathlib.Path(folder).resolve()
    out.mkdir(parents=True, exist_ok=True)
    for build in stage.FEATURES:
        if not wanted or build.__name__ in wanted:
            build(stage.Stage())
            bpy.ops.wm.save_as_mainfile(filepath=str(out / f"{build.__name__}.blend"), copy=True)


main()
