"""The Python package that speaks a farm's HTTP API: client/python.

It is called `lightmill`, as this add-on is, so it is loaded by its path, under a name of its own. The add-on's zip has a
copy of it in the folder `api`; in the source tree it lies beside client/blender.
"""
import importlib.util
import pathlib
import sys

_NAME = "lightmill_api"


def _load():
    if _NAME in sys.modules:
        return sys.modules[_NAME]
    package = pathlib.Path(__file__).resolve().parents[1]
    folder = package / "api"
    if not folder.is_dir():
        folder = package.parents[1] / "python" / "lightmill"
    spec = importlib.util.spec_from_file_location(_NAME, folder / "__init__.py", submodule_search_locations=[str(folder)])
    module = sys.modules[_NAME] = importlib.util.module_from_spec(spec)
    try:
        spec.loader.exec_module(module)
    except BaseException:
        del sys.modules[_NAME]
        raise
    return module


api = _load()
