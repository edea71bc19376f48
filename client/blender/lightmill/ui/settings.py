"""scene.lightmill and view_layer.lightmill: what is saved in the .blend file."""
import bpy
from bpy.props import BoolProperty, EnumProperty, FloatProperty, IntProperty, PointerProperty, StringProperty


class LightmillSceneSettings(bpy.types.PropertyGroup):
    samples: IntProperty(
        name="Samples", description="Samples per pixel at which the render ends; 0: no such end", default=128, min=0,
        soft_max=4096)
    time_limit: FloatProperty(
        name="Time Limit", description="Seconds of rendering after which it ends; 0: none", default=0.0, min=0.0,
        soft_max=3600.0, subtype="TIME_ABSOLUTE", unit="TIME_ABSOLUTE")
    target_error: FloatProperty(
        name="Error", description="Estimated relative mean squared error (relMSE) at which it ends; 0: none", default=0.0,
        min=0.0, soft_max=0.1, precision=5, step=0.01)
    preview_samples: IntProperty(
        name="Viewport Samples", description="Samples per pixel of the viewport", default=64, min=1, soft_max=1024)
    max_depth: IntProperty(
        name="Max Depth", description="Scattering events of a path, Cycles' total bounces plus one; 0: unlimited",
        default=13, min=0, soft_max=64)
    integrator: EnumProperty(
        name="Integrator", default="auto", items=(
            ("auto", "Automatic", "The one that promises the least error for this scene, after a short trial"),
            ("bdpt", "Bidirectional", "Paths from the camera and from the lights, joined"),
            ("pt", "Path Tracing", "Paths from the camera alone"),
            ("lt", "Light Tracing", "Paths from the lights alone")))
    seed: IntProperty(name="Seed", description="Another seed, another noise", default=0, min=0)
    coordinator: StringProperty(
        name="Coordinator", description="http(s)://HOST:PORT of the farm; several with commas between; empty: that of the "
        "preferences, else this machine renders")
    pool: StringProperty(name="Pool", description="Workers of this pool render it; empty: any")
    priority: IntProperty(name="Priority", description="Higher first", default=0, soft_min=-10, soft_max=10)
    frames_ahead: IntProperty(
        name="Frames Ahead", description="Frames of an animation that the farm begins before Blender comes to them",
        default=3, min=0, max=16)
    sequence: StringProperty(name="Sequence", description="Of the last animation that was submitted")


class LightmillViewLayerSettings(bpy.types.PropertyGroup):
    use_pass_denoising: BoolProperty(
        name="Denoising Data", description="Normal, albedo and depth, through mirrors and glass, for the Denoise node")
    use_pass_alpha: BoolProperty(name="Alpha", description="Share of the pixel that is covered")
    use_pass_direct: BoolProperty(name="Direct", description="Light that came by at most one scattering event")
    use_pass_indirect: BoolProperty(name="Indirect", description="All the rest of the light")
    use_pass_volume_direct: BoolProperty(name="Volume Direct", description="Light that a medium scattered once")
    use_pass_volume_indirect: BoolProperty(
        name="Volume Indirect", description="Light whose last event was in a medium, after others")
    use_pass_variance: BoolProperty(name="Variance", description="Of one sample of the pixel")
    use_pass_sample_count: BoolProperty(name="Sample Count", description="Samples of the pixel")


CLASSES = (LightmillSceneSettings, LightmillViewLayerSettings)


def attach():
    bpy.types.Scene.lightmill = PointerProperty(type=LightmillSceneSettings)
    bpy.types.ViewLayer.lightmill = PointerProperty(type=LightmillViewLayerSettings)


def detach():
    del bpy.types.ViewLayer.lightmill
    del bpy.types.Scene.lightmill
