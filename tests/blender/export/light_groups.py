"""Light groups: in what is written, as passes, and in Blender's panels."""
import pathlib
import re
import sys

import bpy

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parent))
from harness import add, run, written  # noqa: E402
import lightmill  # noqa: E402
from lightmill import light_groups  # noqa: E402
from lightmill.engine import passes  # noqa: E402


def shader(kind, target="Surface", **values):
    """A material of one shader."""
    made = bpy.data.materials.new(kind)
    made.use_nodes = True
    tree = made.node_tree
    output = tree.nodes["Material Output"]
    tree.nodes.remove(tree.nodes["Principled BSDF"])
    node = tree.nodes.new(f"ShaderNode{kind}")
    for name, value in values.items():
        node.inputs[name].default_value = value
    tree.links.new(node.outputs[0], output.inputs[target])
    return made


def cube(name, made=None, data=None, **settings):
    if data is None:
        bpy.ops.mesh.primitive_cube_add()
        data = bpy.context.object.data
        bpy.data.objects.remove(bpy.context.object)
        data.materials.append(made)
    return add(name, data, **settings)


def groups_in(text, directive):
    """Of each such directive its light group, in the order of names."""
    return sorted((re.findall(r'"string lightgroup" "([^"]*)"', line) or [""])[0]
                  for line in text.splitlines() if line.startswith(directive))


def test_names():
    for given, name in (("", ""), ("Key-1_a", "Key-1_a"), ("Key Light", "Key_Light"), ("rest", "rest_"), ("x" * 70, "x" * 64),
                        ('"\\\n', "___"), ("Свет", "_421_432_435_442")):
        assert light_groups.name_of(given) == name, given


def test_lamps():
    for kind in ("POINT", "SPOT", "SUN", "AREA"):
        lamp = add(kind, bpy.data.lights.new(kind, kind))
        lamp.lightgroup = f"{kind} lamp"
    add("plain", bpy.data.lights.new("plain", "POINT"))
    text = written().text
    assert groups_in(text, "Attribute \"light\"") == ["AREA_lamp", "POINT_lamp", "SPOT_lamp", "SUN_lamp"], text
    for block in text.split("AttributeBegin\n")[1:]:
        kind = re.search(r'LightSource "(\w+)"', block)[1]
        group = re.search(r'"string lightgroup" "(\w+)"', block)
        if group:
            assert {"SUN_lamp": "distant"}.get(group[1], group[1].split("_")[0].lower()) == kind, block
    assert text.count('LightSource "point"') == 2


def test_area_lamps_that_become_shapes():
    cube("Fog", shader("VolumeScatter", "Volume"), location=(9, 0, 0))
    lamp = add("Lamp", bpy.data.lights.new("Lamp", "AREA"))
    lamp.lightgroup = "panel"
    text = written().text
    assert text.index('Attribute "light" "string lightgroup" "panel"') < text.index('AreaLightSource "diffuse"'), text


def test_meshes_share_a_material_in_several_groups():
    lamp = cube("A", shader("Emission"))
    lamp.lightgroup = "key"
    for k, group in enumerate(("key", "fill", "")):
        cube(f"B{k}", data=lamp.data, location=(3 * k + 3, 0, 0)).lightgroup = group
    out = written()
    assert groups_in(out.text, "AreaLightSource") == ["", "fill", "key", "key"], out.text
    assert out.text.count("MakeNamedMaterial") == 1 and len(out.meshes()) == 1, "one material and one file"


def test_what_does_not_emit_has_no_group():
    cube("A", shader("BsdfDiffuse")).lightgroup = "key"
    assert "lightgroup" not in written().text


