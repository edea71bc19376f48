"""The render engine. render_engine.py is what Blender calls; rendering.py follows a job in a thread of its own."""
import bpy

from . import frames_ahead, local_farm, render_engine, viewport, workspace


def register():
    bpy.utils.register_class(render_engine.LightmillRenderEngine)


def unregister():
    bpy.utils.unregister_class(render_engine.LightmillRenderEngine)
    viewport.end_all()
    frames_ahead.give_up()
    local_farm.stop()
    workspace.remove()
