"""Lamps: kinds, shapes, node trees, visibility; and meshes that shine."""
from stage import add, cube, dressed, feature, link, radians, sphere, surface, tree

import bpy


def lamp_nodes(lamp):
    """The lamp's node tree and its Emission node."""
    lamp.data.use_nodes = True
    return lamp.data.node_tree, lamp.data.node_tree.nodes["Emission"]


@feature
def lamp_point_hard(s):
    s.light("POINT", 600, shadow_soft_size=0)


@feature
def lamp_point_coloured(s):
    s.light("POINT", 600, shadow_soft_size=0.2, color=(1, 0.4, 0.1))


@feature
def lamp_sun_hard(s):
    s.light("SUN", 4, (2, -2, 5), angle=0)


@feature
def lamp_sun_wide(s):
    s.light("SUN", 4, (2, -2, 5), angle=radians(90))


@feature
def lamp_spot_soft(s):
    s.light("SPOT", 1500, spot_size=radians(45), spot_blend=1, shadow_soft_size=0.5)


@feature
def lamp_spot_no_blend(s):
    s.light("SPOT", 1500, spot_size=radians(30), spot_blend=0, shadow_soft_size=0)


@feature
def lamp_spot_wide(s):
    s.light("SPOT", 1500, spot_size=radians(170), spot_blend=0.5, shadow_soft_size=0.1)


@feature
def lamp_spot_scaled(s):
    """A scaled spot has an oval cone."""
    s.light("SPOT", 1500, spot_size=radians(40), spot_blend=0.2, shadow_soft_size=0).scale = (2, 0.7, 1)


@feature
def lamp_area_square(s):
    s.light("AREA", 300, (3, -2, 5), shape="SQUARE", size=1.5)


@feature
def lamp_area_ellipse(s):
    s.light("AREA", 300, (3, -2, 5), shape="ELLIPSE", size=3, size_y=1)


@feature
def lamp_area_spread(s):
    s.light("AREA", 300, (3, -2, 5), shape="SQUARE", size=1, spread=radians(60))


@feature
def lamp_area_scaled(s):
    s.light("AREA", 300, (3, -2, 5), shape="DISK", size=1).scale = (3, 1, 1)


@feature
def lamp_area_behind_window(s):
    """A portal guides Cycles' rays and adds no light."""
    s.background.inputs["Strength"].default_value = 10
    s.light("AREA", 100, (0, 0, 6), size=4).data.cycles.is_portal = True


@feature
def lamp_negative(s):
    s.lit()
    s.light("POINT", -200, (-3, -3, 3), shadow_soft_size=0)


@feature
def lamp_zero(s):
    s.lit()
    s.light("AREA", 0, (0, 0, 5), size=2)


@feature
def lamp_node_strength(s):
    _, emission = lamp_nodes(s.light("POINT", 600, shadow_soft_size=0))
    emission.inputs["Color"].default_value, emission.inputs["Strength"].default_value = (0.3, 0.6, 1, 1), 2


@feature
def lamp_node_blackbody(s):
    nodes, emission = lamp_nodes(s.light("AREA", 300, (3, -2, 5), size=1))
    link(nodes, add(nodes, "Blackbody", Temperature=2800), emission)


@feature
def lamp_node_constant_falloff(s):
    nodes, emission = lamp_nodes(s.light("POINT", 600, shadow_soft_size=0))
    falloff = add(nodes, "LightFalloff", Strength=0.05)
    link(nodes, falloff.outputs["Constant"], emission, "Strength")


@feature
def lamp_node_linear_falloff(s):
    nodes, emission = lamp_nodes(s.light("SPOT", 600, shadow_soft_size=0, spot_size=radians(50)))
    falloff = add(nodes, "LightFalloff", Strength=0.3)
    link(nodes, falloff.outputs["Linear"], emission, "Strength")


@feature
def lamp_node_smooth_falloff(s):
    nodes, emission = lamp_nodes(s.light("POINT", 600, shadow_soft_size=0))
    link(nodes, add(nodes, "LightFalloff", Strength=1, Smooth=4).outputs["Quadratic"], emission, "Strength")


