"""What draw_lamp.py and draw_volume.py have in common: a scene that bakes. Runs in a Blender of its own."""
import bpy
import numpy


def make_ready(task, thing):
    """Cycles on the processor at the task's time, with the thing in the scene and chosen."""
    scene = bpy.context.scene
    scene.collection.objects.link(thing)
    scene.render.engine, scene.cycles.samples, scene.cycles.device = "CYCLES", 1, "CPU"
    scene.cycles.use_denoising = scene.cycles.use_adaptive_sampling = False
    if task["threads"]:
        scene.render.threads_mode, scene.render.threads = "FIXED", task["threads"]
    scene.frame_set(task["frame"], subframe=task["subframe"])
    bpy.context.view_layer.objects.active = thing
    thing.select_set(True)


def pixels_of(image):
    """RGBA, the bottom row first."""
    pixels = numpy.empty(len(image.pixels), numpy.float32)
    image.pixels.foreach_get(pixels)
    return pixels
