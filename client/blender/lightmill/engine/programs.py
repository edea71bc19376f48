"""Where this machine's programs are."""
import os
import pathlib
import shutil
import sys


class MissingProgram(Exception):
    """One line: which program, where it was looked for, how to mend it."""


def beside(program):
    """The paths of lightmill-coordinator and lightmill-worker, which lie beside `lightmill`. `program` is its path from the
    preferences; empty: $LIGHTMILL_PROGRAM, then the path. Raises MissingProgram."""
    program = program or os.environ.get("LIGHTMILL_PROGRAM") or "lightmill"
    found = shutil.which(program)
    if not found:
        raise MissingProgram(f"there is no program {program!r}: install Lightmill, name its program in the add-on's "
                             "preferences or in $LIGHTMILL_PROGRAM, or give the address of a coordinator")
    folder = pathlib.Path(found).resolve().parent
    paths = []
    for name in ("lightmill-coordinator", "lightmill-worker"):
        path = shutil.which(str(folder / name))
        if not path:
            raise MissingProgram(f"{name} is not beside {found}: it is needed to render on this machine")
        paths.append(path)
    return paths


def python():
    """A Python outside of Blender: the one that Blender brings, or was built with."""
    name = f"python{sys.version_info.major}.{sys.version_info.minor}"
    for path in (pathlib.Path(sys.base_prefix) / "bin" / name, pathlib.Path(sys.executable)):
        if path.is_file() and "python" in path.name.lower():
            return str(path)
    raise MissingProgram("Blender's Python interpreter is not there as a program: reinstall Blender, or render on a farm")
