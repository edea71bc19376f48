"""Renders every .blend file of a folder with one engine; runs inside Blender.

    blender -b --factory-startup [--addons lightmill] -P draw.py -- ENGINE SAMPLES PERCENT FOLDER OUT

One Blender draws them all, which saves its start. OUT gets NAME.exr, scene-linear, of 32 bits. A line "feature NAME" stands
before what the engine says of it. Pictures that are there are not drawn again.
"""
import pathlib
import sys

import bpy

DEPTH = 32


def set_up(scene, engine, samples, percent):
    """Both engines without clamps, filters of light and limits, so that they have the same integral to find."""
    scene.render.engine = engine
    scene.render.resolution_percentage = scene.render.resolution_percentage * percent // 100
    settings = scene.render.image_settings
    settings.file_format, settings.color_mode, settings.color_depth = "OPEN_EXR", "RGBA", "32"
    cycles = scene.cycles
    cycles.samples, cycles.use_adaptive_sampling, cycles.use_denoising = samples, False, False
    for kind in ("max", "diffuse", "glossy", "transmission", "volume", "transparent_max"):
        setattr(cycles, f"{kind}_bounces", DEPTH)
    cycles.sample_clamp_direct = cycles.sample_clamp_indirect = cycles.blur_glossy = 0
    cycles.caustics_reflective = cycles.caustics_refractive = True
    if hasattr(scene, "lightmill"):
        scene.lightmill.samples, scene.lightmill.max_depth = samples, DEPTH + 1


def main():
    engine, samples, percent, folder, out = sys.argv[sys.argv.index("--") + 1:]
    for blend in sorted(pathlib.Path(folder).glob("*.blend")):
        picture = pathlib.Path(out, f"{blend.stem}.exr")
        if picture.exists():
            continue
        print(f"feature {blend.stem}", flush=True)
        bpy.ops.wm.open_mainfile(filepath=str(blend))
        scene = bpy.context.scene
        set_up(scene, engine, int(samples), int(percent))
        scene.render.filepath = str(picture)
        try:
            bpy.ops.render.render(write_still=True)
        except RuntimeError as error:
            print(f"error: {error}", flush=True)


main()
