"""Frames of an animation that a farm already works on while Blender still waits for the one before.

Blender renders an animation a frame at a time. On a farm, where one frame may not keep all workers busy, the engine
exports the next frames at once, and submits a job for each. When Blender comes to such a frame it is exported again: its
job is taken if the files and the settings are the same, else it is cancelled.
"""
import contextlib
import dataclasses
import hashlib
import os
import sys

import bpy

from . import orders
from .frame import frame_of
from .rendering import Rendering


@dataclasses.dataclass
class _Ahead:
    key: tuple
    rendering: Rendering
    main: object  # its scene file, a pathlib.Path


_ahead = {}  # by scene, view layer and frame


def take(depsgraph, connection, export, order):
    """The Rendering that is under way for this very frame; None if there is none."""
    found = _ahead.pop(_place(depsgraph, depsgraph.scene.frame_current), None)
    if found is None:
        return None
    if found.key != _key(connection, export, order) or found.rendering.error:
        _drop(found)
        return None
    found.rendering.growing = True
    return found.rendering


def send(engine, depsgraph, connection, passes, export):
    """Exports and submits the frames that come next, as many as the scene's settings say. `export(engine, depsgraph, size)`."""
    scene = depsgraph.scene
    current, step = scene.frame_current, scene.frame_step
    last = min(scene.frame_end, current + step * scene.lightmill.frames_ahead)
    wanted = [n for n in range(current + step, last + 1, step)
              if _place(depsgraph, n) not in _ahead and _is_rendered(scene, n)]
    if not wanted or not engine.is_animation or _is_single():
        return
    try:
        for number in wanted:
            if engine.test_break():
                break
            engine.update_stats("", f"Lightmill: exporting frame {number} ahead")
            engine.frame_set(number, 0.0)  # the depsgraph stays, and is of that frame now
            _send(engine, depsgraph, connection, passes, export, number)
    finally:
        engine.frame_set(current, 0.0)


def give_up():
    """Cancels all of them."""
    while _ahead:
        _drop(_ahead.popitem()[1])


def _drop(ahead):
    ahead.rendering.cancel()
    with contextlib.suppress(OSError):
        os.unlink(ahead.main)


def _place(depsgraph, number):
    return depsgraph.scene.name_full, depsgraph.view_layer.name, number


def _key(connection, export, order):
    """The scene file names all others by their content."""
    return connection, hashlib.sha256(export.main.read_bytes()).hexdigest(), order


def _is_single():
    """For Blender `-f 7` is an animation of one frame; nothing of it says so but the command line."""
    arguments = sys.argv[:sys.argv.index("--")] if "--" in sys.argv else sys.argv
    return bpy.app.background and not {"-f", "--render-frame"}.isdisjoint(arguments)


def _is_rendered(scene, number):
    """Blender leaves out what is there if it shall not be written again."""
    return scene.render.use_overwrite or not os.path.exists(scene.render.frame_path(frame=number))


def _send(engine, depsgraph, connection, passes, export, number):
    frame = frame_of(depsgraph.scene.render, engine.resolution_x, engine.resolution_y)
    order = orders.order_of(depsgraph.scene, depsgraph.view_layer, frame, passes)
    made = export(engine, depsgraph, (frame.width, frame.height))
    # Beside the other files, under a name of its own: the next export writes the scene file again.
    main = made.main.with_name(f"ahead-{number}-{made.main.name}")
    main.write_bytes(made.main.read_bytes())
    _ahead[_place(depsgraph, number)] = _Ahead(_key(connection, made, order),
                                               Rendering(connection, main, order, growing=False), main)
