"""Measures how bright a lamp is in every direction. Runs in a Blender of its own: see lamp_picture.py.

    blender -b --factory-startup -P draw_lamp.py -- FOLDER

The lamp stands in a white sphere of radius 1, whose light is baked. The picture is the square, equal-area one of pbrt's
goniometric lights. FOLDER has data.blend and task.json, and gets answer.json and picture.npy: W/sr, the top row first.
"""
import json
import math
import pathlib
import sys

import bpy
import numpy

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parent))
from baking import make_ready, pixels_of  # noqa: E402

QUADS = 128  # along each side of the square


def directions(side):
    """Unit vectors in the lamp's space at the corners of side x side squares (Clarberg 2008); pbrt swaps y and z."""
    v, u = numpy.mgrid[0:side + 1, 0:side + 1] / side * 2 - 1
    above = 1 - (abs(u) + abs(v))
    r = 1 - abs(above)
    turn = numpy.where(r == 0, 1, (abs(v) - abs(u)) / numpy.where(r == 0, 1, r) + 1) * math.pi / 4
    flat = r * numpy.sqrt(numpy.maximum(2 - r * r, 0))
    x, y = numpy.copysign(numpy.cos(turn), u) * flat, numpy.copysign(numpy.sin(turn), v) * flat
    z = numpy.copysign(1 - r * r, above)
    return numpy.stack([x, z, y], axis=2)


def room():
    """The sphere; the texture coordinates' v grows upwards, the picture's rows downwards."""
    points = directions(QUADS)
    corner = lambda row, column: row * (QUADS + 1) + column  # noqa: E731
    faces, maps = [], []
    for row in range(QUADS):
        for column in range(QUADS):
            around = [(row, column), (row, column + 1), (row + 1, column + 1), (row + 1, column)]
            faces.append([corner(*p) for p in around])
            maps += [c for p in around for c in (p[1] / QUADS, 1 - p[0] / QUADS)]
    mesh = bpy.data.meshes.new("room")
    mesh.from_pydata(points.reshape(-1, 3).tolist(), [], faces)
    mesh.uv_layers.new(name="square").data.foreach_set("uv", maps)
    mesh.update()
    if mesh.polygons[0].normal.dot(mesh.vertices[0].co) > 0:
        mesh.flip_normals()
    return mesh


def main():
    folder = pathlib.Path(sys.argv[sys.argv.index("--") + 1])
    task = json.loads((folder / "task.json").read_text(encoding="utf-8"))
    bpy.ops.wm.read_factory_settings(use_empty=True)
    with bpy.data.libraries.load(str(folder / "data.blend")) as (_, wanted):
        wanted.lights = [task["lamp"]]
    lamp = wanted.lights[0]
    lamp.shadow_soft_size = 0
    lamp.cycles.cast_shadow, lamp.cycles.max_bounces = False, 1024
    scene = bpy.context.scene
    scene.collection.objects.link(bpy.data.objects.new("lamp", lamp))
    white = bpy.data.materials.new("white")
    white.use_nodes = True
    nodes = white.node_tree
    shader, texture = nodes.nodes.new("ShaderNodeBsdfDiffuse"), nodes.nodes.new("ShaderNodeTexImage")
    shader.inputs["Color"].default_value = (1, 1, 1, 1)
    nodes.links.new(shader.outputs[0], nodes.get_output_node("CYCLES").inputs["Surface"])
    texture.image = bpy.data.images.new("square", task["side"], task["side"], float_buffer=True)
    texture.image.colorspace_settings.name = "Non-Color"
    nodes.nodes.active = texture
    thing = bpy.data.objects.new("room", room())
    thing.data.materials.append(white)
    scene.cycles.sample_clamp_direct = 0
    make_ready(task, thing)
    bpy.ops.object.bake(type="DIFFUSE", pass_filter={"DIRECT"}, margin=0, use_clear=True)
    # A white, diffuse wall at 1 m shows the intensity over pi.
    picture = pixels_of(texture.image).reshape(task["side"], task["side"], 4)[::-1, :, :3] * math.pi
    numpy.save(folder / "picture.npy", picture)
    (folder / "answer.json").write_text(json.dumps("picture.npy"), encoding="utf-8")


if __name__ == "__main__":
    main()
