"""The rendered view mode: a job for each state of the scene and the view, the newest of which is shown.

All is done in Blender's main thread, by a timer and by Blender's own calls; only jobs have threads (rendering.py).
"""
import sys
import time
import traceback
import weakref

import bpy
import gpu
import numpy
from gpu_extras.presets import draw_texture_2d

from . import orders
from .passes import channels_of, combined
from .rendering import Rendering
from .status_text import text_of
from .view import CAMERA_MARK, view_of
from .workspace import workspace

TICK_SECONDS = 0.02
SMALL_SIDE = 256        # pixels; larger viewports get a coarse picture first
COARSE_STEP, COARSE_SAMPLES = 4, 4
PATIENCE_SECONDS = 0.5  # that a job gets for its first picture when the view moves on

_sessions = weakref.WeakSet()


class Session:
    """One viewport. `note`: the status line."""

    def __init__(self):
        self.note = ""
        self._scene_text = None  # as exported, with CAMERA_MARK
        self._connection = self._view = None
        self._samples, self._depth, self._transparent = 0, 0, False
        self._wanted = False     # a job is to be started
        self._rendering, self._started, self._shown, self._coarse = None, 0.0, False, False
        self._picture = None     # the newest; not yet a texture
        self._texture = None
        self._number = 0
        self.closed = False
        bpy.app.timers.register(self._tick, first_interval=TICK_SECONDS)

    def update(self, context, depsgraph):
        """The scene changed."""
        scene = depsgraph.scene
        view = view_of(context)
        try:
            export = workspace("viewport").export(depsgraph, (view.width, view.height), camera=CAMERA_MARK)
            text = export.main.read_text("utf-8")
        except Exception as error:  # the viewport must not raise at every draw
            traceback.print_exc(file=sys.stderr)
            self.note = f"the export failed: {error}"
            return
        settings = scene.lightmill
        said = (text, orders.local_connection_of(scene), settings.preview_samples, settings.max_depth,
                scene.render.film_transparent)
        if said != (self._scene_text, self._connection, self._samples, self._depth, self._transparent):
            self._scene_text, self._connection, self._samples, self._depth, self._transparent = said
            self._wanted = True

    def draw(self, context):
        """Draws the newest picture, over the whole region."""
        view = view_of(context)
        if view != self._view:
            self._view, self._wanted = view, True
        self._advance()
        if self._picture is not None:
            pixels, self._picture = self._picture, None
            height, width = pixels.shape[:2]
            data = gpu.types.Buffer("FLOAT", pixels.size, numpy.ascontiguousarray(pixels, "f4").reshape(-1))
            self._texture = gpu.types.GPUTexture((width, height), format="RGBA16F", data=data)
        if self._texture is not None:
            gpu.state.blend_set("ALPHA_PREMULT")
            draw_texture_2d(self._texture, (0, 0), context.region.width, context.region.height)
            gpu.state.blend_set("NONE")

    def close(self):
        self.closed = True
        if self._rendering is not None:
            self._rendering.cancel()

    def _tick(self):
        if self.closed:
            return None
        try:
            if self._advance():
                _redraw()
        except Exception:
            traceback.print_exc(file=sys.stderr)
            return None
        return TICK_SECONDS

    def _advance(self):
        """Takes what has come, and starts the newest job. Returns whether there is something new to draw."""
        rendering, note = self._rendering, self.note
        ended = rendering is not None and rendering.ended  # asked first, so that no last picture is missed
        if rendering is not None:
            picture = rendering.take_picture()
            if picture is not None:
                self._picture, self._shown = combined(channels_of(picture), self._transparent), True
            self.note = rendering.error or text_of(rendering)
        if self._wanted and self._scene_text is not None and self._view is not None:
            busy = rendering is not None and not ended and not self._shown
            if not busy or time.monotonic() - self._started > PATIENCE_SECONDS:
                self._start(coarse=max(self._view.width, self._view.height) > SMALL_SIDE)
        elif self._coarse and ended and not rendering.error:
            self._start(coarse=False)
        return self._picture is not None or self.note != note

    def _start(self, coarse):
        """`coarse`: few pixels first, so that something is seen soon."""
        if self._rendering is not None:
            self._rendering.cancel()
        self._number += 1
        # Two names in turn: the job before may still be sending its file. Another viewport has others.
        main = workspace("viewport").folder / f"view-{id(self):x}-{self._number % 2}.pbrt"
        main.write_text(self._scene_text.replace(CAMERA_MARK, self._view.camera(), 1), "utf-8")
        step = COARSE_STEP if coarse else 1
        order = orders.preview_order(
            max(1, self._view.width // step), max(1, self._view.height // step),
            samples=min(COARSE_SAMPLES, self._samples) if coarse else self._samples, depth=self._depth,
            transparent=self._transparent)
        self._rendering, self._coarse = Rendering(self._connection, main, order), coarse
        self._started, self._shown, self._wanted = time.monotonic(), False, False


def session_of(engine):
    """Made when it is first asked for."""
    session = getattr(engine, "viewport_session", None)
    if session is None:
        session = engine.viewport_session = Session()
        _sessions.add(session)
    return session


def end(engine):
    session = getattr(engine, "viewport_session", None)
    if session is not None:
        session.close()


def end_all():
    """Before the add-on goes."""
    for session in list(_sessions):
        session.close()


def _redraw():
    for window in bpy.context.window_manager.windows:
        for area in window.screen.areas:
            if area.type == "VIEW_3D":
                area.tag_redraw()
