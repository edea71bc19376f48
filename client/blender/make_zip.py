#!/usr/bin/python3
"""Makes the zip file that Blender's preferences install: the add-on, with the package of client/python inside.

    make_zip.py OUT.zip

Equal files make equal bytes.
"""
import pathlib
import sys
import zipfile

HERE = pathlib.Path(__file__).resolve().parent
EPOCH = (1980, 1, 1, 0, 0, 0)
SUFFIXES = (".py", ".md", ".typed", ".json")


def contents():
    """Name in the zip -> file."""
    found = {}
    for folder, inside in ((HERE / "lightmill", "lightmill"), (HERE.parent / "python" / "lightmill", "lightmill/api")):
        for path in folder.rglob("*"):
            if path.is_file() and path.suffix in SUFFIXES and "__pycache__" not in path.parts:
                found[f"{inside}/{path.relative_to(folder).as_posix()}"] = path
    found["lightmill/LICENSE"] = HERE.parents[1] / "LICENSE"
    return found


def main():
    if len(sys.argv) != 2:
        sys.exit(__doc__.strip())
    with zipfile.ZipFile(sys.argv[1], "w", zipfile.ZIP_DEFLATED) as archive:
        for name, path in sorted(contents().items()):
            entry = zipfile.ZipInfo(name, EPOCH)
            entry.compress_type, entry.external_attr = zipfile.ZIP_DEFLATED, 0o644 << 16
            archive.writestr(entry, path.read_bytes())


if __name__ == "__main__":
    main()
