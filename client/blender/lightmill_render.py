"""Renders the scene that is open in Blender on a Lightmill farm: exports glTF, submits it, shows progress.

As an add-on: Edit > Preferences > Add-ons > Install, this file; then Render > Render with Lightmill. In a shell:

    blender -b scene.blend -P client/blender/lightmill_render.py -- --spp 64 -o picture.exr

It runs the program `lightmill`, so whatever that is told by LIGHTMILL_... variables holds here, too.

glTF measures light by what eyes see of it: an .exr holds nits, 683 for each of Blender's units. What the add-on loads
into Blender and every .png are brought back to Blender's scale. The world is its background's colour or picture, times
its strength; other nodes of the world, volumes and what glTF can't say are left out.
"""
import argparse
import json
import math
import os
import shutil
import subprocess
import sys
import tempfile

import bpy
import numpy

bl_info = {
    "name": "Lightmill",
    "description": "Render on a Lightmill farm",
    "author": "Lightmill's authors",
    "version": (1, 0, 0),
    "blender": (3, 4, 0),
    "category": "Render",
}

NITS = 683.0  # of Blender's unit of radiance, in its glTF exporter
ENDED = ("done", "failed", "cancelled")


class LightmillError(Exception):
    """One line for the user."""


class Farm:
    """The program's verbs."""

    def __init__(self, program, coordinator):
        self.program, self.coordinator = program, coordinator

    def run(self, *arguments):
        command = [self.program, *map(str, arguments)]
        if self.coordinator:
            command += ["--coordinator", self.coordinator]
        try:
            done = subprocess.run(command, capture_output=True, text=True, check=False)
        except OSError as error:
            raise LightmillError(f"{self.program} can't be run: {error.strerror}; name it in the preferences") from error
        if done.returncode != 0:
            raise LightmillError((done.stderr.strip().splitlines() or ["lightmill failed"])[-1])
        return done.stdout

    def submit(self, path, scene, spp):
        """Exported file and Blender's scene -> the job's id."""
        render = scene.render
        scale = render.resolution_percentage / 100
        size = f"{max(1, int(render.resolution_x * scale))}x{max(1, int(render.resolution_y * scale))}"
        options = ["--resolution", size, "--spp", spp, "--name", scene.name, "--quiet"]
        if scene.camera:
            options += ["--camera", scene.camera.data.name]
        environment = os.path.join(os.path.dirname(path), "environment.pfm")
        if environment_of(scene, environment):
            options += ["--environment", environment]
        return self.run("submit", path, *options).strip()

    def status(self, job):
        return json.loads(self.run("job", job, "--json"))

    def fetch(self, job, path, exposure=0.0):
        """`exposure`: stops, of a .png."""
        view = ["--exposure", exposure - math.log2(NITS)] if path.lower().endswith(".png") else []
        self.run("fetch", job, "-o", path, "--quiet", *view)