def test_instances_have_the_group_of_their_instancer():
    lamp = cube("Lamp", shader("Emission"))
    inside = bpy.data.collections.new("Inside")
    bpy.context.scene.collection.objects.unlink(lamp)
    inside.objects.link(lamp)
    for k, group in enumerate(("left", "right")):
        add(f"E{k}", None, instance_type="COLLECTION", instance_collection=inside, location=(4 * k, 0, 0)).lightgroup = group
    assert groups_in(written().text, "AreaLightSource") == ["left", "right"]
    lamp.lightgroup = "own"
    assert groups_in(written().text, "AreaLightSource") == ["own", "own"]


def test_volumes_that_shine():
    fire = cube("A", shader("VolumePrincipled", "Volume", **{"Emission Strength": 2.0}))
    fire.lightgroup = "fire"
    cube("B", data=fire.data, location=(4, 0, 0)).lightgroup = "lava"
    cube("C", data=fire.data, location=(8, 0, 0))
    cube("Smoke", shader("VolumePrincipled", "Volume"), location=(12, 0, 0)).lightgroup = "dark"
    text = written().text
    assert groups_in(text, "MakeNamedMedium") == ["", "", "fire", "lava"], text
    names = dict(re.findall(r'MakeNamedMedium "(\w+)" .*"string lightgroup" "(\w+)"', text))
    assert {names.get(name) for name in re.findall(r'MediumInterface "(\w+)"', text)} == {"fire", "lava", None}


def test_worlds():
    world = bpy.context.scene.world = bpy.data.worlds.new("World")
    world.use_nodes = True
    world.lightgroup = "sky"
    assert groups_in(written().text, "LightSource") == ["sky"]
    world.node_tree.nodes["Background"].inputs["Color"].default_value = (0, 0, 0, 1)
    glow = world.node_tree.nodes.new("ShaderNodeEmission")
    world.node_tree.links.new(glow.outputs[0], world.node_tree.nodes["World Output"].inputs["Volume"])
    assert groups_in(written().text, "MakeNamedMedium") == ["sky"]
    world.use_nodes, world.color = False, (1, 0, 0)
    assert groups_in(written().text, "LightSource") == ["sky"]


def test_passes():
    layer = bpy.context.view_layer
    assert not passes.passes_of(layer) and not passes.light_group_notes(layer)
    for name in ("Key Light", "rest"):
        layer.lightgroups.add(name=name)
    wanted = passes.passes_of(layer)
    assert [(p.name, p.channels, p.layer) for p in wanted] == [("Combined_Key Light", "RGB", "lightgroup_Key_Light"),
                                                               ("Combined_rest", "RGB", "lightgroup_rest_")]
    assert passes.aovs_of(wanted, True) == "alpha,lightgroups" and not passes.light_group_notes(layer)

    class Picture:
        channels = ["R", "G", "B", *(f"lightgroup_Key_Light.{c}" for c in "RGB"), *(f"lightgroup_rest.{c}" for c in "RGB")]

        @staticmethod
        def array():
            import numpy
            return numpy.arange(18, dtype="f4").reshape(2, 1, 9)

    found = passes.channels_of(Picture)
    assert passes.pixels_of(wanted[0], found).tolist() == [[[12, 13, 14]], [[3, 4, 5]]], "from below"
    assert passes.pixels_of(wanted[1], found) is None, "no light has this group"
    layer.lightgroups.add(name="Key_Light")
    assert "'Key Light' and 'Key_Light'" in passes.light_group_notes(layer)[0]
    for k in range(30):
        layer.lightgroups.add(name=f"g{k}")
    assert "33 light groups; 31" in passes.light_group_notes(layer)[0]


def test_panels():
    lightmill.register()
    try:
        bpy.context.scene.render.engine = "LIGHTMILL"
        for name in ("LIGHTMILL_VIEWLAYER_PT_light_groups", "CYCLES_OBJECT_PT_lightgroup", "CYCLES_WORLD_PT_settings_light_group"):
            kind = getattr(bpy.types, name)
            assert "LIGHTMILL" in kind.COMPAT_ENGINES, name
    finally:
        bpy.context.scene.render.engine = "CYCLES"
        lightmill.unregister()


run(sys.modules[__name__])
