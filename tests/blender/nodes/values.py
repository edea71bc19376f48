"""Builds a board of squares, one for each case of value_cases.py; draws it by Cycles, and exports each square's graph.

    blender -b --factory-startup -P values.py -- PACKAGE FOLDER

PACKAGE is the folder that holds `lightmill`. FOLDER gets cycles.exr, scene.pbrt with its files, and cases.json.
"""
import json
import math
import pathlib
import sys

import bpy
import mathutils

package, folder = sys.argv[sys.argv.index("--") + 1:]
sys.path[:0] = [package, str(pathlib.Path(__file__).parent)]
bpy.ops.wm.read_factory_settings(use_empty=True)
import value_cases  # noqa: E402
from lightmill import nodes  # noqa: E402
from lightmill.nodes.shaders import Builder  # noqa: E402
from lightmill.nodes.tree import Scope  # noqa: E402

SIDE = 12  # pixels of a square
folder = pathlib.Path(folder)
scene = bpy.context.scene
scene["scene_tint"] = [0.4, 0.7, 0.2]
columns = math.ceil(math.sqrt(len(value_cases.CASES)))
rows = math.ceil(len(value_cases.CASES) / columns)
other = bpy.data.objects.new("other", None)
other.location, other.rotation_euler, other.scale = (3, 4, 0.5), (0.3, 0.5, 1.1), (1.5, 0.8, 2)
scene.collection.objects.link(other)


def square(number, name, build):
    """A square in the board; its object is turned and scaled, its mesh undoes that."""
    thing = bpy.data.objects.new(f"square {number}", bpy.data.meshes.new(f"mesh {number}"))
    x, y = number % columns, number // columns
    thing.location, thing.rotation_euler, thing.scale = (x + 0.4, y + 0.6, 0.3 * (number % 3)), (0, 0, 0.7 + number % 5), (0.5, 0.7, 1.3)
    scene.collection.objects.link(thing)
    bpy.context.view_layer.update()
    corners = [(x + i, y + k, 0.2 * (i - k)) for i, k in ((0, 0), (1, 0), (1, 1), (0, 1))]
    back = thing.matrix_world.inverted()
    mesh = thing.data
    mesh.from_pydata([tuple(back @ mathutils.Vector(c)) for c in corners], [], [(0, 1, 2, 3)])
    for uv_map, shift in (("UVMap", 0.0), ("Second", 0.25)):
        layer = mesh.uv_layers.new(name=uv_map)
        for i, (u, v) in enumerate(((0, 0), (1, 0), (1, 1), (0, 1))):
            layer.data[i].uv = (u * 0.9 + shift, v * 0.7 + 0.1)
    mesh.uv_layers.active_index = 0
    thing["tint"], thing.color, thing.pass_index = [0.2, 0.6, 0.9], (0.3, 0.8, 0.5, 0.7), 1
    material = bpy.data.materials.new(name)
    material.use_nodes, material.pass_index = True, 2
    tree = material.node_tree
    tree.nodes.clear()
    m = value_cases.Make(tree, thing)
    socket = build(m)
    shown = m.add("VectorMath", {"Vector": socket}, operation="MULTIPLY_ADD", Vector_001=(0.25,) * 3, Vector_002=(0.4,) * 3)
    emission = m.add("Emission", {"Color": shown.outputs[0]})
    tree.links.new(emission.outputs[0], m.add("OutputMaterial").inputs[0])
    mesh.materials.append(material)
    return thing, emission


made = [square(i, name, build) for i, (name, build) in enumerate(value_cases.CASES)]
camera = bpy.data.cameras.new("camera")
camera.type, camera.ortho_scale = "ORTHO", max(columns, rows)
eye = bpy.data.objects.new("camera", camera)
eye.location = (columns / 2, rows / 2, 10)
scene.collection.objects.link(eye)
scene.camera = eye
render = scene.render
render.engine = "CYCLES"
render.resolution_x, render.resolution_y, render.resolution_percentage = columns * SIDE, rows * SIDE, 100
render.image_settings.file_format, render.image_settings.color_depth, render.filepath = "OPEN_EXR", "32", str(folder / "cycles.exr")
cycles = scene.cycles
cycles.samples, cycles.use_denoising, cycles.use_adaptive_sampling, cycles.filter_width, cycles.max_bounces = 1, False, False, 0.01, 0
bpy.ops.render.render(write_still=True)

depsgraph = bpy.context.evaluated_depsgraph_get()
context = nodes.Context(folder, scene, depsgraph, view_layer=bpy.context.view_layer)
shapes = []
for thing, emission in made:
    evaluated = thing.evaluated_get(depsgraph)
    material = thing.data.materials[0]
    # pbrt's meshes have one uv map here: the one that the case is about.
    shown = 1 if "Second" in material.name or "GEOMETRY" in material.name else 0
    maps = tuple(layer.name for layer in thing.data.uv_layers)
    place = nodes.Place.of(evaluated, uv_maps=maps if shown == 0 else maps[::-1])
    b = Builder(context, place, material.name, material.pass_index)
    parameter = b.parameter("reflectance", "spectrum", emission.inputs["Color"], Scope(material.node_tree, material.name, context.report))
    points = [thing.matrix_world @ v.co for v in thing.data.vertices]
    uvs = [loop.uv for loop in thing.data.uv_layers[shown].data]
    shapes += dict.fromkeys(b.lines)
    shapes.append(f'Material "diffuse" {parameter}')
    shapes.append('Shape "trianglemesh" "integer indices" [0 1 2 0 2 3] "point3 P" [' + " ".join(f"{c:.9g}" for p in points for c in p) +
                  '] "point2 uv" [' + " ".join(f"{c:.9g}" for uv in uvs for c in uv) + "]")
half_x, half_y = columns / 2, rows / 2
(folder / "scene.pbrt").write_text("\n".join([
    "Scale -1 1 1", f"LookAt {half_x} {half_y} 10  {half_x} {half_y} 0  0 1 0",
    f'Camera "orthographic" "float screenwindow" [{-half_x} {half_x} {-half_y} {half_y}]',
    f'Film "rgb" "integer xresolution" {columns * SIDE} "integer yresolution" {rows * SIDE} "string filename" "ours.exr"',
    'PixelFilter "box" "float xradius" 0.001 "float yradius" 0.001', "WorldBegin", 'LightSource "infinite"', *shapes, ""]), encoding="utf-8")
(folder / "cases.json").write_text(json.dumps({"side": SIDE, "columns": columns, "names": [n for n, _ in value_cases.CASES],
                                               "messages": [str(m) for m in context.report.messages]}), encoding="utf-8")
