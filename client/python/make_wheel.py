"""Builds the package for pip (PEP 517 and 660), with Python's standard library alone: a wheel is a zip file with a list of
what is in it, and this package is a folder of Python files."""
import base64
import hashlib
import pathlib
import re
import zipfile

HERE = pathlib.Path(__file__).resolve().parent
EPOCH = (1980, 1, 1, 0, 0, 0)  # equal files make equal wheels


def _project(key):
    """A text of pyproject.toml. Python 3.10 has no reader of TOML."""
    return re.search(rf'^{key} = "(.*)"$', (HERE / "pyproject.toml").read_text(encoding="utf-8"), re.M)[1]


def _write(folder, files):
    name, version = _project("name"), _project("version")
    info = f"{name}-{version}.dist-info"
    files = {**files, f"{info}/METADATA": "\n".join([
        "Metadata-Version: 2.1", f"Name: {name}", f"Version: {version}", f"Summary: {_project('description')}",
        f"Requires-Python: {_project('requires-python')}", "Provides-Extra: image",
        "Requires-Dist: numpy; extra == 'image'", ""]).encode(),
        f"{info}/WHEEL": b"Wheel-Version: 1.0\nGenerator: make_wheel\nRoot-Is-Purelib: true\nTag: py3-none-any\n"}
    record = [f"{path},sha256={base64.urlsafe_b64encode(hashlib.sha256(data).digest()).rstrip(b'=').decode()},{len(data)}"
              for path, data in files.items()]
    files[f"{info}/RECORD"] = "\n".join([*record, f"{info}/RECORD,,", ""]).encode()
    wheel = f"{name}-{version}-py3-none-any.whl"
    with zipfile.ZipFile(pathlib.Path(folder) / wheel, "w", zipfile.ZIP_DEFLATED) as archive:
        for path, data in files.items():
            archive.writestr(zipfile.ZipInfo(path, EPOCH), data)
    return wheel


def build_wheel(wheel_directory, config_settings=None, metadata_directory=None):
    package = HERE / _project("name")
    paths = sorted(p for p in package.iterdir() if p.suffix == ".py" or p.name == "py.typed")
    return _write(wheel_directory, {f"{package.name}/{p.name}": p.read_bytes() for p in paths})


def build_editable(wheel_directory, config_settings=None, metadata_directory=None):
    return _write(wheel_directory, {f"{_project('name')}.pth": f"{HERE}\n".encode()})
