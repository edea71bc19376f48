"""Worlds as the add-on writes them, next to Cycles: radiance by direction, and the light that falls on a plane.

    blender -b --factory-startup -P worlds.py -- PACKAGE FOLDER [WORLD...]

The exported lights are evaluated here with numpy by what docs say of them, so no renderer but Cycles takes part.
"""
import math
import pathlib
import re
import sys

import bpy
import mathutils
import numpy

package, folder, *wanted = sys.argv[sys.argv.index("--") + 1:]
sys.path.insert(0, package)
from lightmill import nodes  # noqa: E402

folder = pathlib.Path(folder)
WIDE, HIGH = 24, 16
bpy.ops.wm.read_factory_settings(use_empty=True)
scene = bpy.context.scene
scene.render.engine = "CYCLES"
cycles = scene.cycles
cycles.use_denoising, cycles.use_adaptive_sampling, cycles.max_bounces = False, False, 1  # rays that leave a plane count, too
scene.render.image_settings.file_format, scene.render.image_settings.color_depth = "OPEN_EXR", "32"
scene.render.resolution_percentage = 100
eye = bpy.data.objects.new("eye", bpy.data.cameras.new("eye"))
eye.data.angle = math.radians(70)
scene.collection.objects.link(eye)
scene.camera = eye
cycles.pixel_filter_type = "BOX"


def load(path):
    """Pixels, the bottom row first."""
    image = bpy.data.images.load(str(path))
    image.colorspace_settings.name = "Non-Color"
    pixels = numpy.empty(len(image.pixels), numpy.float32)
    image.pixels.foreach_get(pixels)
    pixels = pixels.reshape(image.size[1], image.size[0], image.channels)[:, :, :3].astype(float)
    bpy.data.images.remove(image)
    return pixels


def render(width, height, samples):
    scene.render.resolution_x, scene.render.resolution_y, cycles.samples = width, height, samples
    scene.render.filepath = str(folder / "cycles.exr")
    bpy.ops.render.render(write_still=True)
    return load(folder / "cycles.exr")


class Lights:
    """What the lines of a world say, for rays of one kind."""

    def __init__(self, lines, kind):
        self.constants, self.pictures, self.suns = [], [], []
        for line in lines:
            hidden = re.search(r'"string hidden" \[([^\]]*)\]', line)
            if hidden and f'"{kind}"' in hidden[1]:
                continue
            rgb = re.search(r'"rgb L" \[([^\]]*)\]', line)
            color = numpy.array([float(x) for x in rgb[1].split()]) if rgb else None
            if '"distant"' in line:
                numbers = re.search(r'"point3 from" \[([^\]]*)\]', line)[1]
                self.suns.append((numpy.array([float(x) for x in numbers.split()]), color))
            elif '"string filename"' in line:
                file = re.search(r'"string filename" "([^"]*)"', line)[1]
                columns = re.search(r"Transform \[([^\]]*)\]", line)
                matrix = numpy.array([float(x) for x in columns[1].split()]).reshape(4, 4).T if columns else numpy.eye(4)
                self.pictures.append((load(folder / file), matrix[:3, :3], float(re.search(r'"float scale" (\S+)', line)[1])))
            else:
                self.constants.append(color)

    def radiance(self, d):
        """Along unit directions of shape (..., 3), without suns."""
        total = numpy.zeros(d.shape) + sum(self.constants, numpy.zeros(3))
        for pixels, to_world, scale in self.pictures:
            x, y, z = numpy.moveaxis(d @ to_world, -1, 0)  # the inverse of a rotation
            h, w = pixels.shape[:2]
            u, v = (0.5 - numpy.arctan2(y, x) / (2 * math.pi)) * w - 0.5, (numpy.arctan2(z, numpy.hypot(x, y)) / math.pi + 0.5) * h - 0.5
            u0, v0 = numpy.floor(u).astype(int), numpy.floor(v).astype(int)
            fu, fv = (u - u0)[..., None], (v - v0)[..., None]
            at = lambda i, k: pixels[numpy.clip(v0 + k, 0, h - 1), (u0 + i) % w]  # noqa: E731
            total += scale * ((at(0, 0) * (1 - fu) + at(1, 0) * fu) * (1 - fv) + (at(0, 1) * (1 - fu) + at(1, 1) * fu) * fv)
        return total


