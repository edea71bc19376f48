"""Meshes, instances, hair and names."""
import pathlib
import re
import sys

import bpy
import numpy as np

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parent))
from harness import FOLDER, add, export, material, points, run, written  # noqa: E402


def cube(name="Cube", **settings):
    bpy.ops.mesh.primitive_cube_add(**settings)
    bpy.context.object.name = name
    return bpy.context.object


def test_a_cube_is_twelve_triangles_that_face_outwards():
    cube()
    (mesh,) = written().meshes()
    corners = points(mesh)[mesh["triangles"]]
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    assert len(normals) == 12 and "nx" not in mesh and len(mesh["x"]) == 8
    assert (np.einsum("ij,ij->i", normals, corners.mean(axis=1)) > 0).all()
    assert np.isclose(np.linalg.norm(normals, axis=1).sum() / 2, 24)


def test_smooth_normals_are_the_spheres():
    bpy.ops.mesh.primitive_uv_sphere_add(segments=32, ring_count=16)
    bpy.ops.object.shade_smooth()
    (mesh,) = written().meshes()
    assert np.abs(points(mesh, "nx", "ny", "nz") - points(mesh)).max() < 0.01


def test_sharp_edges_split_normals():
    thing = cube()
    bpy.ops.object.shade_smooth()
    if hasattr(thing.data, "use_auto_smooth"):
        thing.data.use_auto_smooth, thing.data.auto_smooth_angle = True, 0.5
    (mesh,) = written().meshes()
    normals = np.abs(points(mesh, "nx", "ny", "nz"))
    assert len(normals) == 24 and np.allclose(np.sort(normals, axis=1), [0, 0, 1], atol=1e-3)


def test_uv_maps_and_attributes_that_materials_name():
    bpy.ops.mesh.primitive_plane_add(size=2)
    thing = bpy.context.object
    second = thing.data.uv_layers.new(name="Second")
    second.data.foreach_set("uv", [0.25] * 8)
    colors = thing.data.color_attributes.new("Colours", "FLOAT_COLOR", "POINT")
    colors.data.foreach_set("color", [x for v in thing.data.vertices for x in (*v.co, 0.5)])
    found = material("M")
    thing.data.materials.append(found)
    nodes, links = found.node_tree.nodes, found.node_tree.links
    shader = nodes["Principled BSDF"]
    uv, color, image = nodes.new("ShaderNodeUVMap"), nodes.new("ShaderNodeVertexColor"), nodes.new("ShaderNodeTexChecker")
    uv.uv_map, color.layer_name = "Second", "Colours"
    links.new(uv.outputs[0], image.inputs["Vector"])
    links.new(color.outputs[0], image.inputs["Color1"])
    links.new(image.outputs[0], shader.inputs["Base Color"])
    (mesh,) = written().meshes()
    assert np.allclose(points(mesh, "u", "v"), (points(mesh, "x", "y") + 1) / 2)
    assert np.allclose(points(mesh, "u2", "v2"), 0.25)
    assert np.allclose(points(mesh, "red", "green", "blue"), points(mesh)) and np.allclose(mesh["alpha"], 0.5)


def test_files_have_owners():
    cube("Box")
    found = written()
    assert list(found.result.owners.values()) == ["Box"] and all(name in found.text for name in found.result.owners)


def made_value(thing, output):
    """The values that the mesh carries for an output of the Geometry node."""
    found = material("M")
    thing.data.materials.append(found)
    nodes, links = found.node_tree.nodes, found.node_tree.links
    links.new(nodes.new("ShaderNodeNewGeometry").outputs[output], nodes["Principled BSDF"].inputs["Roughness"])
    (mesh,) = written().meshes()
    return mesh, mesh["red"]


def test_pointiness():
    # Corners of a cube: their three edges lie at the same angle to the normal, on the inner side.
    mesh, values = made_value(cube(), "Pointiness")
    mean = np.linalg.norm([1, 1, 1]) / 3  # of the edges, along the normal
    assert np.allclose(values, 1 - np.arccos(mean) / np.pi, atol=1e-4)


def test_pointiness_of_what_is_flat():
    bpy.ops.mesh.primitive_grid_add(x_subdivisions=4, y_subdivisions=4)
    _, values = made_value(bpy.context.object, "Pointiness")
    assert np.allclose(values, 0.5, atol=1e-4)


def test_random_per_island():
    bpy.ops.mesh.primitive_cube_add()
    one = bpy.context.object
    bpy.ops.mesh.primitive_cube_add(location=(5, 0, 0))
    bpy.context.object.select_set(True)
    one.select_set(True)
    bpy.context.view_layer.objects.active = one
    bpy.ops.object.join()
    mesh, values = made_value(one, "Random Per Island")
    left = mesh["x"] < 2
    assert len(set(values[left])) == 1 and len(set(values[~left])) == 1 and values[left][0] != values[~left][0]


