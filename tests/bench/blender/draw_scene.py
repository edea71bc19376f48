"""Renders the open file with Cycles, or exports it for Lightmill; runs inside Blender.

    blender -b FILE.blend [--addons lightmill] -P draw_scene.py -- CYCLES|LIGHTMILL PERCENT DEPTH OUT [SPP SEED...]

Cycles writes OUT/cyclesSEED.exr for each seed; Lightmill's scene is OUT/scene.pbrt. Both without clamps, filters of light and
limits of their own, so that they have the same integral to find.
"""
import pathlib
import sys

import bpy


def main():
    engine, percent, depth, out, *rest = sys.argv[sys.argv.index("--") + 1:]
    scene = bpy.context.scene
    scene.render.engine = engine
    scene.render.resolution_percentage = int(percent)
    scene.render.use_border = scene.render.use_compositing = scene.render.use_sequencer = False
    if engine == "LIGHTMILL":
        from lightmill import export
        made = export.export_frame(bpy.context.evaluated_depsgraph_get(), scene, bpy.context.view_layer, out,
                                   frame_set=lambda frame, subframe: scene.frame_set(frame, subframe=subframe))
        print(*made.report, sep="\n")
        return
    cycles = scene.cycles
    cycles.use_adaptive_sampling = cycles.use_denoising = False
    for kind in ("max", "diffuse", "glossy", "transmission", "volume", "transparent_max"):
        setattr(cycles, f"{kind}_bounces", int(depth))
    cycles.sample_clamp_direct = cycles.sample_clamp_indirect = cycles.blur_glossy = 0
    cycles.caustics_reflective = cycles.caustics_refractive = True
    settings = scene.render.image_settings
    settings.file_format, settings.color_mode, settings.color_depth = "OPEN_EXR", "RGBA", "32"
    cycles.samples = int(rest[0])
    for seed in rest[1:]:
        cycles.seed = int(seed)
        scene.render.filepath = str(pathlib.Path(out, f"cycles{seed}.exr"))
        bpy.ops.render.render(write_still=True)


main()
