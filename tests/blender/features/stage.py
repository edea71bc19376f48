"""The stage that every feature is shown on, and short ways to put nodes on it. Runs inside Blender (3.4).

A feature is a function that takes the stage and changes one thing:

    @feature
    def mat_blue(s):
        s.lit()
        surface(s.monkey, "BsdfDiffuse", Color=(0, 0, 1, 1))
"""
import math

import bpy
import mathutils

FEATURES = []


def feature(build):
    """Adds `build(stage)` to the features; its name names the file."""
    FEATURES.append(build)
    return build


class Stage:
    """A grey floor and a smooth, brown monkey under a dim world, before a camera. No lamp."""

    def __init__(self):
        bpy.ops.wm.read_factory_settings(use_empty=True)
        self.scene = bpy.context.scene
        self.scene.render.engine = "CYCLES"
        self.scene.render.resolution_x, self.scene.render.resolution_y = 192, 128
        self.world = self.scene.world = bpy.data.worlds.new("World")
        self.world.use_nodes = True
        self.background = self.world.node_tree.nodes["Background"]
        self.background.inputs["Color"].default_value = (0.05, 0.06, 0.08, 1)

        bpy.ops.mesh.primitive_plane_add(size=20)
        self.floor = dressed("Floor", (0.6, 0.6, 0.6))
        bpy.ops.mesh.primitive_monkey_add(size=2, location=(0, 0, 1.05))
        bpy.ops.object.shade_smooth()
        self.monkey = dressed("Body", (0.8, 0.3, 0.15))
        rounder = self.monkey.modifiers.new("Subdivision", "SUBSURF")
        rounder.levels = rounder.render_levels = 2

        self.camera = self.put(bpy.data.cameras.new("Camera"), (3.5, -5, 3))
        self.camera.data.lens = 45
        look_at(self.camera, (0, 0, 0.8))
        self.scene.camera = self.camera

    def put(self, data, location=(0, 0, 0), name=None):
        """A new object of `data` (None: an empty)."""
        thing = bpy.data.objects.new(name or (data.name if data else "Empty"), data)
        self.scene.collection.objects.link(thing)
        thing.location = location
        return thing

    def light(self, kind, energy, location=(3, -3, 4), **settings):
        """A lamp that shines at the monkey; `settings` are those of its data."""
        data = bpy.data.lights.new(kind.title(), kind)
        data.energy = energy
        for name, value in settings.items():
            setattr(data, name, value)
        lamp = self.put(data, location)
        look_at(lamp, (0, 0, 0.8))
        return lamp

    def lit(self):
        """The plain lamp of features that are not about light."""
        return self.light("POINT", 600, shadow_soft_size=0)


def look_at(thing, target):
    """Turns a lamp or a camera, which look along their -z, to the target."""
    thing.rotation_euler = (mathutils.Vector(target) - thing.location).to_track_quat("-Z", "Y").to_euler()


def principled(name, colour, **values):
    """A new material with Blender's Principled shader; `values` are its sockets, _ for blanks."""
    material = bpy.data.materials.new(name)
    material.use_nodes = True
    shader = material.node_tree.nodes["Principled BSDF"]
    shader.inputs["Base Color"].default_value = (*colour, 1)
    shader.inputs["Roughness"].default_value = 0.5
    for socket, value in values.items():
        shader.inputs[socket.replace("_", " ")].default_value = value
    return material


def dressed(name, colour, **values):
    """The object that was just added, with a Principled material."""
    thing = bpy.context.object
    thing.data.materials.append(principled(name, colour, **values))
    return thing


def cube(location, size=1, colour=(0.2, 0.4, 0.8), **transform):
    bpy.ops.mesh.primitive_cube_add(size=size, location=location, **transform)
    return dressed("Cube", colour)


def sphere(location, radius=1, colour=(0.2, 0.4, 0.8)):
    bpy.ops.mesh.primitive_uv_sphere_add(radius=radius, location=location, segments=48, ring_count=24)
    bpy.ops.object.shade_smooth()
    return dressed("Sphere", colour)


def tree(thing):
    """The nodes of the thing's first material."""
    return thing.data.materials[0].node_tree


def add(nodes, kind, **values):
    """A new shader node (`kind` without "ShaderNode"); `values` are its sockets, _ for blanks."""
    node = nodes.nodes.new("ShaderNode" + kind)
    for socket, value in values.items():
        node.inputs[socket.replace("_", " ")].default_value = value
    return node


def link(nodes, output, thing, socket=0):
    """Links `output` (a socket, or a node for its first one) to a socket of a node."""
    nodes.links.new(output if isinstance(output, bpy.types.NodeSocket) else output.outputs[0], thing.inputs[socket])


def surface(thing, kind, **values):
    """A new shader in place of the thing's own; returns its node."""
    nodes = tree(thing)
    node = add(nodes, kind, **values)
    link(nodes, node, nodes.nodes["Material Output"], "Surface")
    return node


def base_color(thing, socket):
    link(tree(thing), socket, tree(thing).nodes["Principled BSDF"], "Base Color")


def radians(degrees):
    return math.radians(degrees)