def test_each_used_slot_is_a_mesh():
    thing = cube()
    for k in range(3):
        thing.data.materials.append(material(f"M{k}", (0.2 * k, 0, 0)))
    thing.data.polygons[2].material_index = 2
    thing.data.polygons[3].material_index = 2
    out = written()
    assert [len(m["triangles"]) for m in out.meshes()] == [8, 4]
    assert len(set(re.findall(r'NamedMaterial ("[^"]*")\nShape', out.text))) == 2


def test_instances_share_their_mesh():
    thing = cube()
    for k in range(1, 5):
        add(f"Copy{k}", thing.data, location=(3 * k, 0, 0))
    group = bpy.data.collections.new("Group")
    group.objects.link(thing)
    empty = add("Empty", None, location=(0, 5, 0))
    empty.instance_type, empty.instance_collection = "COLLECTION", group
    out = written()
    assert len(out.meshes()) == 1 and out.text.count("ObjectBegin") == 1
    places = re.findall(r"Transform \[(.*)\]\nObjectInstance", out.text)
    assert sorted(tuple(map(float, p.split()[12:15])) for p in places) == sorted(
        [(3.0 * k, 0, 0) for k in range(5)] + [(0, 5, 0)])


def test_what_emits_is_no_instance():
    thing = cube()
    found = material("Lamp")
    found.node_tree.nodes["Principled BSDF"].inputs["Emission"].default_value = (1, 1, 1, 1)
    thing.data.materials.append(found)
    add("Copy", thing.data, location=(3, 0, 0))
    out = written()
    assert "ObjectInstance" not in out.text and out.text.count("AreaLightSource") == 2 and len(out.meshes()) == 1


def test_particles_are_instances():
    shown = cube("Shown", size=0.1)
    shown.location = (9, 9, 9)
    bpy.ops.mesh.primitive_plane_add(size=4)
    system = bpy.context.object.modifiers.new("Particles", "PARTICLE_SYSTEM").particle_system.settings
    system.count, system.frame_start, system.frame_end, system.lifetime = 12, 0, 0, 100
    system.physics_type, system.render_type, system.instance_object = "NO", "OBJECT", shown
    bpy.context.scene.frame_set(5)
    assert written().text.count("ObjectInstance") == 13


def test_text_curves_and_metaballs_are_meshes():
    bpy.ops.object.text_add()
    bpy.ops.object.metaball_add(location=(3, 0, 0))
    bpy.ops.curve.primitive_bezier_circle_add()
    bpy.context.object.data.bevel_depth = 0.1
    bpy.ops.surface.primitive_nurbs_surface_sphere_add()
    assert len(written().meshes()) == 4


def hair_scene(count=10):
    thing = cube()
    settings = thing.modifiers.new("Hair", "PARTICLE_SYSTEM").particle_system.settings
    settings.type, settings.count, settings.hair_length = "HAIR", count, 0.5
    settings.root_radius, settings.tip_radius, settings.radius_scale = 2, 1, 0.01
    settings.use_close_tip = False
    return thing


def test_hair_goes_through_its_points():
    hair_scene()
    out = written()
    (name,) = re.findall(r'Include "(curves/\w+\.pbrt)"', out.text)
    strands = re.findall(r"point3 P\" \[(.*?)\] \"float width0\" (\S+) \"float width1\" (\S+)", (out.folder / name).read_text())
    assert len(strands) == 10
    for numbers, root, tip in strands:
        control = np.array(numbers.split(), float).reshape(-1, 3)
        assert len(control) % 3 == 1 and np.isclose(np.abs(control[0]).max(), 1, atol=1e-3)  # on the cube
        assert np.isclose(np.linalg.norm(control[-1] - control[0]), 0.5, rtol=0.02)
        assert float(root) == 0.02 and float(tip) == 0.01


def test_hair_of_the_viewport():
    hair_scene()
    scene = bpy.context.scene
    result = export.export_frame(bpy.context.evaluated_depsgraph_get(), scene, scene.view_layers[0], FOLDER / "viewport")
    (name,) = re.findall(r'Include "(curves/\w+\.pbrt)"', result.main.read_text())
    for numbers in re.findall(r"point3 P\" \[(.*?)\]", (result.main.parent / name).read_text()):
        control = np.array(numbers.split(), float).reshape(-1, 3)
        assert np.isclose(np.linalg.norm(control[-1] - control[0]), 0.5, rtol=0.02)


