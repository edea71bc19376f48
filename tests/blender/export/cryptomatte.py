"""Cryptomatte: names in what is written, passes, and what a render result says of them."""
import json
import pathlib
import re
import sys
import types

import bpy
import numpy

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parent))
from harness import add, run, written  # noqa: E402
from lightmill.engine import mattes, passes  # noqa: E402


def cube(name, data=None, **settings):
    if data is None:
        bpy.ops.mesh.primitive_cube_add()
        data = bpy.context.object.data
        bpy.data.objects.remove(bpy.context.object)
    return add(name, data, **settings)


def names_in(text, parameter):
    return sorted(re.findall(f'"string {parameter}" "((?:[^"\\\\]|\\\\.)*)"', text))


def test_objects_and_what_they_hang_from():
    wheel, car = cube("wheel"), add("car", None)
    wheel.parent = car
    cube('a "quoted" name')
    text = written().text
    assert names_in(text, "object") == ['a \\"quoted\\" name', "wheel"], text
    assert names_in(text, "asset") == ['a \\"quoted\\" name', "car"], text


def test_instances_have_names_of_their_own():
    data = cube("first").data
    for name in ("second", "third"):
        cube(name, data)
    text = written().text
    assert text.count("ObjectInstance") == 3
    assert names_in(text, "object") == ["first", "second", "third"], text


def test_materials_are_called_as_in_blender():
    for name in ("Steel", "Steel.001"):  # two the same
        made = cube(name)
        made.data.materials.append(bpy.data.materials.new(name))
    cube("bare")
    assert names_in(written().text, "materialname") == ["Steel", "Steel.001", "default_surface"]


def test_indices():
    made = cube("numbered")
    made.pass_index = 7
    made.data.materials.append(bpy.data.materials.new("Steel"))
    made.data.materials[0].pass_index = 8
    cube("plain")
    text = written().text
    assert sorted(re.findall(r'"integer objectid" (\d+)', text)) == ["0", "7"], text
    assert sorted(re.findall(r'"integer materialid" (\d+)', text)) == ["0", "8"], text


def test_passes_of_indices_motion_and_coordinates():
    view_layer = bpy.context.view_layer
    view_layer.use_pass_uv = view_layer.use_pass_vector = view_layer.use_pass_object_index = True
    found = [p for p in passes.passes_of(view_layer) if p.aov in ("uv", "motion", "objectid")]
    assert [(p.name, p.channels) for p in found] == [("Vector", "XYZW"), ("UV", "UVA"), ("IndexOB", "X")]
    assert passes.aovs_of(found, False) == "alpha,motion,objectid,uv"
    assert not passes.unsupported_of(view_layer)
    assert len(passes.motion_notes(bpy.context.scene, view_layer)) == 1
    alpha = numpy.array([[[1.0]], [[0.0]]], "f4")
    channels = {"uv": numpy.array([[[0.25, 0.5]], [[0, 0]]], "f4"), "alpha": alpha,
                "motion": numpy.array([[[2, -4]], [[0, 0]]], "f4"), "objectid": 3 * alpha}
    values = {p.name: passes.pixels_of(p, channels)[:, 0].tolist() for p in found}
    assert values == {"UV": [[0.25, 0.5, 1], [0, 0, 0]], "Vector": [[-1, 2, -1, 2], [0, 0, 0, 0]], "IndexOB": [[3], [0]]}, values


def test_ids():
    assert mattes.murmur_hash3(b"The quick brown fox jumps over the lazy dog") == 0x2E4FF723
    assert mattes.murmur_hash3(b"aaaa") == 0x7EEED987
    for name, bits in (("bunny", 0x13851A76), ("default", 0x42C9679F), ("shape 274", 0x80FFECA9)):
        assert mattes.id_of(name) == bits, name


def test_passes_and_manifests():
    view_layer = bpy.context.view_layer
    view_layer.use_pass_cryptomatte_object = view_layer.use_pass_cryptomatte_asset = True
    view_layer.pass_cryptomatte_depth = 4
    found = [p for p in passes.passes_of(view_layer) if p.aov.startswith("crypto")]
    assert [p.name for p in found] == ["CryptoObject00", "CryptoObject01", "CryptoAsset00", "CryptoAsset01"]
    assert "cryptoobject" in passes.aovs_of(found, False)
    assert not passes.unsupported_of(view_layer)
    view_layer.pass_cryptomatte_depth = 16
    assert sum(p.aov == "cryptoasset" for p in passes.passes_of(view_layer)) == 3
    cube("box")
    depsgraph = bpy.context.evaluated_depsgraph_get()
    fields = mattes.fields_of(depsgraph, types.SimpleNamespace(name="ViewLayer"), found)
    name = next(k for k, v in fields.items() if v == "ViewLayer.CryptoObject")
    assert re.fullmatch(r"cryptomatte/[0-9a-f]{7}/name", name)
    manifest = json.loads(fields[name.replace("/name", "/manifest")])
    assert manifest["box"] == f"{mattes.id_of('box'):08x}"
    assert len(fields) == 8


run(sys.modules[__name__])
