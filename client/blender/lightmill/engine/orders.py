"""From Blender's settings to what a farm is asked for."""
import os

import bpy

from .connection import Connection
from .passes import aovs_of

PACKAGE = __package__.rpartition(".")[0]  # the add-on's name in the preferences
PREVIEW_SAMPLES = 32
PREVIEW_DEPTH = 8


def preferences():
    """The add-on's; None if it was not enabled there."""
    entry = bpy.context.preferences.addons.get(PACKAGE)
    return entry.preferences if entry else None


def connection_of(scene):
    """The Connection that a scene and the preferences name. The scene's coordinator comes first."""
    said = preferences()
    threads = scene.render.threads if scene.render.threads_mode == "FIXED" else 0
    if said is None:
        return Connection(coordinator=scene.lightmill.coordinator.strip(), threads=threads)
    files = {name: bpy.path.abspath(getattr(said, name)) if getattr(said, name) else ""
             for name in ("credentials", "ca", "token_file", "cert", "key")}
    return Connection(coordinator=(scene.lightmill.coordinator or said.coordinator).strip(), threads=threads,
                      program=_program(said.program), reconnect_seconds=float(said.reconnect_seconds), **files)


def local_connection_of(scene):
    """For previews: this machine if it has the programs, as a farm is far away; else as `connection_of`."""
    from . import programs
    connection = connection_of(scene)
    try:
        programs.beside(connection.program)
    except programs.MissingProgram:
        return connection
    return Connection(threads=connection.threads, program=connection.program)


def _program(text):
    return bpy.path.abspath(text) if os.sep in text or text.startswith("//") else text


class WrongSettings(Exception):
    """One line: what can't be rendered with the settings."""


def order_of(scene, view_layer, frame, passes):
    """The options of api.Farm.submit for a final picture. Raises WrongSettings."""
    settings = scene.lightmill
    # With a time or an error and without samples there is no bound of samples, whatever the scene file says.
    stops = _given(spp=settings.samples or None, time=settings.time_limit or None,
                   target_error=settings.target_error or None)
    if not stops:
        raise WrongSettings("nothing ends the render: set samples, a time limit or an error in the sampling panel")
    width, height = frame.size
    if width < 1 or height < 1:
        raise WrongSettings("the render border holds no pixel: enlarge it")
    return {**stops, "integrator": settings.integrator, "max_depth": settings.max_depth, "seed": settings.seed,
            "resolution": (frame.width, frame.height), **_given(crop=frame.crop()),
            **_given(aovs=aovs_of(passes, scene.render.film_transparent)),
            "name": f"{scene.name[:200]} {view_layer.name[:200]} {scene.frame_current}", "priority": settings.priority,
            **_given(pool=settings.pool.strip() or None)}


def preview_order(width, height, *, samples=PREVIEW_SAMPLES, depth=PREVIEW_DEPTH, transparent=False):
    """The same for a preview: quick to begin, so paths from the camera, and no pilot."""
    return {"spp": samples, "integrator": "pt", "max_depth": depth, "seed": 0, "resolution": (width, height),
            "name": "preview", "uniform_sampling": True, **_given(aovs=aovs_of((), transparent))}


def _given(**options):
    return {name: value for name, value in options.items() if value is not None}
