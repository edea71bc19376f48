"""Whole scenes for Blender, made by script: a room lit through a window, and caustics of glass. Runs inside Blender.

    blender -b --factory-startup -P whole_scenes.py -- FOLDER

FOLDER gets window.blend and glass.blend.
"""
import math
import pathlib
import sys

import bpy
from mathutils import Vector


def empty():
    bpy.ops.wm.read_factory_settings(use_empty=True)
    scene = bpy.context.scene
    scene.world = bpy.data.worlds.new("World")
    scene.world.use_nodes = True
    scene.world.node_tree.nodes["Background"].inputs["Strength"].default_value = 0
    scene.render.resolution_x, scene.render.resolution_y = 480, 320
    return scene


def material(name, color, *, roughness=0.5, metallic=0.0, transmission=0.0):
    made = bpy.data.materials.new(name)
    made.use_nodes = True
    inputs = made.node_tree.nodes["Principled BSDF"].inputs
    inputs["Base Color"].default_value = (*color, 1)
    inputs["Roughness"].default_value, inputs["Metallic"].default_value = roughness, metallic
    inputs["Transmission"].default_value = transmission
    return made


def wear(thing, worn, *, smooth=False):
    thing.data.materials.append(worn)
    if smooth:
        for face in thing.data.polygons:
            face.use_smooth = True
    return thing


def box(low, high, worn):
    low, high = Vector(low), Vector(high)
    bpy.ops.mesh.primitive_cube_add(size=1, location=(low + high) / 2)
    made = bpy.context.object
    made.scale = high - low
    return wear(made, worn)


def camera(scene, place, at, lens):
    data = bpy.data.cameras.new("Camera")
    data.lens = lens
    made = bpy.data.objects.new("Camera", data)
    scene.collection.objects.link(made)
    made.location = place
    made.rotation_euler = (Vector(at) - Vector(place)).to_track_quat("-Z", "Y").to_euler()
    scene.camera = made


def window():
    """A room of 4 x 5 x 2.8 with one window, under a clear sky; the sun falls in."""
    scene = empty()
    nodes, links = scene.world.node_tree.nodes, scene.world.node_tree.links
    sky = nodes.new("ShaderNodeTexSky")
    sky.sky_type, sky.sun_elevation, sky.sun_rotation = "NISHITA", math.radians(35), math.radians(-60)
    links.new(sky.outputs["Color"], nodes["Background"].inputs["Color"])
    nodes["Background"].inputs["Strength"].default_value = 0.3
    wall, red = material("Wall", (0.75, 0.72, 0.68), roughness=0.8), material("Carpet", (0.5, 0.1, 0.08), roughness=0.9)
    wood, steel = material("Wood", (0.35, 0.2, 0.1), roughness=0.35), material("Steel", (0.8, 0.8, 0.82), roughness=0.2, metallic=1)
    box((-2, 0, -0.1), (2, 5, 0), wood)
    box((-2, 0, 2.8), (2, 5, 2.9), wall)
    box((2, 0, 0), (2.1, 5, 2.8), wall)
    box((-2, 5, 0), (2, 5.1, 2.8), wall)
    box((-2, -0.1, 0), (2, 0, 2.8), wall)
    for low, high in (((-2.2, 0, 0), (-2, 5, 0.9)), ((-2.2, 0, 2.3), (-2, 5, 2.8)), ((-2.2, 0, 0.9), (-2, 1.8, 2.3)),
                      ((-2.2, 3.4, 0.9), (-2, 5, 2.3))):
        box(low, high, wall)
    box((-1.2, 1.5, 0), (1, 3.8, 0.02), red)
    box((0.1, 2.6, 0.7), (1.5, 3.8, 0.75), wood)
    for x in (0.15, 1.4):
        for y in (2.65, 3.7):
            box((x, y, 0), (x + 0.06, y + 0.06, 0.7), wood)
    bpy.ops.mesh.primitive_uv_sphere_add(segments=64, ring_count=32, radius=0.22, location=(0.6, 3.1, 0.97))
    wear(bpy.context.object, steel, smooth=True)
    bpy.ops.mesh.primitive_monkey_add(size=0.7, location=(1.1, 3.4, 1.02), rotation=(0, 0, math.radians(-30)))
    wear(bpy.context.object, material("Clay", (0.6, 0.45, 0.3), roughness=0.6), smooth=True)
    camera(scene, (0.4, 0.25, 1.5), (-0.1, 4, 0.9), 24)


def glass():
    """A ball, a ring and a jar of glass on a table, under a lamp of 10 cm."""
    scene = empty()
    scene.world.node_tree.nodes["Background"].inputs["Strength"].default_value = 0.05
    table = material("Table", (0.7, 0.66, 0.6), roughness=0.7)
    clear = bpy.data.materials.new("Glass")
    clear.use_nodes = True
    nodes, links = clear.node_tree.nodes, clear.node_tree.links
    shader = nodes.new("ShaderNodeBsdfGlass")
    shader.inputs["Roughness"].default_value, shader.inputs["IOR"].default_value = 0, 1.5
    links.new(shader.outputs["BSDF"], nodes["Material Output"].inputs["Surface"])
    box((-4, -4, -0.1), (4, 4, 0), table)
    box((-4, 3, 0), (4, 3.1, 4), table)
    bpy.ops.mesh.primitive_uv_sphere_add(segments=128, ring_count=64, radius=0.5, location=(-0.9, 0.3, 0.5))
    wear(bpy.context.object, clear, smooth=True)
    bpy.ops.mesh.primitive_torus_add(major_radius=0.45, minor_radius=0.13, major_segments=128, minor_segments=48,
                                     location=(0.3, -0.6, 0.13))
    wear(bpy.context.object, clear, smooth=True)
    bpy.ops.mesh.primitive_cylinder_add(vertices=128, radius=0.35, depth=0.9, location=(1.1, 0.7, 0.455))
    wear(bpy.context.object, clear)
    lamp = bpy.data.lights.new("Lamp", "AREA")
    lamp.shape, lamp.size, lamp.energy = "DISK", 0.1, 150
    made = bpy.data.objects.new("Lamp", lamp)
    scene.collection.objects.link(made)
    made.location = (-1.5, -1.5, 3)
    made.rotation_euler = (-made.location).to_track_quat("-Z", "Y").to_euler()
    camera(scene, (0.3, -4.2, 2.2), (0.1, 0.2, 0.35), 45)


def main():
    folder = pathlib.Path(sys.argv[sys.argv.index("--") + 1])
    for make in (window, glass):
        make()
        bpy.ops.wm.save_as_mainfile(filepath=str(folder / f"{make.__name__}.blend"))


main()
