"""The render engine in background mode, on this machine.

    engine_test.py --bin build/release/bin [PART...]
"""
import argparse
import os
import signal

from blender_runs import GENEROUS_S, Blender, error_lines, interrupt, pixels, said, wait_until

import numpy  # farm.py, which comes first, has said so if they are not there
import OpenImageIO

PASSES = """
v = bpy.context.view_layer
v.use_pass_z = v.use_pass_normal = v.use_pass_position = v.use_pass_diffuse_color = v.use_pass_glossy_color = True
v.use_pass_uv = v.use_pass_vector = v.use_pass_object_index = v.use_pass_material_index = True
bpy.data.objects["Cube"].pass_index, bpy.data.materials["Material"].pass_index = 5, 6
for name in ("denoising", "alpha", "direct", "indirect", "variance", "sample_count", "volume_direct", "volume_indirect"):
    setattr(v.lightmill, f"use_pass_{name}", True)
for name in ("diffuse", "glossy", "transmission"):
    setattr(v, f"use_pass_{name}_direct", True)
    setattr(v, f"use_pass_{name}_indirect", True)
v.use_pass_emit = True
v.use_pass_mist = True
s.render.image_settings.file_format = "OPEN_EXR_MULTILAYER"
"""
CHANNELS = {"Combined": "RGBA", "Depth": "Z", "Normal": "XYZ", "Position": "XYZ", "DiffCol": "RGB",
            "GlossCol": "RGB", "UV": "UVA", "Vector": "XYZW", "IndexOB": "X", "IndexMA": "X",
            "Denoising Normal": "XYZ", "Denoising Albedo": "RGB", "Denoising Depth": "Z", "Alpha": "A", "Direct": "RGB",
            "Indirect": "RGB", "Variance": "RGB", "Debug Sample Count": "X"}
LIGHT_PASSES = ("DiffDir", "DiffInd", "GlossDir", "GlossInd", "TransDir", "TransInd", "VolumeDir", "VolumeInd", "Emit")
CHANNELS.update((name, "RGB") for name in LIGHT_PASSES)

LIGHT_GROUPS = """
v = bpy.context.view_layer
for name in ("Key Light", "Sky", "Nothing"):
    v.lightgroups.add(name=name)
bpy.data.objects["Light"].lightgroup, s.world.lightgroup = "Key Light", "Sky"
s.render.image_settings.file_format = "OPEN_EXR_MULTILAYER"
"""


def layers(path):
    """{"ViewLayer.Depth.Z": rows x columns} of a multilayer file."""
    file = OpenImageIO.ImageInput.open(str(path))
    values = numpy.asarray(file.read_image(OpenImageIO.FLOAT))
    names = file.spec().channelnames
    file.close()
    return {name: values[..., i] for i, name in enumerate(names)}


def still(blender):
    """As issue and manual have it: -f 1 makes a picture, Blender ends with 0, and nothing stays behind."""
    text = blender.run("-f", 1)
    image = pixels(blender.picture())
    assert image.shape == (64, 96, 4), image.shape
    assert (image[..., 3] == 1).all(), "the film is not transparent"
    # The cube is in the middle, and lit; the grey world is at the corners.
    assert abs(image[32, 48, :3].mean() - image[2, 2, :3].mean()) > 0.02, (image[32, 48], image[2, 2])
    assert "16 samples" in text, text[-2000:]
    assert not error_lines(text), text
    blender.assert_nothing_left()


