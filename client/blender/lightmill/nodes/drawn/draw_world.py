"""Draws a world as a picture of all directions. Runs in a Blender of its own: see world_picture.py.

    blender -b --factory-startup -P draw_world.py -- FOLDER

FOLDER has data.blend and task.json, and gets answer.json and the pictures, as numpy arrays. Suns are drawn apart: the picture
has none, and each is measured from what its disc adds.
"""
import json
import math
import pathlib
import sys

import bpy
import numpy

SAMPLES, SUN_SAMPLES = 4, 1024
SUN_MARGIN = 3  # pixels around what a first look finds
FLAT = 1e-6  # relative differences below it are none


def trees(tree):
    """The tree and its groups."""
    found, waiting = [], [tree]
    while waiting:
        one = waiting.pop()
        if one is not None and one not in found:
            found.append(one)
            waiting += [n.node_tree for n in one.nodes if n.type == "GROUP"]
    return found


def fix_light_path(world, values):
    """Replaces what Light Path gives by constants; gives what undoes it."""
    undo = []
    for tree in trees(world.node_tree):
        for link in [k for k in tree.links if k.from_node.type == "LIGHT_PATH"]:
            node = tree.nodes.new("ShaderNodeValue")
            node.outputs[0].default_value = values.get(link.from_socket.identifier, 0.0)
            target, source = link.to_socket, link.from_socket
            tree.links.new(node.outputs[0], target)
            undo.append((tree, node, source, target))
    return undo


def restore(undo):
    for tree, node, source, target in undo:
        tree.links.new(source, target)
        tree.nodes.remove(node)


def set_up(task):
    bpy.ops.wm.read_factory_settings(use_empty=True)
    folder = pathlib.Path(task["folder"])
    with bpy.data.libraries.load(str(folder / "data.blend")) as (_, wanted):
        wanted.worlds = [task["world"]]
    scene = bpy.context.scene
    scene.world = wanted.worlds[0]
    scene.world.cycles_visibility.camera = True
    scene.world.cycles.sampling_method = "NONE"
    for output in [n for n in scene.world.node_tree.nodes if n.type == "OUTPUT_WORLD"]:
        for link in list(output.inputs["Volume"].links):
            scene.world.node_tree.links.remove(link)
    camera = bpy.data.cameras.new("camera")
    camera.type, camera.cycles.panorama_type = "PANO", "EQUIRECTANGULAR"
    eye = bpy.data.objects.new("camera", camera)
    eye.rotation_euler = (math.pi / 2, 0, -math.pi / 2)  # so that the picture is what an environment texture takes
    scene.collection.objects.link(eye)
    scene.camera = eye
    render, cycles = scene.render, scene.cycles
    render.engine = "CYCLES"
    render.resolution_x, render.resolution_y, render.resolution_percentage = task["width"], task["width"] // 2, 100
    if task["threads"]:
        render.threads_mode, render.threads = "FIXED", task["threads"]
    render.image_settings.file_format, render.image_settings.color_mode, render.image_settings.color_depth = "OPEN_EXR", "RGB", "32"
    cycles.device, cycles.use_denoising, cycles.use_adaptive_sampling, cycles.pixel_filter_type = "CPU", False, False, "BOX"
    cycles.max_bounces, cycles.sample_clamp_direct, cycles.film_exposure = 0, 0, 1
    scene.frame_set(task["frame"], subframe=task["subframe"])
    return scene


def draw(scene, file, samples, border=None):
    """The picture as an array, the bottom row first. `border` is x0, x1, y0, y1 in pixels."""
    render = scene.render
    scene.cycles.samples = samples
    render.use_border = border is not None
    if border is not None:
        w, h = render.resolution_x, render.resolution_y
        render.border_min_x, render.border_max_x, render.border_min_y, render.border_max_y = border[0] / w, border[1] / w, border[2] / h, border[3] / h
    render.filepath = str(file)
    bpy.ops.render.render(write_still=True)
    image = bpy.data.images.load(str(file))
    image.colorspace_settings.name = "Non-Color"
    pixels = numpy.empty(len(image.pixels), numpy.float32)
    image.pixels.foreach_get(pixels)
    width, height = image.size
    pixels = pixels.reshape(height, width, image.channels)[:, :, :3].astype(float)
    bpy.data.images.remove(image)
    return pixels


