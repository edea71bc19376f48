"""Operators: an animation is left to the farm, and fetched from it later."""
import os
import threading

import bpy

from ..engine import orders, submission
from ..engine.connection import ERRORS


def _needs_farm(context):
    return context.engine == "LIGHTMILL" and not orders.connection_of(context.scene).local


class LIGHTMILL_OT_submit_animation(bpy.types.Operator):
    """Export all frames and submit them to the farm as a sequence for each view layer; Esc stops"""
    bl_idname = "lightmill.submit_animation"
    bl_label = "Submit Animation"

    @classmethod
    def poll(cls, context):
        return _needs_farm(context)

    def execute(self, context):
        """From a script: until all frames are submitted."""
        return self._render(context, "EXEC_DEFAULT")

    def invoke(self, context, _event):
        return self._render(context, "INVOKE_DEFAULT")

    def _render(self, context, call):
        scene, ids = context.scene, []

        def told(sequence):  # in the render's thread: Blender's data is changed later, in its own
            ids.append(sequence)
            if call != "EXEC_DEFAULT":
                bpy.app.timers.register(keep)

        def keep():
            scene.lightmill.sequence = ",".join(ids)

        submission.ask(scene, told)
        try:
            ended = bpy.ops.render.render(call)
        except RuntimeError as error:
            self.report({"ERROR"}, str(error).strip().removeprefix("Error: "))
            return {"CANCELLED"}
        if call == "EXEC_DEFAULT":
            keep()
        return {"FINISHED"} if ended == {"FINISHED"} or ended == {"RUNNING_MODAL"} else {"CANCELLED"}


class LIGHTMILL_OT_fetch_animation(bpy.types.Operator):
    """Save the frames of the submitted animation that are done, as EXR files with passes, to the output path"""
    bl_idname = "lightmill.fetch_animation"
    bl_label = "Fetch Animation"

    @classmethod
    def poll(cls, context):
        return _needs_farm(context) and bool(context.scene.lightmill.sequence)

    def execute(self, context):
        """From a script: until the files are there."""
        self._begin(context)
        self.thread.join()
        return self._end()

    def invoke(self, context, _event):
        self._begin(context)
        self.timer = context.window_manager.event_timer_add(0.2, window=context.window)
        context.window_manager.modal_handler_add(self)
        context.workspace.status_text_set("Lightmill: fetching the animation")
        return {"RUNNING_MODAL"}

    def modal(self, context, event):
        if event.type != "TIMER" or self.thread.is_alive():
            return {"PASS_THROUGH"}
        context.window_manager.event_timer_remove(self.timer)
        context.workspace.status_text_set(None)
        return self._end()

    def _begin(self, context):
        scene = context.scene
        self.files, self.error = [], ""
        stem = os.path.splitext(scene.render.frame_path(frame=0))[0].removesuffix("0000")
        layers = [layer.name for layer in scene.view_layers if layer.use]
        sequences = scene.lightmill.sequence.split(",")
        targets = [(sequence, stem if len(sequences) == 1 else f"{stem}{bpy.path.clean_name(layer)}_")
                   for sequence, layer in zip(sequences, layers)]
        connection = orders.connection_of(scene)
        self.thread = threading.Thread(target=self._fetch, args=(connection, targets), daemon=True)
        self.thread.start()

    def _fetch(self, connection, targets):
        try:
            farm = connection.open()
            for sequence, stem in targets:
                os.makedirs(os.path.dirname(stem) or ".", exist_ok=True)
                self.files += farm.sequence(sequence).save(f"{stem.replace('#', '_').replace('%', '%%')}####.exr", aovs=True)
        except (*ERRORS, OSError) as error:
            self.error = str(error)

    def _end(self):
        if self.error:
            self.report({"ERROR"}, self.error)
            return {"CANCELLED"}
        self.report({"INFO"}, f"{len(self.files)} frames are there" if self.files else "no frame is done yet")
        return {"FINISHED"}


CLASSES = (LIGHTMILL_OT_submit_animation, LIGHTMILL_OT_fetch_animation)