@feature
def lamp_node_gobo(s):
    """A spot with a chequered slide, read in its own directions."""
    nodes, emission = lamp_nodes(s.light("SPOT", 1500, spot_size=radians(45), shadow_soft_size=0))
    checker = add(nodes, "TexChecker", Scale=10, Color1=(1, 0.8, 0.2, 1), Color2=(0.05, 0.1, 0.3, 1))
    link(nodes, add(nodes, "TexCoord").outputs["Normal"], checker)
    link(nodes, checker.outputs["Color"], emission)


@feature
def lamp_node_area_gradient(s):
    nodes, emission = lamp_nodes(s.light("AREA", 400, (3, -2, 5), size=3))
    ramp = add(nodes, "ValToRGB")
    ramp.color_ramp.elements[0].color, ramp.color_ramp.elements[1].color = (1, 0.1, 0, 1), (0, 0.2, 1, 1)
    split = add(nodes, "SeparateXYZ")
    link(nodes, add(nodes, "NewGeometry").outputs["Parametric"], split)
    link(nodes, split.outputs["X"], ramp)
    link(nodes, ramp, emission)


@feature
def lamp_node_area_picture(s):
    """A round lamp with a pattern over it, seen in a mirror, too, and scaled."""
    surface(s.floor, "BsdfGlossy", Color=(0.8, 0.8, 0.8, 1), Roughness=0.1)
    lamp = s.light("AREA", 200, (-1, 3, 4), size=2, shape="DISK", color=(1, 0.9, 0.7))
    lamp.scale = (1.5, 1, 1)
    nodes, emission = lamp_nodes(lamp)
    emission.inputs["Strength"].default_value = 2
    checker = add(nodes, "TexChecker", Scale=4, Color1=(1, 0.8, 0.2, 1), Color2=(0.05, 0.1, 0.3, 1))
    link(nodes, add(nodes, "NewGeometry").outputs["Parametric"], checker)
    link(nodes, checker.outputs["Color"], emission)


@feature
def lamp_ies(s):
    """A lamp's measured intensities, from a text in the file."""
    text = bpy.data.texts.new("narrow.ies")
    text.write("IESNA:LM-63-2002\nTILT=NONE\n1 1000 1 7 1 1 2 0 0 0\n1 1 100\n0 15 30 45 60 75 90\n0\n"
               "1000 900 500 200 50 10 0\n")
    lamp = s.light("POINT", 15, (1, -1, 4), shadow_soft_size=0)
    lamp.rotation_euler = (0, 0, 0)
    nodes, emission = lamp_nodes(lamp)
    ies = add(nodes, "TexIES", Strength=1)
    ies.mode, ies.ies = "INTERNAL", text
    link(nodes, ies.outputs["Fac"], emission, "Strength")


@feature
def lamp_hidden_from_diffuse(s):
    s.lit()
    s.light("AREA", 300, (-3, -2, 4), size=2).visible_diffuse = False


@feature
def lamp_hidden_from_glossy(s):
    surface(s.monkey, "BsdfGlossy", Color=(0.9, 0.8, 0.6, 1), Roughness=0.3)
    s.light("AREA", 300, (3, -2, 4), size=2).visible_glossy = False


@feature
def lamp_no_shadow(s):
    s.light("POINT", 600, shadow_soft_size=0).data.cycles.cast_shadow = False


@feature
def lamp_not_sampled_on_hits(s):
    """Multiple importance sampling off: the lamp has no mirror image."""
    surface(s.floor, "BsdfGlossy", Color=(0.8, 0.8, 0.8, 1), Roughness=0.3)
    s.light("AREA", 300, (-1, 3, 4), size=2).data.cycles.use_multiple_importance_sampling = False


@feature
def lamp_max_bounces(s):
    """A lamp that lights directly and no further."""
    s.light("POINT", 600, shadow_soft_size=0).data.cycles.max_bounces = 0


@feature
def lamp_mirrored(s):
    """A sharp mirror shows an area lamp's face."""
    surface(s.floor, "BsdfGlossy", Color=(0.8, 0.8, 0.8, 1), Roughness=0)
    s.light("AREA", 100, (-1, 3, 4), size=2)