def passes(blender):
    """All passes, under Blender's names; what is not made is named."""
    text = blender.run("-f", 1, script=PASSES)
    found = layers(blender.picture())
    assert set(found) == {f"ViewLayer.{name}.{letter}" for name, letters in CHANNELS.items() for letter in letters}, set(found)
    assert "no pass Mist" in text and "Vector is 0" in text, text
    layer = {name.removeprefix("ViewLayer."): values for name, values in found.items()}
    hit = layer["Alpha.A"] == 1
    assert 0.02 < hit.mean() < 0.9 and layer["Depth.Z"][2, 2] == 1e10, (hit.mean(), layer["Depth.Z"][2, 2])
    assert 5 < layer["Depth.Z"][32, 48] < 13, layer["Depth.Z"][32, 48]  # Blender's camera is 11 m away
    length = numpy.sqrt(sum(layer[f"Normal.{c}"] ** 2 for c in "XYZ"))
    assert length.max() < 1.01 and length[32, 48] > 0.9, (length.max(), length[32, 48])
    assert (numpy.abs(layer["Position.Z"][hit]) < 1.01).all(), "the cube has sides of 2 m"
    assert (layer["Debug Sample Count.X"] == 16).all()
    assert (layer["IndexOB.X"][hit] == 5).all() and (layer["IndexMA.X"][hit] == 6).all() and layer["IndexOB.X"][2, 2] == 0
    assert not any(layer[f"Vector.{c}"].any() for c in "XYZW"), "nothing moves"
    assert (layer["UV.A"][hit] == 1).all() and layer["UV.A"][2, 2] == 0
    for c in "UV":
        assert layer[f"UV.{c}"][hit].min() > -1e-6 and layer[f"UV.{c}"][hit].max() < 1 + 1e-6 and numpy.ptp(layer[f"UV.{c}"][hit]) > 0.1, c
    for c in "RGB":
        both = layer[f"DiffCol.{c}"] + layer[f"GlossCol.{c}"]
        assert numpy.allclose(both[hit], layer[f"Denoising Albedo.{c}"][hit], atol=1e-4), c
        assert 0.5 < layer[f"DiffCol.{c}"][32, 48] < 0.9 and 0 < layer[f"GlossCol.{c}"][32, 48] < 0.4, c
    both = layer["Direct.R"] + layer["Indirect.R"]
    assert numpy.allclose(both, layer["Combined.R"], rtol=1e-3, atol=1e-4), numpy.abs(both - layer["Combined.R"]).max()
    lobes = sum(layer[f"{name}.R"] for name in LIGHT_PASSES)
    assert numpy.allclose(lobes, layer["Combined.R"], rtol=1e-3, atol=1e-4), numpy.abs(lobes - layer["Combined.R"]).max()
    assert layer["DiffDir.R"][32, 48] > layer["GlossDir.R"][32, 48] and layer["Emit.R"][2, 2] > 0 == layer["DiffDir.R"][2, 2]


def light_groups(blender):
    """Each has a pass, black if nothing is in it; here they add up to the picture."""
    text = blender.run("-f", 1, script=LIGHT_GROUPS)
    assert not error_lines(text), text
    layer = {name.removeprefix("ViewLayer."): values for name, values in layers(blender.picture()).items()}
    for c in "RGB":
        key, sky = layer[f"Combined_Key Light.{c}"], layer[f"Combined_Sky.{c}"]
        assert numpy.allclose(key + sky, layer[f"Combined.{c}"], rtol=1e-3, atol=1e-4), c
        assert key[32, 48] > 0 and key[2, 2] == 0 and sky[2, 2] > 0, (key[32, 48], key[2, 2], sky[2, 2])
        assert not layer[f"Combined_Nothing.{c}"].any(), c


def border(blender):
    """The part of the border has the pixels of the whole picture, with crop and without."""
    blender.run("-f", 1)
    whole = pixels(blender.picture())
    part = "s.render.use_border = True; s.render.border_min_x, s.render.border_max_x = 0.25, 0.7\n" \
           "s.render.border_min_y, s.render.border_max_y = 0.5, 0.9\n"
    blender.run("-f", 2, script=part)
    within = pixels(blender.picture(2))
    blender.run("-f", 3, script=part + "s.render.use_crop_to_border = True\n")
    cropped = pixels(blender.picture(3))
    x0, x1, y0, y1 = 24, 67, 64 - 57, 32  # from above; Blender cuts 0.9 * 64 to 57
    assert cropped.shape == (y1 - y0, x1 - x0, 4), cropped.shape
    assert within.shape == whole.shape and not within[y1:].any() and not within[:, :x0].any()
    assert numpy.allclose(within[y0:y1, x0:x1], cropped)
    # Other noise is possible, another part of the view is not.
    assert numpy.abs(whole[y0:y1, x0:x1] - cropped).mean() < 0.02, numpy.abs(whole[y0:y1, x0:x1] - cropped).mean()


