"""For scripts that run in Blender: exports as a render engine does, and reads what was written."""
import itertools
import pathlib
import re
import sys
import traceback

import bpy
import numpy

HERE = pathlib.Path(__file__).resolve().parent
sys.path.insert(0, str(HERE.parents[2] / "client" / "blender"))
from lightmill import export  # noqa: E402

FOLDER = pathlib.Path(sys.argv[sys.argv.index("--") + 1])
_numbers = itertools.count()


class ExportOnly(bpy.types.RenderEngine):
    bl_idname, bl_label = "EXPORT_ONLY", "Export only"
    settings, result, failure = {}, None, ""

    def render(self, depsgraph):
        try:
            ExportOnly.result = export.export_frame(depsgraph, depsgraph.scene, depsgraph.view_layer,
                                                    frame_set=self.frame_set, **ExportOnly.settings)
        except Exception:  # Blender would only print it
            ExportOnly.failure = traceback.format_exc()


bpy.utils.register_class(ExportOnly)


class Written:
    """An Export with its text."""

    def __init__(self, result):
        self.result, self.folder, self.text = result, result.main.parent, result.main.read_text()
        self.messages = {m.kind: m for m in result.report}

    def meshes(self):
        """Meshes of the file in its order, each once."""
        names = dict.fromkeys(re.findall(r'"(meshes/\w+\.ply)"', self.text))
        return [read_ply(self.folder / name) for name in names]


def written(folder=None, **settings):
    """Exports the scene into a folder of its own, or the given one."""
    folder = FOLDER / (folder or f"scene{next(_numbers)}")
    ExportOnly.settings, ExportOnly.failure = {"folder": folder, **settings}, ""
    scene = bpy.context.scene
    scene.render.engine = "EXPORT_ONLY"
    if scene.camera is None:  # without one Blender starts no render
        scene.camera = add("Camera", bpy.data.cameras.new("Camera"), location=(0, 0, 9))
    bpy.ops.render.render()
    assert not ExportOnly.failure, ExportOnly.failure
    return Written(ExportOnly.result)


def empty_scene():
    bpy.ops.wm.read_factory_settings(use_empty=True)
    return bpy.context.scene


def add(name, data, **settings):
    """A new object in the scene."""
    thing = bpy.data.objects.new(name, data)
    for key, value in settings.items():
        setattr(thing, key, value)
    bpy.context.scene.collection.objects.link(thing)
    return thing


def material(name, color=(0.8, 0.8, 0.8)):
    found = bpy.data.materials.new(name)
    found.use_nodes = True
    found.node_tree.nodes["Principled BSDF"].inputs["Base Color"].default_value = (*color, 1)
    return found


def read_ply(path):
    """{property: array} of a binary file of floats, and "triangles"."""
    data = path.read_bytes()
    header, body = data.split(b"end_header\n", 1)
    counts = [int(n) for n in re.findall(rb"element \w+ (\d+)", header)]
    names = [n.decode() for n in re.findall(rb"property float (\w+)", header)]
    vertices = numpy.frombuffer(body, "<f4", counts[0] * len(names)).reshape(counts[0], len(names))
    faces = numpy.frombuffer(body, numpy.dtype([("n", "u1"), ("v", "<i4", 3)]), counts[1], 4 * vertices.size)
    assert (faces["n"] == 3).all() and len(body) == 4 * vertices.size + 13 * counts[1]
    return {"triangles": faces["v"], **{name: vertices[:, i] for i, name in enumerate(names)}}


def points(mesh, *names):
    return numpy.stack([mesh[name] for name in names or ("x", "y", "z")], axis=1)


def run(module):
    """Calls every function whose name begins with test_."""
    for name, function in list(vars(module).items()):
        if name.startswith("test_"):
            empty_scene()
            function()
            print("ok", name, flush=True)