@feature
def lamp_many(s):
    for i in range(12):
        s.light("POINT", 60, (3 * (i % 4) - 4.5, 3 * (i // 4) - 4, 2 + i % 3), shadow_soft_size=0.1,
                color=(1, i / 12, 1 - i / 12))


@feature
def lamp_on_parent(s):
    """A lamp that inherits turn and size from an empty."""
    lamp = s.light("AREA", 200, (0, 0, 0), size=1)
    lamp.rotation_euler = (0, 0, 0)
    lamp.parent = s.put(None, (2, -2, 5))
    lamp.parent.rotation_euler, lamp.parent.scale = (0.4, 0.3, 0), (2, 2, 2)


@feature
def shine_principled(s):
    bpy.ops.mesh.primitive_plane_add(size=2, location=(2, -2, 4), rotation=(0.5, 0.5, 0))
    dressed("Lamp", (0, 0, 0), Emission=(1, 0.8, 0.5, 1), Emission_Strength=15)


@feature
def shine_principled_dim(s):
    """The monkey itself, a little."""
    s.lit()
    shader = tree(s.monkey).nodes["Principled BSDF"]
    shader.inputs["Emission"].default_value, shader.inputs["Emission Strength"].default_value = (0.1, 0.5, 1, 1), 0.5


@feature
def shine_zero(s):
    s.lit()
    surface(s.monkey, "Emission", Strength=0)


@feature
def shine_sphere(s):
    surface(sphere((2, -2, 3), 0.5), "Emission", Color=(1, 0.9, 0.7, 1), Strength=40)


@feature
def shine_small_sphere(s):
    surface(sphere((2, -2, 3), 0.05), "Emission", Color=(1, 0.9, 0.7, 1), Strength=4000)


@feature
def shine_one_side(s):
    """A plane that shines on its front alone, by Backfacing."""
    bpy.ops.mesh.primitive_plane_add(size=2, location=(1.5, 0.5, 1.5), rotation=(0, -1.4, 0.3))
    plane = dressed("Lamp", (0.2, 0.2, 0.2))
    nodes = tree(plane)
    mix = add(nodes, "MixShader")
    link(nodes, add(nodes, "NewGeometry").outputs["Backfacing"], mix, 0)
    link(nodes, add(nodes, "Emission", Strength=10), mix, 1)
    link(nodes, nodes.nodes["Principled BSDF"], mix, 2)
    link(nodes, mix, nodes.nodes["Material Output"])


@feature
def shine_blackbody(s):
    lamp = cube((2, -2, 3), 0.7)
    nodes = tree(lamp)
    link(nodes, add(nodes, "Blackbody", Temperature=3500), surface(lamp, "Emission", Strength=20))


@feature
def shine_textured(s):
    bpy.ops.mesh.primitive_plane_add(size=4, location=(0, 2.5, 2), rotation=(radians(90), 0, 0))
    screen = dressed("Screen", (0, 0, 0))
    nodes = tree(screen)
    checker = add(nodes, "TexChecker", Scale=4, Color1=(1, 0.1, 0.1, 1), Color2=(0.1, 0.3, 1, 1))
    link(nodes, add(nodes, "TexCoord").outputs["UV"], checker)
    link(nodes, checker, surface(screen, "Emission", Strength=4))


@feature
def shine_and_reflect(s):
    """Emission added to a diffuse shader."""
    s.lit()
    nodes = tree(s.monkey)
    both = add(nodes, "AddShader")
    link(nodes, add(nodes, "Emission", Color=(0, 0.4, 0.1, 1), Strength=0.5), both, 0)
    link(nodes, nodes.nodes["Principled BSDF"], both, 1)
    link(nodes, both, nodes.nodes["Material Output"])


@feature
def shine_hidden_from_camera(s):
    lamp = cube((0.5, -2, 2), 0.7)
    surface(lamp, "Emission", Strength=20)
    lamp.visible_camera = False


@feature
def shine_to_camera_only(s):
    """Emission that Light Path shows to the camera and to nothing else."""
    s.lit()
    nodes = tree(s.monkey)
    mix = add(nodes, "MixShader")
    link(nodes, add(nodes, "LightPath").outputs["Is Camera Ray"], mix, 0)
    link(nodes, nodes.nodes["Principled BSDF"], mix, 1)
    link(nodes, add(nodes, "Emission", Color=(0.2, 0.8, 0.2, 1), Strength=2), mix, 2)
    link(nodes, mix, nodes.nodes["Material Output"])
