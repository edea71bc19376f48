"""Settings, preferences and panels."""
import bpy

from . import panels, preferences, settings, shared_panels, submission

CLASSES = (*settings.CLASSES, *preferences.CLASSES, *submission.CLASSES, *panels.CLASSES)


def register():
    for kind in CLASSES:
        bpy.utils.register_class(kind)
    settings.attach()
    shared_panels.share()


def unregister():
    shared_panels.unshare()
    settings.detach()
    for kind in reversed(CLASSES):
        bpy.utils.unregister_class(kind)