def layered(blender):
    """Two view layers, and a percentage; a transparent film."""
    blender.run("-f", 1, script='bpy.context.scene.view_layers.new("Second")\ns.render.resolution_percentage = 50\n'
                's.render.film_transparent = True\ns.render.image_settings.file_format = "OPEN_EXR_MULTILAYER"\n')
    found = layers(blender.picture())
    for name in ("ViewLayer", "Second"):
        alpha = found[f"{name}.Combined.A"]
        assert alpha.shape == (32, 48), alpha.shape
        assert alpha[1, 1] == 0 and alpha[16, 24] == 1, (alpha[1, 1], alpha[16, 24])
        assert found[f"{name}.Combined.R"][1, 1] == 0, "the world is not seen through a transparent film"


def failing(blender):
    """What can't be done is one line on stderr, and exit code 1."""
    script = blender.folder / "lightmill"
    for program, words in (("/nowhere/lightmill", "there is no program"), (str(script), "lightmill-coordinator is not beside")):
        script.write_text("#!/bin/sh\nexit 1\n")
        script.chmod(0o755)
        text = blender.run("-f", 1, expect=1, environment={"LIGHTMILL_PROGRAM": program})
        assert len(error_lines(text)) == 1 and words in error_lines(text)[0], text
    for name in ("lightmill-coordinator", "lightmill-worker"):
        (blender.folder / name).write_text("#!/bin/sh\necho no room >&2\nexit 1\n")
        (blender.folder / name).chmod(0o755)
    text = blender.run("-f", 1, expect=1, environment={"LIGHTMILL_PROGRAM": str(script)})
    assert len(error_lines(text)) == 1 and "no room" in error_lines(text)[0], text
    text = blender.run("-f", 1, expect=1, script="s.lightmill.samples = 0\n")
    assert len(error_lines(text)) == 1 and "nothing ends the render" in error_lines(text)[0], text
    text = blender.run("-f", 1, expect=1, script='s.lightmill.coordinator = "127.0.0.1:1"\n')
    assert len(error_lines(text)) == 1 and "127.0.0.1:1 can't be reached" in error_lines(text)[0], text
    text = blender.run("-f", 1, expect=1, script='s.lightmill.coordinator = "what is this"\n')
    assert len(error_lines(text)) == 1 and "no address" in error_lines(text)[0], text
    assert not blender.picture().exists()
    blender.assert_nothing_left()


ENDLESS = "s.lightmill.samples, s.lightmill.time_limit = 0, 3600\n"


def killed(blender):
    """Blender is interrupted, or killed: nothing stays behind."""
    for end in (interrupt, lambda process: (process.kill(), process.wait())):
        process = blender.start("-f", 1, script=ENDLESS)
        wait_until("samples", lambda: " samples" in said(process))
        assert blender.farm_processes(), "there is a farm while it renders"
        end(process)
        blender.assert_nothing_left()


def lost(blender):
    """This machine's coordinator ends by itself: one line says so, at once."""
    process = blender.start("-f", 1, script=ENDLESS)
    wait_until("samples", lambda: " samples" in said(process))
    coordinator, = (number for number, line in blender.farm_processes() if "lightmill-coordinator" in line.split(" ", 1)[0])
    os.kill(coordinator, signal.SIGKILL)
    assert process.wait(GENEROUS_S) == 1, said(process)
    assert len(error_lines(said(process))) == 1 and "lightmill-coordinator ended" in said(process), said(process)
    blender.assert_nothing_left()


PARTS = {f.__name__: f for f in (still, passes, light_groups, border, layered, failing, killed, lost)}


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("--bin", required=True, help="folder of the programs")
    parser.add_argument("part", nargs="*", choices=[*PARTS, []])
    arguments = parser.parse_args()
    for part in arguments.part or PARTS:
        with Blender(arguments.bin) as blender:
            PARTS[part](blender)
            print(f"ok: {part}", flush=True)


if __name__ == "__main__":
    main()
