"""Cameras and film. The oracle for cameras is Blender's own world_to_camera_view."""
import math
import pathlib
import re
import sys

import bpy
import mathutils
import numpy as np
from bpy_extras.object_utils import world_to_camera_view

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parent))
from harness import add, run, written  # noqa: E402


def camera(**settings):
    scene = bpy.context.scene
    thing = scene.camera = add("Camera", bpy.data.cameras.new("Camera"), location=(3, -4, 2), rotation_euler=(1, 0.2, 0.5))
    for key, value in settings.items():
        setattr(thing.data, key, value)
    return thing


def numbers(text, name):
    return np.array(re.search(rf"{name}\S* \[(.*?)\]", text).group(1).split(), float)


def where(text, point, orthographic):
    """Where the written camera sees a point: 0 to 1 from the left and from below."""
    matrix = numbers(text, "Transform").reshape(4, 4).T
    x, y, z, _ = matrix @ (*point, 1)
    left, right, bottom, top = numbers(text, '"float screenwindow')
    assert z > 0
    if not orthographic:
        x, y = x / z, y / z
    return (x - left) / (right - left), (y - bottom) / (top - bottom)


def test_cameras_are_where_blenders_are():
    scene = bpy.context.scene
    render = scene.render
    cases = [{}, {"lens": 20}, {"sensor_fit": "VERTICAL"}, {"sensor_fit": "HORIZONTAL", "sensor_height": 30},
             {"sensor_fit": "VERTICAL", "sensor_height": 30, "shift_x": 0.2}, {"shift_x": 0.3, "shift_y": -0.2},
             {"type": "ORTHO", "ortho_scale": 5}, {"type": "ORTHO", "ortho_scale": 5, "shift_y": 0.1, "sensor_fit": "VERTICAL"}]
    for size in ((200, 100), (100, 200)):
        for aspect in ((1, 1), (2, 1), (1, 1.5)):
            for settings in cases:
                bpy.ops.wm.read_factory_settings(use_empty=True)
                scene = bpy.context.scene
                render = scene.render
                thing = camera(**settings)
                render.resolution_x, render.resolution_y = size
                render.pixel_aspect_x, render.pixel_aspect_y = aspect
                text = written("camera").text
                for offset in ((0, 0, -5), (1, 0.5, -4), (-1, 1, -7)):
                    point = thing.matrix_world @ mathutils.Vector(offset)
                    theirs = world_to_camera_view(scene, thing, point)
                    ours = where(text, point, thing.data.type == "ORTHO")
                    assert np.allclose(ours, theirs[:2], atol=1e-4), (size, aspect, settings, ours, tuple(theirs))


def test_a_scaled_camera_is_not():
    thing = camera()
    plain = written("scaled").text.split("WorldBegin")[0]
    thing.scale = (2, 2, 2)
    scaled = written("scaled").text.split("WorldBegin")[0]
    assert np.allclose(numbers(plain, "Transform"), numbers(scaled, "Transform"), atol=1e-5)


def test_depth_of_field():
    thing = camera(lens=50)
    dof = thing.data.dof
    dof.use_dof, dof.aperture_fstop, dof.focus_distance, dof.aperture_blades = True, 2, 4, 6
    text = written().text
    assert '"float lensradius" 0.0125 "float focaldistance" 4 "integer blades" 6' in text
    dof.focus_object = add("Focus", None, location=thing.matrix_world @ mathutils.Vector((1, 1, -7)))
    assert float(re.search(r'focaldistance" (\S+)', written().text).group(1)) == 7


def test_panoramas():
    thing = camera(type="PANO")
    settings = thing.data.cycles if hasattr(thing.data.cycles, "panorama_type") else thing.data
    settings.panorama_type = "EQUIRECTANGULAR"
    assert '"spherical" "string mapping" "equirectangular" "float longitudemin" -180' in written().text
    settings.panorama_type, settings.fisheye_fov = "FISHEYE_EQUIDISTANT", math.radians(120)
    assert re.search(r'"fisheye" "string projection" "equidistant" "float fov" 120', written().text)


def test_film():
    scene = bpy.context.scene
    render = scene.render
    camera()
    render.resolution_x, render.resolution_y, render.resolution_percentage = 201, 100, 50
    render.use_border = True
    render.border_min_x, render.border_max_x, render.border_min_y, render.border_max_y = 0.25, 0.5, 0, 0.75
    scene.cycles.film_exposure = 2
    text = written().text
    assert '"integer xresolution" 100 "integer yresolution" 50' in text and '"float iso" 200' in text
    assert np.allclose(numbers(text, '"float cropwindow'), (0.25, 0.5, 0.25, 1))
    text = written(size=(30, 20)).text
    assert '"integer xresolution" 30 "integer yresolution" 20' in text and "cropwindow" not in text


def test_filters():
    scene = bpy.context.scene
    scene.cycles.filter_width = 2
    x = np.linspace(-1, 1, 2001)
    turn = np.pi * (x + 1)
    theirs = 0.35875 - 0.48829 * np.cos(turn) + 0.14128 * np.cos(2 * turn) - 0.01168 * np.cos(3 * turn)
    assert scene.cycles.pixel_filter_type == "BLACKMAN_HARRIS"
    radius, sigma = (float(re.search(rf'"float {n}" (\S+)', written().text).group(1)) for n in ("xradius", "sigma"))
    ours = np.exp(-x * x / (2 * sigma ** 2)) - np.exp(-1 / (2 * sigma ** 2))
    assert radius == 1 and np.abs(ours / ours.sum() - theirs / theirs.sum()).sum() < 0.02


def test_transparent_film_hides_the_world():
    scene = bpy.context.scene
    scene.world = bpy.data.worlds.new("World")
    scene.world.color = (1, 1, 1)
    scene.render.film_transparent = True
    assert re.search(r'LightSource "infinite".*"string hidden" \["camera"\]', written().text)


def test_a_camera_of_the_engines():
    camera()
    text = written(camera='LookAt 0 0 5 0 0 0 0 1 0\nCamera "perspective"').text
    assert text.count("Camera") == 1 and "LookAt" in text


run(sys.modules[__name__])
