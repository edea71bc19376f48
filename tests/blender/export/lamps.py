"""Units of lamps: what a white floor gets from what was written, by closed forms, and from Cycles."""
import math
import pathlib
import re
import sys

import bpy
import numpy as np

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parent))
from harness import FOLDER, add, empty_scene, run, written  # noqa: E402

HEIGHT = 2.0


def lamp(kind, scale=(1, 1, 1), energy=100.0, **settings):
    """A lamp above a white floor, which an orthographic camera looks at."""
    scene = empty_scene()
    bpy.ops.mesh.primitive_plane_add(size=20)
    white = bpy.data.materials.new("White")
    white.use_nodes = True
    tree = white.node_tree
    shader = tree.nodes.new("ShaderNodeBsdfDiffuse")
    shader.inputs[0].default_value = (1, 1, 1, 1)
    tree.links.new(shader.outputs[0], tree.nodes["Material Output"].inputs[0])
    bpy.context.object.data.materials.append(white)
    camera = bpy.data.cameras.new("Camera")
    camera.type, camera.ortho_scale = "ORTHO", 0.02
    scene.camera = add("Camera", camera, location=(0, 0, 0.2))
    light = bpy.data.lights.new("Lamp", kind)
    light.energy = energy
    for key, value in settings.items():
        setattr(light, key, value)
    return add("Lamp", light, location=(0, 0, HEIGHT), scale=scale)


def cycles():
    """The floor's irradiance by Cycles."""
    scene = bpy.context.scene
    scene.render.engine, scene.cycles.samples, scene.cycles.max_bounces = "CYCLES", 256, 0
    scene.cycles.use_denoising = scene.cycles.use_adaptive_sampling = False
    scene.cycles.seed = 1
    scene.render.resolution_x = scene.render.resolution_y = 5
    scene.render.image_settings.file_format, scene.render.image_settings.color_depth = "OPEN_EXR", "32"
    scene.render.filepath = str(FOLDER / "floor.exr")
    bpy.ops.render.render(write_still=True)
    image = bpy.data.images.load(scene.render.filepath)
    pixels = np.array(image.pixels[:]).reshape(5, 5, 4)
    bpy.data.images.remove(image)
    return pixels[..., 0].mean() * math.pi


def parameter(text, name):
    return float(re.search(rf'"{name}" \[?(\S+?)[\] \n]', text).group(1))


def test_points_and_spots():
    for kind, radius in (("POINT", 0), ("POINT", 0.5), ("SPOT", 0)):
        lamp(kind, scale=(2, 2, 2), shadow_soft_size=radius)
        text = written("lamp").text
        expected = parameter(text, "rgb I") / (HEIGHT ** 2 + radius ** 2)  # of a disk that faces the floor
        assert np.isclose(cycles(), expected, rtol=0.01), (kind, radius, expected)
        assert ("float radius" in text) == (radius > 0) and '"string hidden" ["camera"]' in text


def test_suns():
    for degrees in (0, 1, 40, 120):
        lamp("SUN", energy=3.0, angle=math.radians(degrees))
        text = written("lamp").text
        assert parameter(text, "float angle") * 2 <= degrees + 1e-4
        assert np.isclose(cycles(), parameter(text, "rgb L"), rtol=0.02), degrees


def test_areas():
    for shape, width, height, scale in (("SQUARE", 0.02, 0.02, (1, 1, 1)), ("SQUARE", 0.02, 0.02, (2, 3, 1)),
                                        ("RECTANGLE", 0.02, 0.1, (1, 1, 1)), ("DISK", 0.02, 0.02, (1, 1, 1)),
                                        ("ELLIPSE", 0.02, 0.1, (1, 1, 1))):
        lamp("AREA", scale=scale, shape=shape, size=width, size_y=height)
        text = written("lamp").text
        assert np.isclose(parameter(text, "float width"), width) and np.isclose(parameter(text, "float height"), height)
        surface = width * height * scale[0] * scale[1] * (math.pi / 4 if shape in ("DISK", "ELLIPSE") else 1)
        expected = parameter(text, "rgb L") * surface / HEIGHT ** 2
        assert np.isclose(cycles(), expected, rtol=0.01), (shape, scale, expected)


def test_colours_and_what_is_dark():
    thing = lamp("POINT", shadow_soft_size=0)
    thing.data.color = (1, 0.5, 0)
    text = written("lamp").text
    found = np.array(re.search(r'"rgb I" \[(.*?)\]', text).group(1).split(), float)
    assert np.allclose(found / found[0], (1, 0.5, 0))
    thing.data.energy = 0
    # One that is black: without any the reader would put in a sky.
    assert re.findall(r"LightSource .*", written("lamp").text) == ['LightSource "infinite" "rgb L" [0 0 0]']


def test_fog_of_the_world_hides_what_is_infinitely_far():
    lamp("SUN")
    world = bpy.context.scene.world = bpy.data.worlds.new("World")
    world.use_nodes = True
    tree = world.node_tree
    assert "distant" in written("lamp").text
    fog = tree.nodes.new("ShaderNodeVolumeAbsorption")
    fog.inputs["Density"].default_value = 0.1
    tree.links.new(fog.outputs[0], tree.nodes["World Output"].inputs["Volume"])
    fog.inputs["Color"].default_value = (0, 0, 1, 1)  # blue gets through
    assert re.findall(r'LightSource "(\w+)"', written("lamp").text) == ["infinite", "distant"]
    fog.inputs["Color"].default_value = (0.5, 0.5, 0.5, 1)
    assert re.findall(r"LightSource .*", written("lamp").text) == ['LightSource "infinite" "rgb L" [0 0 0]']


run(sys.modules[__name__])