def test_hair_objects():
    curves = bpy.data.hair_curves.new("Curves")
    if not hasattr(curves, "add_curves"):
        return  # before Blender 3.6 scripts can't make strands
    curves.add_curves([3, 2])
    curves.position_data.foreach_set("vector", np.arange(15, dtype="f4"))
    add("Curves", curves)
    out = written()
    (name,) = re.findall(r'Include "(curves/\w+\.pbrt)"', out.text)
    assert (out.folder / name).read_text().count("Shape") == 2


def test_bad_vertices_and_faces_are_dropped_and_named():
    mesh = bpy.data.meshes.new("Bad")
    mesh.from_pydata([(0, 0, 0), (1, 0, 0), (0, 1, 0), (2, 0, 0), (5, 5, 5)], [], [(0, 1, 2), (0, 1, 3), (0, 1, 4)])
    mesh.vertices[4].co = (float("nan"), 0, float("inf"))
    add("Bad", mesh)
    out = written()
    (found,) = out.meshes()
    assert len(found["triangles"]) == 1 and np.isfinite(points(found)).all()
    assert out.messages["vertices that are not finite"].object == "Bad"
    assert out.messages["faces without area"].object == "Bad"


def test_flat_objects_are_named():
    cube().scale = (1, 0, 1)
    out = written()
    assert not out.meshes() and "flat object" in out.messages


def test_names_of_any_script():
    names = ['quote"and\\slash', "新しい 物体", "line\nbreak", "#comment", "Ω̈[0]"]
    for k, name in enumerate(names):
        thing = cube(location=(3 * k, 0, 0))
        thing.name = thing.data.name = name
        thing.data.materials.append(material(name))
        add(name, thing.data, location=(3 * k, 4, 0))
    out = written()
    assert out.text.count("ObjectBegin") == len(names) and out.text.count("ObjectInstance") == 2 * len(names)
    outside_of_strings = re.sub(r'"(\\.|[^"\\\n])*"', "", out.text.split("\n", 1)[1])
    assert '"' not in outside_of_strings and "#" not in outside_of_strings


def test_visibility():
    cube().visible_shadow = False
    thing = cube(location=(3, 0, 0))
    thing.visible_camera = thing.visible_glossy = False
    hidden = cube(location=(6, 0, 0))
    hidden.hide_render = True
    out = written()
    assert '"string hidden" ["shadow"]' in out.text and '"string hidden" ["camera" "glossy"]' in out.text
    assert out.text.count("Shape ") == 2


def test_an_empty_scene():
    scene = bpy.context.scene
    result = export.export_frame(bpy.context.evaluated_depsgraph_get(), scene, scene.view_layers[0], FOLDER / "empty")
    text = result.main.read_text()
    assert [m.kind for m in result.report] == ["no camera"] and "Camera" in text
    assert "WorldBegin" in text and "Shape" not in text


def test_a_second_export_writes_nothing():
    thing = hair_scene()
    thing.data.materials.append(material("M"))
    cache = export.Cache()
    first = written("again", cache=cache)
    assert first.result.written == 2
    same = written("again", cache=cache)
    assert same.result.written == 0 and same.result.files == first.result.files and same.text == first.text
    thing.data.vertices[0].co.x += 1
    thing.data.update()
    moved = written("again", cache=cache)
    assert 1 <= moved.result.written <= 2 and moved.meshes()[0]["x"].max() >= first.meshes()[0]["x"].max()
    other = written("elsewhere", cache=cache)
    assert other.result.written == 2
    for file in other.result.files:
        assert file.is_file(), file


def test_pictures_from_memory():
    image = bpy.data.images.new("Made", 4, 2, float_buffer=True)
    image.pixels.foreach_set(np.arange(32, dtype="f4"))
    found = material("M")
    texture = found.node_tree.nodes.new("ShaderNodeTexImage")
    texture.image = image
    found.node_tree.links.new(texture.outputs[0], found.node_tree.nodes["Principled BSDF"].inputs["Base Color"])
    cube().data.materials.append(found)
    out = written()
    assert any(f.parent.name == "images" and f.is_file() for f in out.result.files)
    assert "u" in out.meshes()[0]


def test_volumes():
    thing = cube()
    thing.hide_render = True
    volume = add("Smoke", bpy.data.volumes.new("Smoke"), location=(0, 0, 5))
    modifier = volume.modifiers.new("Fill", "MESH_TO_VOLUME")
    modifier.object, modifier.voxel_amount = thing, 8
    found = material("Smoke")
    nodes = found.node_tree.nodes
    smoke = nodes.new("ShaderNodeVolumePrincipled")
    found.node_tree.links.new(smoke.outputs[0], nodes["Material Output"].inputs["Volume"])
    volume.data.materials.append(found)
    out = written()
    (name,) = re.findall(r'"(volumes/\w+\.vdb)"', out.text)
    assert (out.folder / name).read_bytes()[:3] == b" BD" and "MediumInterface" in out.text, out.text


run(sys.modules[__name__])
