"""Motion blur."""
import pathlib
import re
import sys

import bpy
import numpy as np

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parent))
from harness import add, points, read_ply, run, written  # noqa: E402


def moving_cube():
    scene = bpy.context.scene
    scene.render.use_motion_blur, scene.render.motion_blur_shutter = True, 0.5
    bpy.ops.mesh.primitive_cube_add()
    return bpy.context.object


def keyed(thing, path, values):
    """Linear keys at frames 1, 2, ...; the scene stands at 2."""
    for k, value in enumerate(values):
        setattr(thing, path, value)
        thing.keyframe_insert(path, frame=k + 1)
    for curve in thing.animation_data.action.fcurves:
        for key in curve.keyframe_points:
            key.interpolation = "LINEAR"
    bpy.context.scene.frame_set(2)


def test_even_motion_is_two_transforms():
    keyed(moving_cube(), "location", [(0, 0, 0), (2, 0, 0), (4, 0, 0)])
    text = written().text
    first, last = (re.search(rf"ActiveTransform {t}\nTransform \[(.*)\]", text).group(1).split()[12:15]
                   for t in ("StartTime", "EndTime"))
    assert np.allclose(np.array(first, float), (1.5, 0, 0)) and np.allclose(np.array(last, float), (2.5, 0, 0))
    assert bpy.context.scene.frame_current == 2 and bpy.context.scene.frame_subframe == 0


def test_position_of_the_shutter():
    keyed(moving_cube(), "location", [(0, 0, 0), (2, 0, 0), (4, 0, 0)])
    bpy.context.scene.cycles.motion_blur_position = "START"
    text = written().text
    assert float(re.search(r"EndTime\nTransform \[(.*)\]", text).group(1).split()[12]) == 3


def test_uneven_motion_has_steps():
    keyed(moving_cube(), "location", [(0, 0, 0), (2, 0, 0), (2, 4, 0)])
    numbers = re.search(r"TransformSteps 3 \[(.*)\]", written().text).group(1).split()
    places = np.array(numbers, float).reshape(3, 16)[:, 12:15]
    assert np.allclose(places, [(1.5, 0, 0), (2, 0, 0), (2, 1, 0)])


def test_a_turn_has_steps():
    keyed(moving_cube(), "rotation_euler", [(0, 0, 0), (0, 0, 1), (0, 0, 2)])
    assert "TransformSteps 3" in written().text


def test_a_moving_camera():
    scene = bpy.context.scene
    camera = scene.camera = add("Camera", bpy.data.cameras.new("Camera"))
    scene.render.use_motion_blur = True
    keyed(camera, "location", [(0, 0, 1), (0, 0, 2), (0, 0, 3)])
    head = written().text.split("WorldBegin")[0]
    assert "ActiveTransform StartTime" in head and "Camera" in head.split("ActiveTransform All")[1]


def test_a_mesh_that_bends():
    thing = moving_cube()
    thing.shape_key_add(name="Basis")
    key = thing.shape_key_add(name="Tall")
    for point in key.data:
        point.co.z *= 3
    for frame, value in ((1, 0), (2, 0.5), (3, 1)):
        key.value = value
        key.keyframe_insert("value", frame=frame)
    for curve in thing.data.shape_keys.animation_data.action.fcurves:
        for k in curve.keyframe_points:
            k.interpolation = "LINEAR"
    bpy.context.scene.frame_set(2)
    out = written()
    names = re.search(r'"string filename" "(.*?)" "string later" \["(.*?)" "(.*?)"\]', out.text).groups()
    heights = [points(read_ply(out.folder / name))[:, 2].max() for name in names]
    assert np.allclose(heights, [1.75, 2, 2.25], atol=1e-5)


def test_no_blur_without_the_switch():
    keyed(moving_cube(), "location", [(0, 0, 0), (2, 0, 0), (2, 4, 0)])
    bpy.context.scene.render.use_motion_blur = False
    text = written().text
    assert "ActiveTransform" not in text and "TransformSteps" not in text


run(sys.modules[__name__])
