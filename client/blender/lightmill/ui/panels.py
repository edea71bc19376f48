"""The engine's own panels. Those of Blender and Cycles that it shares: shared_panels.py."""
import bpy
from bl_ui.properties_view_layer import ViewLayerLightgroupsPanel


class _Panel:
    bl_space_type = "PROPERTIES"
    bl_region_type = "WINDOW"
    bl_context = "render"
    COMPAT_ENGINES = {"LIGHTMILL"}

    @classmethod
    def poll(cls, context):
        return context.engine in cls.COMPAT_ENGINES

    def rows(self, owner, *names):
        layout = self.layout
        layout.use_property_split = True
        layout.use_property_decorate = False
        column = layout.column()
        for name in names:
            column.prop(owner, name)
        return column


class LIGHTMILL_RENDER_PT_sampling(_Panel, bpy.types.Panel):
    bl_label = "Sampling"

    def draw(self, context):
        self.rows(context.scene.lightmill, "samples", "time_limit", "target_error", "preview_samples", "seed")


class LIGHTMILL_RENDER_PT_light_paths(_Panel, bpy.types.Panel):
    bl_label = "Light Paths"

    def draw(self, context):
        self.rows(context.scene.lightmill, "integrator", "max_depth")


class LIGHTMILL_RENDER_PT_farm(_Panel, bpy.types.Panel):
    bl_label = "Farm"

    def draw(self, context):
        settings = context.scene.lightmill
        column = self.rows(settings, "coordinator", "pool", "priority", "frames_ahead")
        column.separator()
        column.operator("lightmill.submit_animation")
        row = column.row()
        row.enabled = bool(settings.sequence)
        row.operator("lightmill.fetch_animation")
        if settings.sequence:
            column.label(text=f"Submitted as {settings.sequence}")


class LIGHTMILL_RENDER_PT_threads(_Panel, bpy.types.Panel):
    bl_label = "Performance"
    bl_options = {"DEFAULT_CLOSED"}

    def draw(self, context):
        render = context.scene.render
        column = self.rows(render, "threads_mode")
        threads = column.column()
        threads.enabled = render.threads_mode == "FIXED"
        threads.prop(render, "threads")
        column.prop(render, "preview_pixel_size", text="Viewport Pixel Size")


class LIGHTMILL_VIEWLAYER_PT_passes(_Panel, bpy.types.Panel):
    bl_label = "Passes"
    bl_context = "view_layer"

    def draw(self, context):
        self.rows(context.view_layer, "use_pass_combined", "use_pass_z", "use_pass_position", "use_pass_normal",
                  "use_pass_vector", "use_pass_uv", "use_pass_object_index", "use_pass_material_index",
                  "use_pass_diffuse_color", "use_pass_glossy_color")
        self.rows(context.view_layer.lightmill, "use_pass_denoising", "use_pass_alpha", "use_pass_direct",
                  "use_pass_indirect", "use_pass_variance", "use_pass_sample_count")


class LIGHTMILL_VIEWLAYER_PT_light_passes(_Panel, bpy.types.Panel):
    bl_label = "Light"
    bl_context = "view_layer"
    bl_parent_id = "LIGHTMILL_VIEWLAYER_PT_passes"

    def draw(self, context):
        self.rows(context.view_layer, "use_pass_diffuse_direct", "use_pass_diffuse_indirect", "use_pass_glossy_direct",
                  "use_pass_glossy_indirect", "use_pass_transmission_direct", "use_pass_transmission_indirect")
        self.rows(context.view_layer.lightmill, "use_pass_volume_direct", "use_pass_volume_indirect")
        self.rows(context.view_layer, "use_pass_emit")


class LIGHTMILL_VIEWLAYER_PT_light_groups(ViewLayerLightgroupsPanel):
    bl_parent_id = "LIGHTMILL_VIEWLAYER_PT_passes"
    COMPAT_ENGINES = {"LIGHTMILL"}


CLASSES = (LIGHTMILL_RENDER_PT_sampling, LIGHTMILL_RENDER_PT_light_paths, LIGHTMILL_RENDER_PT_farm,
           LIGHTMILL_RENDER_PT_threads, LIGHTMILL_VIEWLAYER_PT_passes,
           LIGHTMILL_VIEWLAYER_PT_light_passes, LIGHTMILL_VIEWLAYER_PT_light_groups)
