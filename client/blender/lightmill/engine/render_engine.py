"""What Blender calls: final renders and material previews; the viewport is viewport.py's."""
import sys
import time
import traceback

import bpy

from . import frames_ahead, orders, submission, viewport
from .connection import ERRORS
from .frame import frame_of
from .mattes import fields_of
from .messages import Once, tell, with_owners
from .passes import channels_of, combined, light_group_notes, motion_notes, passes_of, pixels_of, unsupported_of
from .rendering import Rendering
from .status_text import progress_of, text_of
from .workspace import workspace

POLL_SECONDS = 0.02
WORDS_SECONDS = 1.0 if bpy.app.background else 0.2  # between two changes of the status line
LAST_CANCEL_SECONDS = 10.0  # in background mode, before Blender ends

_once = Once()


class RenderFailed(Exception):
    """One line for the user."""


def _export(engine, depsgraph, size, use="final"):
    return workspace(use).export(depsgraph, size, frame_set=engine.frame_set)


def _kept(main):
    """The scene file under another name, as frames ahead are exported while it is sent."""
    kept = main.with_name(f"now-{main.name}")
    kept.write_bytes(main.read_bytes())
    return kept


class LightmillRenderEngine(bpy.types.RenderEngine):
    """On this machine, or on a farm"""
    bl_idname = "LIGHTMILL"
    bl_label = "Lightmill"
    bl_use_preview = True
    bl_use_eevee_viewport = True       # the material preview mode is Eevee's
    bl_use_shading_nodes_custom = False  # shader nodes as they are
    bl_use_spherical_stereo = False

    def update_render_passes(self, scene=None, renderlayer=None):
        self.register_pass(scene, renderlayer, "Combined", 4, "RGBA", "COLOR")
        if not bpy.app.background:  # the engine was chosen, or a file with it opened
            orders.local_connection_of(scene).warm_up()
        for p in passes_of(renderlayer):
            self.register_pass(scene, renderlayer, p.name, len(p.channels), p.channels, p.kind)

    def render(self, depsgraph):
        if getattr(self, "has_failed", False):
            return  # another view layer: one error is enough
        try:
            if self.is_preview:
                self._preview(depsgraph)
            else:
                self._render(depsgraph)
        except submission.Stopped:
            pass
        except (RenderFailed, orders.WrongSettings, *ERRORS) as error:
            self._fail(str(error))
        except Exception as error:  # a mistake of ours is told as such, and Blender goes on
            traceback.print_exc(file=sys.stderr)
            self._fail(f"the add-on failed: {type(error).__name__}: {error}")

    def _fail(self, text):
        self.has_failed = True
        frames_ahead.give_up()
        if self.is_preview:
            print(f"lightmill: preview: {text}", file=sys.stderr, flush=True)
        else:
            tell(self, "ERROR", text.strip().splitlines()[0] if text.strip() else "the render failed")

    def _render(self, depsgraph):
        scene, view_layer = depsgraph.scene, depsgraph.view_layer
        frame = frame_of(scene.render, self.resolution_x, self.resolution_y)
        passes = passes_of(view_layer)
        for name in unsupported_of(view_layer):
            _once.warn(self, f"view layer {view_layer.name!r}: Lightmill has no pass {name}")
        for note in light_group_notes(view_layer) + motion_notes(scene, view_layer):
            _once.warn(self, f"view layer {view_layer.name!r}: {note}")
        if scene.render.use_multiview:
            _once.warn(self, "stereoscopy is not supported: the picture is that of the scene's camera")
        order = orders.order_of(scene, view_layer, frame, passes)
        connection = orders.connection_of(scene)
        connection.warm_up()  # while the scene is exported
        if submission.is_asked(scene):
            submission.submit(self, depsgraph, connection, passes, _export)
            return
        self.update_stats("", "Lightmill: exporting the scene")
        export = _export(self, depsgraph, (frame.width, frame.height))
        for message in export.report:
            _once.warn(self, str(message))
        rendering = (frames_ahead.take(depsgraph, connection, export, order)
                     or Rendering(connection, _kept(export.main), order))
        if not connection.local:
            frames_ahead.send(self, depsgraph, connection, passes, _export)
        for p in passes:
            self.add_pass(p.name, len(p.channels), p.channels, layer=view_layer.name)
        self._follow(rendering, depsgraph, frame, passes)
        for field, text in fields_of(depsgraph, view_layer, passes).items():
            self.get_result().stamp_data_add_field(field, text)
        for line in rendering.warnings:
            _once.warn(self, with_owners(line, export.owners))
        if rendering.error:
            raise RenderFailed(rendering.error)

    def _follow(self, rendering, depsgraph, frame, passes):
        """Shows the picture as it grows, until it is done or Esc was pressed."""
        layer, transparent = depsgraph.view_layer.name, depsgraph.scene.render.film_transparent
        said, next_words = "", 0.0
        while True:
            ended = rendering.ended  # asked first, so that no last picture is missed
            picture = rendering.take_picture()
            if picture is not None:
                self._show(picture, layer, frame, passes, transparent)
            text = text_of(rendering)
            if text != said and (time.monotonic() >= next_words or ended):
                self.update_progress(progress_of(rendering.status))
                self.update_stats("", f"Lightmill: {text}")  # in background mode each makes a line
                said, next_words = text, time.monotonic() + WORDS_SECONDS
            if ended:
                return
            if self.test_break():
                rendering.cancel()
                frames_ahead.give_up()
                if bpy.app.background:
                    rendering.wait(LAST_CANCEL_SECONDS)
                return
            time.sleep(POLL_SECONDS)

    def _show(self, picture, layer, frame, passes, transparent):
        width, height = frame.size
        if (picture.width, picture.height) != (width, height):
            raise RenderFailed(f"the farm's picture has {picture.width} x {picture.height} pixels, not {width} x {height}")
        channels = channels_of(picture)
        pixels = {"Combined": combined(channels, transparent)}
        for p in passes:
            values = pixels_of(p, channels)
            if values is not None:
                pixels[p.name] = values
        result = self.begin_result(0, 0, width, height, layer=layer)
        for target in result.layers[0].passes:
            values = pixels.get(target.name)
            if values is not None and values.shape[2] == target.channels:
                target.rect.foreach_set(values.reshape(-1, target.channels).astype("f4", order="C"))
        self.end_result(result)

    def _preview(self, depsgraph):
        """A picture of a material, world, light or texture: few samples, without passes."""
        scene = depsgraph.scene
        frame = frame_of(scene.render, self.resolution_x, self.resolution_y)
        export = _export(self, depsgraph, (frame.width, frame.height), "preview")
        order = orders.preview_order(frame.width, frame.height, transparent=scene.render.film_transparent)
        rendering = Rendering(orders.local_connection_of(scene), export.main, order)
        self._follow(rendering, depsgraph, frame, ())
        if rendering.error:
            raise RenderFailed(rendering.error)

    # The viewport.

    def view_update(self, context, depsgraph):
        viewport.session_of(self).update(context, depsgraph)

    def view_draw(self, context, depsgraph):
        session = viewport.session_of(self)
        session.draw(context)
        self.update_stats("", f"Lightmill: {session.note}")

    def __del__(self):
        viewport.end(self)