def directions(width, height):
    """Of the middles of pixels, and the solid angles of rows."""
    v, u = (numpy.arange(height) + 0.5) / height, (numpy.arange(width) + 0.5) / width
    up, around = (v - 0.5) * math.pi, math.pi * (1 - 2 * u)
    # As Blender's environment texture: u = 1/2 - atan2(y, x) / 2 pi.
    x, y = numpy.cos(up)[:, None] * numpy.cos(around), numpy.cos(up)[:, None] * numpy.sin(around)
    z = numpy.repeat(numpy.sin(up)[:, None], width, axis=1)
    edges = numpy.sin((numpy.arange(height + 1) / height - 0.5) * math.pi)
    return numpy.stack([x, y, z], axis=2), numpy.diff(edges) * 2 * math.pi / width


def suns_of(scene, skies, folder, plain):
    """The discs of sky textures: what each adds to the picture."""
    found = []
    for sky in skies:
        sky.sun_disc = True
        look = draw(scene, folder / "look.exr", 1) - plain
        ys, xs = numpy.nonzero(look.max(axis=2) > 0.02 * look.max())
        if look.max() > 1e-6 * max(plain.max(), 1e-6) and len(ys):
            h, w = look.shape[:2]
            border = [max(xs.min() - SUN_MARGIN, 0), min(xs.max() + 1 + SUN_MARGIN, w), max(ys.min() - SUN_MARGIN, 0), min(ys.max() + 1 + SUN_MARGIN, h)]
            area = numpy.s_[border[2]:border[3], border[0]:border[1]]
            many = min(SUN_SAMPLES, max(SUN_SAMPLES * 1024 // ((border[1] - border[0]) * (border[3] - border[2])), 16))
            added = draw(scene, folder / "sun.exr", many, border)
            sky.sun_disc = False
            added -= draw(scene, folder / "sun.exr", many, border)
            to, solid = directions(w, h)
            weights = (added * solid[:, None, None])[area]
            toward = (weights.sum(axis=2)[:, :, None] * to[area]).sum(axis=(0, 1))
            length = numpy.linalg.norm(toward)
            if length > 0:
                found.append({"direction": (toward / length).tolist(), "irradiance": numpy.maximum(weights.sum(axis=(0, 1)), 0).tolist(),
                              "angle": math.degrees(sky.sun_size) / 2})
        sky.sun_disc = False
    return found


def main():
    folder = pathlib.Path(sys.argv[sys.argv.index("--") + 1])
    task = json.loads((folder / "task.json").read_text(encoding="utf-8"))
    task["folder"] = str(folder)
    scene = set_up(task)
    skies = [n for t in trees(scene.world.node_tree) for n in t.nodes if n.type == "TEX_SKY" and n.sky_type == "NISHITA" and n.sun_disc]
    for sky in skies:
        sky.sun_disc = False
    answers = []
    for number, values in enumerate(task["light_paths"]):
        undo = fix_light_path(scene.world, values) if values else []
        name = f"{number}.npy"
        plain = draw(scene, folder / "plain.exr", SAMPLES)
        mean = plain.mean(axis=(0, 1))
        if plain.max() - plain.min() <= FLAT * max(abs(plain.max()), 1e-6) or (numpy.abs(plain - mean) <= FLAT * numpy.maximum(mean, 1e-6)).all():
            name = ""
        else:
            numpy.save(folder / name, numpy.ascontiguousarray(plain[::-1], numpy.float32))
        answers.append({"file": name, "rgb": mean.tolist(), "suns": suns_of(scene, skies, folder, plain)})
        restore(undo)
    (folder / "answer.json").write_text(json.dumps(answers), encoding="utf-8")


if __name__ == "__main__":
    main()
