"""Worlds: skies, pictures, procedural textures, visibility; and none."""
from stage import add, feature, link, radians

import bpy
import numpy


def sky(s, kind, strength=0.3, **settings):
    nodes = s.world.node_tree
    node = add(nodes, "TexSky")
    node.sky_type = kind
    for name, value in settings.items():
        setattr(node, name, value)
    link(nodes, node, s.background)
    s.background.inputs["Strength"].default_value = strength
    return node


def coordinates(s, texture, output="Generated"):
    link(s.world.node_tree, add(s.world.node_tree, "TexCoord").outputs[output], texture, "Vector")
    return texture


def surroundings(width=64, height=32):
    """A float picture with a gradient and a bright window."""
    y, x = numpy.mgrid[0:height, 0:width]
    pixels = numpy.ones((height, width, 4), "f4")
    pixels[..., 0], pixels[..., 1], pixels[..., 2] = 0.1 + x / width / 2, 0.25, 0.1 + y / height / 2
    pixels[height * 2 // 3:height * 4 // 5, width // 6:width // 4, :3] = 30
    image = bpy.data.images.new("Surroundings", width, height, float_buffer=True)
    image.pixels.foreach_set(pixels.ravel())
    image.pack()
    return image


def picture(s, projection="EQUIRECTANGULAR"):
    node = add(s.world.node_tree, "TexEnvironment")
    node.image, node.projection = surroundings(), projection
    link(s.world.node_tree, node, s.background)
    return node


@feature
def world_bright(s):
    s.background.inputs["Color"].default_value = (1, 0.9, 0.8, 1)
    s.background.inputs["Strength"].default_value = 2


@feature
def world_strength_by_maths(s):
    nodes = s.world.node_tree
    s.background.inputs["Color"].default_value = (0.5, 0.7, 1, 1)
    power = add(nodes, "Math")
    power.operation = "POWER"
    power.inputs[0].default_value, power.inputs[1].default_value = 1.5, 2
    link(nodes, power, s.background, "Strength")


@feature
def world_sky_preetham(s):
    sky(s, "PREETHAM", turbidity=4, sun_direction=(0.5, -0.5, 0.7))


@feature
def world_sky_hosek(s):
    sky(s, "HOSEK_WILKIE", turbidity=3, ground_albedo=0.5, sun_direction=(0.5, -0.5, 0.7))


@feature
def world_sky_nishita_sun(s):
    sky(s, "NISHITA", 0.05, sun_elevation=radians(35), sun_rotation=radians(120))


@feature
def world_sky_nishita_low(s):
    sky(s, "NISHITA", 0.2, sun_elevation=radians(3), sun_rotation=radians(200), dust_density=3, altitude=500)


@feature
def world_sky_nishita_big_sun(s):
    sky(s, "NISHITA", 0.05, sun_elevation=radians(50), sun_rotation=radians(120), sun_size=radians(5), sun_intensity=0.1)


@feature
def world_picture_turned(s):
    nodes = s.world.node_tree
    turn = add(nodes, "Mapping", Rotation=(0, 0, radians(100)))
    coordinates(s, turn)
    link(nodes, turn, picture(s))


@feature
def world_picture_tilted(s):
    nodes = s.world.node_tree
    turn = add(nodes, "Mapping", Rotation=(radians(30), radians(20), radians(100)))
    coordinates(s, turn)
    link(nodes, turn, picture(s))


@feature
def world_mirror_ball(s):
    coordinates(s, picture(s, "MIRROR_BALL"))


@feature
def world_picture_closest(s):
    picture(s).interpolation = "Closest"


@feature
def world_gradient(s):
    nodes = s.world.node_tree
    ramp = add(nodes, "ValToRGB")
    ramp.color_ramp.elements[0].color, ramp.color_ramp.elements[1].color = (0.1, 0.05, 0.02, 1), (0.5, 0.8, 1.5, 1)
    split = coordinates(s, add(nodes, "SeparateXYZ"))
    up = add(nodes, "MapRange")
    up.inputs["From Min"].default_value = -1
    link(nodes, split.outputs["Z"], up, "Value")
    link(nodes, up, ramp)
    link(nodes, ramp, s.background)


@feature
def world_gradient_texture(s):
    nodes = s.world.node_tree
    link(nodes, coordinates(s, add(nodes, "TexGradient")).outputs["Fac"], s.background)
    s.background.inputs["Strength"].default_value = 2


@feature
def world_checker(s):
    checker = coordinates(s, add(s.world.node_tree, "TexChecker", Scale=4, Color1=(2, 1, 0.2, 1), Color2=(0.1, 0.1, 0.4, 1)))
    link(s.world.node_tree, checker, s.background)


@feature
def world_noise(s):
    noise = coordinates(s, add(s.world.node_tree, "TexNoise", Scale=3))
    link(s.world.node_tree, noise.outputs["Color"], s.background)


@feature
def world_window_coordinates(s):
    """A backdrop that is fixed to the picture."""
    s.lit()
    gradient = coordinates(s, add(s.world.node_tree, "TexGradient"), "Window")
    link(s.world.node_tree, gradient, s.background)


@feature
def world_without_nodes(s):
    s.lit()
    s.world.use_nodes = False
    s.world.color = (0.1, 0.3, 0.2)


@feature
def world_none(s):
    s.lit()
    s.scene.world = None


@feature
def world_black(s):
    s.lit()
    s.background.inputs["Strength"].default_value = 0


@feature
def world_hidden_from_camera(s):
    s.background.inputs["Strength"].default_value = 10
    s.world.cycles_visibility.camera = False


@feature
def world_hidden_from_diffuse(s):
    s.lit()
    s.background.inputs["Strength"].default_value = 10
    s.world.cycles_visibility.diffuse = False


@feature
def world_hidden_from_glossy(s):
    s.background.inputs["Strength"].default_value = 10
    s.world.cycles_visibility.glossy = False


def seen_by(s, ray):
    """White light; `ray` sees green."""
    nodes = s.world.node_tree
    s.background.inputs["Color"].default_value = (0.7, 0.7, 0.7, 1)
    mix = add(nodes, "MixShader")
    link(nodes, add(nodes, "LightPath").outputs[ray], mix, 0)
    link(nodes, s.background, mix, 1)
    link(nodes, add(nodes, "Background", Color=(0.1, 1, 0.1, 1)), mix, 2)
    link(nodes, mix, nodes.nodes["World Output"])


@feature
def world_glossy_ray_mix(s):
    seen_by(s, "Is Glossy Ray")


@feature
def world_diffuse_ray_mix(s):
    seen_by(s, "Is Diffuse Ray")


@feature
def world_two_backgrounds_added(s):
    nodes = s.world.node_tree
    both = add(nodes, "AddShader")
    link(nodes, s.background, both, 0)
    link(nodes, add(nodes, "Background", Color=(0.6, 0.2, 0.1, 1)), both, 1)
    link(nodes, both, nodes.nodes["World Output"])


@feature
def world_of_emission(s):
    link(s.world.node_tree, add(s.world.node_tree, "Emission", Color=(0.4, 0.5, 0.9, 1), Strength=1.5),
         s.world.node_tree.nodes["World Output"])


@feature
def world_unsampled(s):
    """Multiple importance sampling of the world off."""
    s.background.inputs["Strength"].default_value = 10
    s.world.cycles.sampling_method = "NONE"
