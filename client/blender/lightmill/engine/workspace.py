"""Folders that scenes are exported to, one for each use. They live as long as Blender, so that what has not changed is
neither written nor sent again."""
import collections
import contextlib
import os
import pathlib
import shutil

import bpy

from ..export import Cache, export_frame

MOST_KEPT = 20  # exports whose files stay: more than there are frames ahead

_workspaces = {}


class Workspace:
    """`folder`: where the scene files are."""

    def __init__(self, use):
        self.folder = pathlib.Path(bpy.app.tempdir) / "lightmill" / use
        self.folder.mkdir(parents=True, exist_ok=True)
        self._cache = Cache()
        self._kept = collections.deque()   # sets of paths
        self._uses = collections.Counter()  # of each path, by these sets

    def export(self, depsgraph, size, **options):
        """As export_frame. Files that only long past exports needed are removed."""
        made = export_frame(depsgraph, depsgraph.scene, depsgraph.view_layer, self.folder, size=size, cache=self._cache,
                            **options)
        files = frozenset(made.files)
        self._kept.append(files)
        self._uses.update(files)
        if len(self._kept) > MOST_KEPT:
            old = self._kept.popleft()
            self._uses.subtract(old)
            for path in old:
                if self._uses[path] <= 0:
                    del self._uses[path]
                    with contextlib.suppress(OSError):
                        os.unlink(path)
        return made


def workspace(use):
    """`use`: "final", "viewport" or "preview"."""
    if use not in _workspaces or not _workspaces[use].folder.is_dir():
        _workspaces[use] = Workspace(use)
    return _workspaces[use]


def remove():
    _workspaces.clear()
    shutil.rmtree(pathlib.Path(bpy.app.tempdir) / "lightmill", ignore_errors=True)
