"""A whole animation for the farm: all frames are exported and submitted, and Blender may be closed.

Only a render has a depsgraph with what renders show, so the operator (ui/submission.py) starts a render, and the engine
calls `submit` instead of following a job.
"""
import bpy

from . import orders
from .frame import frame_of

_asked = {}  # by the name of the scene: who is told of each sequence


def ask(scene, told):
    """The next render of `scene` submits its animation and calls told(sequence's id) for each view layer."""
    _asked[scene.name_full] = told
    for handlers in _HANDLERS:
        if _ended not in handlers:
            handlers.append(_ended)


def is_asked(scene):
    return scene.name_full in _asked


@bpy.app.handlers.persistent
def _ended(*_):
    """After the render, however it ended: the next one is a render again."""
    _asked.clear()
    for handlers in _HANDLERS:
        if _ended in handlers:
            handlers.remove(_ended)


_HANDLERS = (bpy.app.handlers.render_complete, bpy.app.handlers.render_cancel)


class Stopped(Exception):
    """Esc was pressed; what was submitted is cancelled."""


def submit(engine, depsgraph, connection, passes, export):
    """The frames of one view layer, as one sequence. Raises Stopped, ERRORS."""
    scene, view_layer = depsgraph.scene, depsgraph.view_layer
    current, numbers = scene.frame_current, range(scene.frame_start, scene.frame_end + 1, scene.frame_step)
    farm = connection.open()

    def frames():
        for done, number in enumerate(numbers):
            if engine.test_break():
                raise Stopped()
            engine.update_stats("", f"Lightmill: submitting frame {number} ({done} of {len(numbers)} done)")
            engine.update_progress(done / len(numbers))
            engine.frame_set(number, 0.0)
            frame = frame_of(scene.render, engine.resolution_x, engine.resolution_y)
            order = orders.order_of(scene, view_layer, frame, passes)
            made = export(engine, depsgraph, (frame.width, frame.height))
            yield number, farm.check(made.main, **order)

    try:
        sequence = farm.submit_checked(
            frames(), name=f"{scene.name[:200]} {view_layer.name[:200]}", fps=scene.render.fps / scene.render.fps_base,
            priority=scene.lightmill.priority, pool=scene.lightmill.pool.strip())
    finally:
        engine.frame_set(current, 0.0)
    _asked[scene.name_full](sequence.id)
