"""Panels of Blender and of Cycles that mean the same for Lightmill, and the shader nodes of Cycles in the Add menu.

Blender's panels name the engines that they are for in COMPAT_ENGINES. Cycles' panels ask one set that all of them have
in common, so those that are not wanted get one of their own.
"""
import sys

import bpy

ENGINE = "LIGHTMILL"
# Those of Blender whose place a panel of Cycles or of ours takes.
REPLACED = {
    "DATA_PT_area", "DATA_PT_camera_dof", "DATA_PT_falloff_curve", "DATA_PT_light", "DATA_PT_preview", "DATA_PT_spot",
    "MATERIAL_PT_context_material", "MATERIAL_PT_preview", "NODE_DATA_PT_light", "NODE_DATA_PT_spot",
    "OBJECT_PT_visibility", "VIEWLAYER_PT_filter", "VIEWLAYER_PT_layer_passes", "RENDER_PT_simplify",
}
# Those of Cycles that are wanted: by the beginnings of their names, less a few that say nothing here.
WANTED = ("CYCLES_CAMERA_PT_", "CYCLES_LIGHT_PT_", "CYCLES_MATERIAL_PT_", "CYCLES_OBJECT_PT_", "CYCLES_WORLD_PT_",
          "CYCLES_PT_context_material", "CYCLES_RENDER_PT_curves", "CYCLES_RENDER_PT_film", "CYCLES_RENDER_PT_filter",
          "CYCLES_RENDER_PT_motion_blur", "CYCLES_RENDER_PT_simplify", "CYCLES_RENDER_PT_subdivision",
          "CYCLES_VIEW3D_PT_shading_lighting")
UNWANTED = ("CYCLES_OBJECT_PT_shading_gi_approximation", "CYCLES_WORLD_PT_mist", "CYCLES_OBJECT_PT_shading_caustics")

_own_sets = []    # panels of Cycles that were given one
_node_polls = []  # functions that were replaced: module, name, function


def share():
    for panel in _subclasses(bpy.types.Panel):
        engines = getattr(panel, "COMPAT_ENGINES", ())
        if "BLENDER_RENDER" in engines and panel.__name__ not in REPLACED:
            engines.add(ENGINE)
    cycles = sys.modules.get("cycles.ui") or sys.modules.get("bl_ext.core.cycles.ui")
    if cycles is not None and hasattr(cycles, "CyclesButtonsPanel"):
        _share_cycles(cycles)
    _share_nodes()


def unshare():
    while _own_sets:
        del _own_sets.pop().COMPAT_ENGINES
    for panel in _subclasses(bpy.types.Panel):
        engines = getattr(panel, "COMPAT_ENGINES", None)
        if engines and ENGINE in engines and "LIGHTMILL" not in panel.__name__:
            engines.discard(ENGINE)
    while _node_polls:
        module, name, function = _node_polls.pop()
        setattr(module, name, function)


def _subclasses(kind):
    for sub in kind.__subclasses__():
        yield sub
        yield from _subclasses(sub)


def _share_cycles(cycles):
    for panel in cycles.classes:
        name = panel.__name__.removeprefix("NODE_")
        wanted = name.startswith(WANTED) and name not in UNWANTED
        if not wanted and "COMPAT_ENGINES" not in vars(panel):
            panel.COMPAT_ENGINES = {"CYCLES"}
            _own_sets.append(panel)
        elif wanted and "COMPAT_ENGINES" in vars(panel):
            panel.COMPAT_ENGINES.add(ENGINE)
    cycles.CyclesButtonsPanel.COMPAT_ENGINES.add(ENGINE)


def _share_nodes():
    """Up to Blender 3.6 the Add menu asks this function whether nodes of Cycles apply."""
    module = sys.modules.get("nodeitems_builtins")
    function = getattr(module, "cycles_shader_nodes_poll", None)
    if function is None:
        return
    _node_polls.append((module, "cycles_shader_nodes_poll", function))
    module.cycles_shader_nodes_poll = lambda context: context.engine == ENGINE or function(context)
