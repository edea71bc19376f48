"""Lightmill for Blender: the render engine LIGHTMILL, on a farm or on this machine (docs/blender.md)."""

bl_info = {
    "name": "Lightmill",
    "description": "Render engine: on this machine, or on a Lightmill farm",
    "author": "The Lightmill authors",
    "version": (0, 1, 0),
    "blender": (3, 4, 0),
    "category": "Render",
}


def register():
    from . import engine, ui
    ui.register()
    engine.register()


def unregister():
    from . import engine, ui
    engine.unregister()
    ui.unregister()
