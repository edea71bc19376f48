"""Folders that scenes are exported to, one for each use. They live as long as Blender, so that what has not changed is
neither written nor sent again."""
import pathlib
import shutil

import bpy

from ..export import Cache

_workspaces = {}


class Workspace:
    """`cache`: what the exporter remembers of `folder`."""

    def __init__(self, use):
        self.folder = pathlib.Path(bpy.app.tempdir) / "lightmill" / use
        self.folder.mkdir(parents=True, exist_ok=True)
        self.cache = Cache()


def workspace(use):
    """`use`: "final", "viewport" or "preview"."""
    if use not in _workspaces or not _workspaces[use].folder.is_dir():
        _workspaces[use] = Workspace(use)
    return _workspaces[use]


def remove():
    _workspaces.clear()
    shutil.rmtree(pathlib.Path(bpy.app.tempdir) / "lightmill", ignore_errors=True)