def view_directions():
    half = math.tan(eye.data.angle / 2)
    x = ((numpy.arange(WIDE) + 0.5) / WIDE * 2 - 1) * half
    y = ((numpy.arange(HIGH) + 0.5) / HIGH * 2 - 1) * half * HIGH / WIDE
    d = numpy.stack([numpy.broadcast_to(x, (HIGH, WIDE)), numpy.broadcast_to(y[:, None], (HIGH, WIDE)), -numpy.ones((HIGH, WIDE))], axis=2)
    d /= numpy.linalg.norm(d, axis=2, keepdims=True)
    return d @ numpy.array(eye.matrix_world.to_3x3()).T


def on_plane(lights, normal):
    """Irradiance over pi, from a sum over all directions."""
    high = 256
    v, u = (numpy.arange(high) + 0.5) / high, (numpy.arange(2 * high) + 0.5) / (2 * high)
    up, around = (v - 0.5) * math.pi, 2 * math.pi * u
    d = numpy.stack([numpy.cos(up)[:, None] * numpy.cos(around), numpy.cos(up)[:, None] * numpy.sin(around), numpy.broadcast_to(numpy.sin(up)[:, None], (high, 2 * high))], axis=2)
    cosine = numpy.maximum(d @ normal, 0) * numpy.cos(up)[:, None]
    total = (lights.radiance(d) * cosine[..., None]).sum(axis=(0, 1)) * (math.pi / high) ** 2
    for to, irradiance in lights.suns:
        total = total + irradiance * max(to @ normal, 0)
    return total / math.pi


def tree():
    world = bpy.data.worlds.new("world")
    world.use_nodes = True
    world.cycles.sampling_method, world.cycles.sample_map_resolution = "MANUAL", 256
    scene.world = world
    return world.node_tree


def background(t, socket, strength=1.0):
    node = t.nodes["Background"]
    t.links.new(socket, node.inputs[0])
    node.inputs[1].default_value = strength


def sky(kind, strength=0.1, **settings):
    def build():
        t = tree()
        node = t.nodes.new("ShaderNodeTexSky")
        node.sky_type = kind
        for name, value in settings.items():
            setattr(node, name, value)
        background(t, node.outputs[0], strength)

    return build


def environment(t):
    if "environment" not in bpy.data.images:
        y, x = numpy.mgrid[0:32, 0:64]
        pixels = numpy.ones((32, 64, 4), "f4")
        pixels[..., 0], pixels[..., 1], pixels[..., 2] = 0.3 + 0.2 * numpy.sin(x / 64 * 2 * math.pi), 0.3 + y / 64, 0.2 + y / 53
        image = bpy.data.images.new("environment", 64, 32, float_buffer=True)
        image.pixels.foreach_set(pixels.ravel())
        image.pack()
    node = t.nodes.new("ShaderNodeTexEnvironment")
    node.image = bpy.data.images["environment"]
    return node


def turned(kind, scale=(1, 1, 1)):
    def build():
        t = tree()
        node, mapping, coordinates = environment(t), t.nodes.new("ShaderNodeMapping"), t.nodes.new("ShaderNodeTexCoord")
        mapping.vector_type, mapping.inputs["Rotation"].default_value, mapping.inputs["Scale"].default_value = kind, (0.3, -0.8, 1.9), scale
        t.links.new(coordinates.outputs["Generated"], mapping.inputs[0])
        t.links.new(mapping.outputs[0], node.inputs[0])
        background(t, node.outputs[0], 1.5)

    return build


def plain_environment():
    t = tree()
    background(t, environment(t).outputs[0], 0.7)


def gradient():
    t = tree()
    coordinates, ramp, z = t.nodes.new("ShaderNodeTexCoord"), t.nodes.new("ShaderNodeValToRGB"), t.nodes.new("ShaderNodeSeparateXYZ")
    t.links.new(coordinates.outputs["Generated"], z.inputs[0])
    t.links.new(z.outputs[2], ramp.inputs[0])
    ramp.color_ramp.elements[0].color, ramp.color_ramp.elements[1].color = (0.8, 0.4, 0.2, 1), (0.1, 0.3, 0.9, 1)
    background(t, ramp.outputs[0])


def camera_apart(picture):
    def build():
        t = tree()
        mix, path, seen = t.nodes.new("ShaderNodeMixShader"), t.nodes.new("ShaderNodeLightPath"), t.nodes.new("ShaderNodeBackground")
        seen.inputs[0].default_value = (0, 0, 0.3, 1)
        t.nodes["Background"].inputs[0].default_value = (0.8, 0.7, 0.6, 1)
        if picture:
            checker = t.nodes.new("ShaderNodeTexGradient")
            t.links.new(t.nodes.new("ShaderNodeTexCoord").outputs["Generated"], checker.inputs[0])
            t.links.new(checker.outputs[0], seen.inputs[0])
        t.links.new(path.outputs["Is Camera Ray"], mix.inputs[0])
        t.links.new(t.nodes["Background"].outputs[0], mix.inputs[1])
        t.links.new(seen.outputs[0], mix.inputs[2])
        t.links.new(mix.outputs[0], t.nodes["World Output"].inputs[0])

    return build