def environment_of(scene, path):
    """Writes the world's light as a lat-long picture, in nits; False if it is black."""
    world = scene.world
    if not world:
        return False
    width, height, strength, pixels = 2, 1, 1.0, numpy.tile(numpy.array([*world.color, 1.0], "f4"), 2)
    background = None
    if world.use_nodes:
        background = next((n for n in world.node_tree.nodes if n.type == "BACKGROUND"), None)
    if background:
        strength = background.inputs["Strength"].default_value
        pixels = numpy.tile(numpy.array(background.inputs["Color"].default_value, "f4"), 2)
        links = background.inputs["Color"].links
        if links and links[0].from_node.type == "TEX_ENVIRONMENT" and links[0].from_node.image:
            picture = links[0].from_node.image
            width, height = picture.size
            pixels = numpy.empty(width * height * 4, "f4")
            picture.pixels.foreach_get(pixels)
    light = pixels.reshape(height, width, 4)[..., :3] * (strength * NITS)
    if not light.any():
        return False
    # Blender's pictures have +X in the middle, Lightmill's -X. Written here, as Blender saves through its view.
    with open(path, "wb") as out:
        out.write(b"PF\n%d %d\n-1.0\n" % (width, height))
        out.write(numpy.roll(light, width // 2, axis=1).astype("<f4").tobytes())  # both begin at the bottom
    return True


def export(path):
    """What is rendered of the open scene, as one .glb file with cameras and lights."""
    bpy.ops.export_scene.gltf(filepath=path, export_format="GLB", export_cameras=True, export_lights=True,
                              export_apply=True, use_renderable=True)


def summary(status):
    done, total = status["packets_done"], max(1, status["packets_total"])
    text = f"{status['id']} {status['state']}: {100 * done // total} %, {status['spp']:.4g} spp"
    return text + (f", relMSE {status['relmse']:.3g}" if status["relmse"] is not None else "")


def finished(status):
    """Whether the job is done; raises LightmillError if it ended otherwise."""
    if status["state"] in ENDED[1:]:
        raise LightmillError(f"{status['id']} {status['state']}: {status['message']}")
    return status["state"] == "done"


class LightmillPreferences(bpy.types.AddonPreferences):
    bl_idname = __name__
    program: bpy.props.StringProperty(name="Program", default="lightmill", subtype="FILE_PATH")
    coordinator: bpy.props.StringProperty(
        name="Coordinator", description="HOST:PORT, or several with commas between; empty: the program's default")
    spp: bpy.props.IntProperty(name="Samples per pixel", default=128, min=1)

    def draw(self, _context):
        for name in ("program", "coordinator", "spp"):
            self.layout.prop(self, name)


class RENDER_OT_lightmill(bpy.types.Operator):
    """Export the scene, render it on the farm and load the picture as the image "Lightmill" """
    bl_idname = "render.lightmill"
    bl_label = "Render with Lightmill"

    def start(self, context):
        entry = context.preferences.addons.get(__name__)
        preferences = entry.preferences if entry else None
        self.folder = tempfile.mkdtemp(prefix="lightmill-")
        self.farm = Farm(preferences.program if preferences else "lightmill",
                         preferences.coordinator if preferences else "")
        scene_file = os.path.join(self.folder, "scene.glb")
        export(scene_file)
        self.job = self.farm.submit(scene_file, context.scene, preferences.spp if preferences else 128)

    def load(self):
        picture = os.path.join(self.folder, "Lightmill.exr")
        self.farm.fetch(self.job, picture)
        image = bpy.data.images.load(picture)
        pixels = numpy.empty(len(image.pixels), "f4")
        image.pixels.foreach_get(pixels)
        pixels.reshape(-1, 4)[:, :3] /= NITS
        image.pixels.foreach_set(pixels)
        image.name = "Lightmill"
        image.pack()

    def end(self, context):
        if getattr(self, "timer", None):
            context.window_manager.event_timer_remove(self.timer)
            context.workspace.status_text_set(None)
            self.timer = None
        shutil.rmtree(getattr(self, "folder", ""), ignore_errors=True)

    def fail(self, context, error):
        self.report({"ERROR"}, str(error))
        self.end(context)
        return {"CANCELLED"}

    def invoke(self, context, _event):
        try:
            self.start(context)
        except LightmillError as error:
            return self.fail(context, error)
        self.timer = context.window_manager.event_timer_add(1.0, window=context.window)
        context.window_manager.modal_handler_add(self)
        return {"RUNNING_MODAL"}

    def modal(self, context, event):
        if event.type == "ESC":
            try:
                self.farm.run("cancel", self.job)
            except LightmillError:
                pass  # it has ended, or nobody is there: there is nothing left to cancel
            self.end(context)
            return {"CANCELLED"}
        if event.type != "TIMER":
            return {"PASS_THROUGH"}
        try:
            status = self.farm.status(self.job)
            context.workspace.status_text_set("Lightmill: " + summary(status) + "  (Esc cancels)")
            if not finished(status):
                return {"PASS_THROUGH"}
            self.load()
        except LightmillError as error:
            return self.fail(context, error)
        self.end(context)
        return {"FINISHED"}

    def execute(self, context):
        """From a script: until the picture is there."""
        try:
            self.start(context)
            self.farm.run("watch", self.job, "--quiet")
            self.load()
        except LightmillError as error:
            return self.fail(context, error)
        self.end(context)
        return {"FINISHED"}


def draw_menu(self, _context):
    self.layout.operator(RENDER_OT_lightmill.bl_idname, icon="RENDER_STILL")


def register():
    for kind in (LightmillPreferences, RENDER_OT_lightmill):
        bpy.utils.register_class(kind)
    bpy.types.TOPBAR_MT_render.append(draw_menu)


def unregister():
    bpy.types.TOPBAR_MT_render.remove(draw_menu)
    for kind in (RENDER_OT_lightmill, LightmillPreferences):
        bpy.utils.unregister_class(kind)


def main(arguments):
    parser = argparse.ArgumentParser(prog="lightmill_render.py")
    parser.add_argument("--program", default=os.environ.get("LIGHTMILL_PROGRAM", "lightmill"))
    parser.add_argument("--coordinator", default="", help="HOST:PORT, or several with commas between; default: the program's")
    parser.add_argument("--spp", type=int, default=128)
    parser.add_argument("-o", "--output", required=True)
    options = parser.parse_args(arguments)
    farm = Farm(options.program, options.coordinator)
    with tempfile.TemporaryDirectory(prefix="lightmill-") as folder:
        scene_file = os.path.join(folder, "scene.glb")
        export(scene_file)
        job = farm.submit(scene_file, bpy.context.scene, options.spp)
    print(f"lightmill: {job}", flush=True)
    farm.run("watch", job, "--quiet")
    print(f"lightmill: {summary(farm.status(job))}", flush=True)
    farm.fetch(job, options.output, bpy.context.scene.view_settings.exposure)


if __name__ == "__main__":
    if "--" in sys.argv:
        try:
            main(sys.argv[sys.argv.index("--") + 1:])
        except LightmillError as failure:
            print(f"lightmill: {failure}", file=sys.stderr)
            sys.exit(1)
    else:
        register()
