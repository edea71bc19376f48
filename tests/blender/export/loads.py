"""Writes scenes that the program must load."""
import pathlib
import sys

import bpy

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parent))
from harness import add, empty_scene, material, written  # noqa: E402

scene = empty_scene()
scene.world = bpy.data.worlds.new("World")
scene.camera = add("Camera", bpy.data.cameras.new("Camera"), location=(0, -8, 1), rotation_euler=(1.5, 0, 0))
scene.camera.data.dof.use_dof = True
for kind in ("POINT", "SPOT", "SUN", "AREA"):
    add(kind, bpy.data.lights.new(kind, kind), location=(0, 0, 4))
bpy.ops.mesh.primitive_monkey_add()
monkey = bpy.context.object
monkey.data.materials.append(material('"Fur"\\'))
hair = monkey.modifiers.new("Hair", "PARTICLE_SYSTEM").particle_system.settings
hair.type, hair.count, hair.hair_length = "HAIR", 20, 0.3
monkey.visible_glossy = False
bpy.ops.mesh.primitive_cube_add(location=(3, 0, 0))
for k in range(3):
    add("Copy", bpy.context.object.data, location=(3, 0, 3 * k + 3))
written("still")
scene.render.use_motion_blur = True
for frame, where in ((0, (0, 0, 0)), (1, (1, 0, 0)), (2, (1, 1, 0))):
    monkey.location = where
    monkey.keyframe_insert("location", frame=frame)
bpy.ops.mesh.primitive_cube_add(location=(-3, 0, 0))
bent = bpy.context.object
bpy.ops.object.shade_smooth()
bent.shape_key_add(name="Basis")
key = bent.shape_key_add(name="Tall")
for point in key.data:
    point.co.z *= 3
for frame in (0, 2):
    key.value = frame / 2
    key.keyframe_insert("value", frame=frame)
scene.frame_set(1)
moving = written("moving")
assert "TransformSteps" in moving.text and '"string later"' in moving.text