def constant():
    t = tree()
    t.nodes["Background"].inputs[0].default_value, t.nodes["Background"].inputs[1].default_value = (0.2, 0.4, 0.6, 1), 1.7


WORLDS = {"constant": constant, "environment": plain_environment, "environment, turned (point)": turned("POINT"), "environment, turned (texture)": turned("TEXTURE"),
          "environment, scaled": turned("POINT", (1, 1, 0.6)), "gradient": gradient, "camera apart": camera_apart(False), "camera apart, a picture": camera_apart(True),
          "Preetham": sky("PREETHAM"), "Hosek and Wilkie": sky("HOSEK_WILKIE"), "Nishita": sky("NISHITA", sun_disc=False),
          "Nishita, a high sun": sky("NISHITA", sun_elevation=1.1, sun_rotation=2.2, sun_intensity=0.3), "Nishita, a low sun": sky("NISHITA", sun_elevation=0.15, sun_rotation=-0.7)}
# Drawn by a Blender of its own; the others are told from the tree.
WRITTEN = {"constant", "environment", "environment, turned (point)", "environment, turned (texture)", "camera apart"}
VIEWS = [(1.4, 0, 0.3), (1.9, 0.2, 2.5)]
bad = 0
plane = bpy.data.meshes.new("plane")
plane.from_pydata([(-9, -9, 0), (9, -9, 0), (9, 9, 0), (-9, 9, 0)], [], [(0, 1, 2, 3)])
floor = bpy.data.objects.new("floor", plane)
white = bpy.data.materials.new("white")
white.diffuse_color = (1, 1, 1, 1)
plane.materials.append(white)
floor.location = (0, 0, -50)  # outside of all views
scene.collection.objects.link(floor)

for name, build in WORLDS.items():
    if wanted and name not in wanted:
        continue
    build()
    context = nodes.Context(folder, scene, bpy.context.evaluated_depsgraph_get())
    from lightmill.nodes.drawn import world_picture

    world_picture._kept.clear()
    found = nodes.world(scene.world, context)
    drawn = bool(world_picture._kept)
    seen, lit = Lights(found.lines, "camera"), Lights(found.lines, "diffuse")
    worst, mean = 0.0, []
    floor.hide_render = True
    for node in scene.world.node_tree.nodes:
        if node.type == "TEX_SKY":
            had_sun, node.sun_disc = node.sun_disc, False
    for view in VIEWS:
        eye.rotation_euler = view
        bpy.context.view_layer.update()
        theirs, ours = render(WIDE, HIGH, 64), seen.radiance(view_directions())
        # The horizon and other edges lie within a few pixels.
        worst = max(worst, float(numpy.percentile(numpy.abs(ours - theirs) / (theirs + 0.05 * theirs.mean() + 1e-6), 85)))
        mean.append(ours.mean() / theirs.mean())
    for node in scene.world.node_tree.nodes:
        if node.type == "TEX_SKY":
            node.sun_disc = had_sun
    floor.hide_render = False
    ratios = []
    for tilt in (0.0, 0.9):
        floor.rotation_euler = (tilt, 0, 0.5)
        eye.location, eye.rotation_euler, eye.data.angle = (0, 0, -48.9), (0, 0, 0), 0.05
        bpy.context.view_layer.update()
        normal = numpy.array(floor.matrix_world.to_3x3() @ mathutils.Vector((0, 0, 1)))
        theirs = render(2, 2, 2048).mean(axis=(0, 1))
        ratios.append(on_plane(lit, normal) / theirs)
        eye.location, eye.data.angle = (0, 0, 0), math.radians(70)
    off = float(numpy.abs(numpy.array(ratios) - 1).max())
    good = worst < 0.02 and max(abs(m - 1) for m in mean) < 0.01 and off < 0.02 and not context.report.messages and drawn != (name in WRITTEN)
    bad += not good
    print(f'{"ok  " if good else "FAIL"} {name:32s} views: mean {min(mean):.4f} to {max(mean):.4f}, 85 % within {worst:.4f}; planes within {off:.4f}; '
          f'{len(lit.suns)} suns, {len(found.lines)} lights{", drawn" if drawn else ""} {[str(m) for m in context.report.messages]}', flush=True)
if bad:
    sys.exit(f"{bad} worlds differ from Cycles")
