"""Looks up inputs of a volume's shaders over a grid. Runs in a Blender of its own: see volume_texture.py.

    blender -b --factory-startup -P draw_volume.py -- FOLDER

The middles of the grid's cells are baked: the object is replaced by a stack of squares, one for each layer of cells, whose
texture coordinates lay them out side by side. So nodes see the object's own coordinates. FOLDER has data.blend and task.json,
and gets answer.json and an array [layer, row, column, channel] for each input.
"""
import json
import math
import pathlib
import sys

import bpy
import mathutils
import numpy

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parent))
from baking import make_ready, pixels_of  # noqa: E402


def stack(low, high, n):
    """A mesh of n squares."""
    columns = math.ceil(math.sqrt(n))
    rows = math.ceil(n / columns)
    points, maps = [], []
    for k in range(n):
        z = low[2] + (k + 0.5) / n * (high[2] - low[2])
        for x, y in ((0, 0), (1, 0), (1, 1), (0, 1)):
            points.append((high[0] if x else low[0], high[1] if y else low[1], z))
            maps.append(((k % columns + x) / columns, (k // columns + y) / rows))
    mesh = bpy.data.meshes.new("stack")
    mesh.from_pydata(points, [], [tuple(range(4 * k, 4 * k + 4)) for k in range(n)])
    layer = mesh.uv_layers.new(name="layers")
    layer.data.foreach_set("uv", [c for uv in maps for c in uv])
    return mesh, columns, rows


def outside(tree, socket, path):
    """The output that feeds `socket` of the innermost group on `path`, brought out to the root tree."""
    levels = [tree]
    for name in path:
        levels.append(levels[-1].nodes[name].node_tree)
    output = socket.links[0].from_socket
    for level, name in zip(reversed(levels[:-1]), reversed(path)):
        inner = level.nodes[name].node_tree
        inner.outputs.new("NodeSocketFloat" if socket.type == "VALUE" else "NodeSocketColor", "baked")
        end = next(n for n in inner.nodes if n.type == "GROUP_OUTPUT" and n.is_active_output)
        inner.links.new(output, [s for s in end.inputs if s.name == "baked"][-1])
        output = [s for s in level.nodes[name].outputs if s.name == "baked"][-1]
    return output


def main():
    folder = pathlib.Path(sys.argv[sys.argv.index("--") + 1])
    task = json.loads((folder / "task.json").read_text(encoding="utf-8"))
    bpy.ops.wm.read_factory_settings(use_empty=True)
    with bpy.data.libraries.load(str(folder / "data.blend")) as (_, wanted):
        wanted.materials = [task["material"]]
    material, n = wanted.materials[0], task["n"]
    mesh, columns, rows = stack(task["low"], task["high"], n)
    mesh.use_auto_texspace = False
    mesh.texspace_location, mesh.texspace_size = task["texture_middle"], task["texture_half"]
    mesh.materials.append(material)
    thing = bpy.data.objects.new(task["name"], mesh)
    thing.matrix_world = mathutils.Matrix(task["matrix"])
    make_ready(task, thing)

    tree = material.node_tree
    output = tree.get_output_node("CYCLES")
    for link in [k for s in output.inputs for k in s.links]:
        tree.links.remove(link)
    shine, number, texture = (tree.nodes.new("ShaderNode" + kind) for kind in ("Emission", "Math", "TexImage"))
    number.inputs[1].default_value = 0  # what is added to a number; colours are turned into one as Blender does
    tree.links.new(shine.outputs[0], output.inputs["Surface"])
    texture.image = bpy.data.images.new("layers", n * columns, n * rows, float_buffer=True)
    texture.image.colorspace_settings.name = "Non-Color"
    tree.nodes.active = texture
    answers = []
    for which, (path, name, identifier) in enumerate(task["inputs"]):
        level = tree
        for group in path:
            level = level.nodes[group].node_tree
        socket = next(s for s in level.nodes[name].inputs if s.identifier == identifier)
        value = outside(tree, socket, path)
        if socket.type == "VALUE":
            tree.links.new(value, number.inputs[0])
            value = number.outputs[0]
        tree.links.new(value, shine.inputs["Color"])
        bpy.ops.object.bake(type="EMIT", margin=0, use_clear=True)
        tiles = pixels_of(texture.image).reshape(rows, n, columns, n, 4)[..., :3].transpose(0, 2, 1, 3, 4).reshape(rows * columns, n, n, 3)
        numpy.save(folder / f"{which}.npy", tiles[:n])
        answers.append(f"{which}.npy")
    (folder / "answer.json").write_text(json.dumps(answers), encoding="utf-8")


if __name__ == "__main__":
    main()
