"""Features: textures, where they are looked up, and what is computed with them."""
import bpy
import numpy

from stage import add, base_color, feature, tree


def floor_texture(s, kind, output=0, coordinates="Object", **values):
    """A texture as the floor's colour."""
    s.lit()
    nodes = tree(s.floor)
    node = add(nodes, kind, **values)
    if coordinates:
        nodes.links.new(add(nodes, "TexCoord").outputs[coordinates], node.inputs["Vector"])
    base_color(s.floor, node.outputs[output])
    return node


def on_monkey(s, output, coordinates=None):
    """A checker on the monkey, looked up by an output of a node."""
    nodes = tree(s.monkey)
    checker = add(nodes, "TexChecker", Scale=6, Color1=(0.8, 0.2, 0.1, 1), Color2=(0.1, 0.2, 0.8, 1))
    nodes.links.new(output, checker.inputs["Vector"])
    base_color(s.monkey, checker.outputs["Color"])


def picture(name="Grid", kind="COLOR_GRID"):
    image = bpy.data.images.new(name, 256, 256)
    image.generated_type = kind
    image.pack()
    return image


@feature
def tex_brick(s):
    floor_texture(s, "TexBrick", Scale=1)


@feature
def tex_musgrave(s):
    node = floor_texture(s, "TexMusgrave", Scale=1, Detail=4)
    node.musgrave_type = "FBM"


@feature
def tex_musgrave_ridged(s):
    floor_texture(s, "TexMusgrave", Scale=0.7, Detail=3).musgrave_type = "RIDGED_MULTIFRACTAL"


@feature
def tex_voronoi(s):
    floor_texture(s, "TexVoronoi", 1, Scale=1)


@feature
def tex_voronoi_edges(s):
    floor_texture(s, "TexVoronoi", Scale=1).feature = "DISTANCE_TO_EDGE"


@feature
def tex_voronoi_smooth(s):
    node = floor_texture(s, "TexVoronoi", Scale=1)
    node.feature, node.distance = "SMOOTH_F1", "EUCLIDEAN"


@feature
def tex_wave(s):
    floor_texture(s, "TexWave", Scale=0.5, Distortion=3)


@feature
def tex_magic(s):
    floor_texture(s, "TexMagic", Scale=1)


@feature
def tex_gradient(s):
    floor_texture(s, "TexGradient").gradient_type = "SPHERICAL"


@feature
def tex_white_noise(s):
    s.lit()
    nodes = tree(s.floor)
    snap = nodes.nodes.new("ShaderNodeVectorMath")
    snap.operation = "FLOOR"
    lifted = add(nodes, "Mapping", Location=(0.1, 0.1, 0.5))  # off the edges of the cells
    nodes.links.new(add(nodes, "TexCoord").outputs["Object"], lifted.inputs[0])
    nodes.links.new(lifted.outputs[0], snap.inputs[0])
    noise = add(nodes, "TexWhiteNoise")
    nodes.links.new(snap.outputs[0], noise.inputs["Vector"])
    base_color(s.floor, noise.outputs["Color"])


@feature
def tex_noise_4d(s):
    node = floor_texture(s, "TexNoise", 1, Scale=1, W=2.5, Distortion=1)
    node.noise_dimensions = "4D"


@feature
def tex_image_uv(s):
    s.lit()
    nodes = tree(s.monkey)
    texture = add(nodes, "TexImage")
    texture.image = picture()
    base_color(s.monkey, texture.outputs[0])


@feature
def tex_image_closest(s):
    s.lit()
    texture = add(tree(s.floor), "TexImage")
    image = bpy.data.images.new("Small", 4, 4)
    image.pixels = list(numpy.random.default_rng(1).random(64))
    image.pack()
    texture.image, texture.interpolation = image, "Closest"
    base_color(s.floor, texture.outputs[0])


@feature
def tex_image_cubic_smart(s):
    s.lit()
    texture = add(tree(s.floor), "TexImage")
    image = bpy.data.images.new("Small", 8, 8)
    image.pixels = list(numpy.random.default_rng(2).random(256))
    image.pack()
    texture.image, texture.interpolation = image, "Cubic"
    base_color(s.floor, texture.outputs[0])


@feature
def tex_image_clip(s):
    node = floor_texture(s, "TexImage")
    node.image, node.extension = picture(), "CLIP"


@feature
def tex_image_box(s):
    s.lit()
    nodes = tree(s.monkey)
    texture = add(nodes, "TexImage")
    texture.image, texture.projection, texture.projection_blend = picture(), "BOX", 0.3
    nodes.links.new(add(nodes, "TexCoord").outputs["Object"], texture.inputs[0])
    base_color(s.monkey, texture.outputs[0])


@feature
def tex_image_sphere(s):
    s.lit()
    nodes = tree(s.monkey)
    texture = add(nodes, "TexImage")
    texture.image, texture.projection = picture(), "SPHERE"
    nodes.links.new(add(nodes, "TexCoord").outputs["Generated"], texture.inputs[0])
    base_color(s.monkey, texture.outputs[0])


@feature
def tex_image_non_color(s):
    s.lit()
    nodes = tree(s.monkey)
    texture = add(nodes, "TexImage")
    texture.image = picture()
    texture.image.colorspace_settings.name = "Non-Color"
    nodes.links.new(texture.outputs[0], nodes.nodes["Principled BSDF"].inputs["Roughness"])


@feature
def tex_generated(s):
    s.lit()
    on_monkey(s, add(tree(s.monkey), "TexCoord").outputs["Generated"])


@feature
def tex_normal(s):
    s.lit()
    on_monkey(s, add(tree(s.monkey), "TexCoord").outputs["Normal"])


@feature
def tex_reflection(s):
    s.lit()
    on_monkey(s, add(tree(s.monkey), "TexCoord").outputs["Reflection"])


@feature
def tex_camera(s):
    s.lit()
    on_monkey(s, add(tree(s.monkey), "TexCoord").outputs["Camera"])


@feature
def tex_window(s):
    s.lit()
    on_monkey(s, add(tree(s.monkey), "TexCoord").outputs["Window"])


@feature
def tex_of_object(s):
    s.lit()
    empty = bpy.data.objects.new("Place", None)
    s.scene.collection.objects.link(empty)
    empty.location, empty.rotation_euler, empty.scale = (0.4, 0.2, 1), (0.5, 0.2, 0.7), (0.7, 0.7, 0.7)
    node = add(tree(s.monkey), "TexCoord")
    node.object = empty
    on_monkey(s, node.outputs["Object"])


@feature
def tex_mapping(s):
    s.lit()
    nodes = tree(s.monkey)
    mapping = add(nodes, "Mapping", Location=(0.3, 0.1, 0), Rotation=(0.2, 0.4, 0.8), Scale=(1, 2, 0.5))
    nodes.links.new(add(nodes, "TexCoord").outputs["Object"], mapping.inputs[0])
    on_monkey(s, mapping.outputs[0])


@feature
def tex_position(s):
    s.lit()
    on_monkey(s, add(tree(s.monkey), "NewGeometry").outputs["Position"])


@feature
def tex_pointiness(s):
    s.lit()
    nodes = tree(s.monkey)
    base_color(s.monkey, add(nodes, "NewGeometry").outputs["Pointiness"])


@feature
def tex_random_per_island(s):
    s.lit()
    base_color(s.monkey, add(tree(s.monkey), "NewGeometry").outputs["Random Per Island"])


@feature
def tex_object_info(s):
    s.lit()
    s.monkey.color = (0.2, 0.7, 0.4, 1)
    base_color(s.monkey, add(tree(s.monkey), "ObjectInfo").outputs["Color"])


@feature
def tex_second_uv(s):
    s.lit()
    s.floor.data.uv_layers.new(name="Second")
    for loop in s.floor.data.uv_layers["Second"].data:
        loop.uv = loop.uv[0] * 3, loop.uv[1] * 5
    nodes = tree(s.floor)
    uv = add(nodes, "UVMap")
    uv.uv_map = "Second"
    texture = add(nodes, "TexImage")
    texture.image = picture()
    nodes.links.new(uv.outputs[0], texture.inputs[0])
    base_color(s.floor, texture.outputs[0])


@feature
def tex_attribute_point_float(s):
    s.lit()
    s.monkey.modifiers.clear()
    rng = numpy.random.default_rng(3)
    attribute = s.monkey.data.attributes.new("weight", "FLOAT", "POINT")
    attribute.data.foreach_set("value", rng.random(len(s.monkey.data.vertices)).astype("f4"))
    node = add(tree(s.monkey), "Attribute")
    node.attribute_name = "weight"
    base_color(s.monkey, node.outputs["Fac"])


@feature
def tex_normal_map(s):
    s.lit()
    nodes = tree(s.floor)
    rng = numpy.random.default_rng(4)
    pixels = numpy.ones((64, 64, 4), "f4")
    pixels[..., :2] = 0.5 + 0.3 * (rng.random((64, 64, 2)) - 0.5)
    image = bpy.data.images.new("Normals", 64, 64, is_data=True)
    image.pixels.foreach_set(pixels.ravel())
    image.pack()
    texture = add(nodes, "TexImage")
    texture.image = image
    normal = add(nodes, "NormalMap", Strength=1)
    nodes.links.new(texture.outputs[0], normal.inputs["Color"])
    nodes.links.new(normal.outputs[0], nodes.nodes["Principled BSDF"].inputs["Normal"])
    nodes.nodes["Principled BSDF"].inputs["Roughness"].default_value = 0.2


@feature
def tex_bump_weak(s):
    s.lit()
    nodes = tree(s.floor)
    bump = add(nodes, "Bump", Strength=0.3, Distance=0.5)
    nodes.links.new(add(nodes, "TexNoise", Scale=40).outputs[0], bump.inputs["Height"])
    nodes.links.new(bump.outputs[0], nodes.nodes["Principled BSDF"].inputs["Normal"])


def through(s, kind, values=(), settings=(), socket="Color"):
    """A checker's colours through a node, on the floor."""
    s.lit()
    nodes = tree(s.floor)
    checker = add(nodes, "TexChecker", Scale=20, Color1=(0.7, 0.3, 0.1, 1), Color2=(0.1, 0.4, 0.6, 1))
    node = add(nodes, kind)
    for name, value in settings:
        setattr(node, name, value)
    for name, value in values:
        node.inputs[name].default_value = value
    nodes.links.new(checker.outputs["Color"], node.inputs[socket])
    base_color(s.floor, node.outputs[0])
    return node


@feature
def tex_hue_saturation(s):
    through(s, "HueSaturation", (("Hue", 0.7), ("Saturation", 1.5), ("Value", 0.9)))


@feature
def tex_invert_gamma(s):
    through(s, "Invert")


@feature
def tex_bright_contrast(s):
    through(s, "BrightContrast", (("Bright", 0.1), ("Contrast", 0.3)))


@feature
def tex_rgb_curves(s):
    curve = through(s, "RGBCurve").mapping
    curve.curves[3].points.new(0.4, 0.7)
    curve.update()


@feature
def tex_mix_overlay(s):
    through(s, "MixRGB", (("Fac", 0.8), ("Color2", (0.3, 0.6, 0.2, 1))), (("blend_type", "OVERLAY"),), "Color1")


@feature
def tex_separate_combine(s):
    s.lit()
    nodes = tree(s.floor)
    split, join = add(nodes, "SeparateColor"), add(nodes, "CombineColor")
    split.mode, join.mode = "HSV", "HSV"
    nodes.links.new(add(nodes, "TexChecker", Scale=20, Color1=(0.7, 0.3, 0.1, 1)).outputs[0], split.inputs[0])
    for a, b in ((0, 0), (2, 1), (1, 2)):
        nodes.links.new(split.outputs[a], join.inputs[b])
    base_color(s.floor, join.outputs[0])


@feature
def tex_map_range(s):
    s.lit()
    nodes = tree(s.floor)
    node = add(nodes, "MapRange")
    node.interpolation_type = "SMOOTHSTEP"
    node.inputs["From Min"].default_value, node.inputs["From Max"].default_value = 0.3, 0.7
    nodes.links.new(add(nodes, "TexNoise", Scale=8).outputs[0], node.inputs[0])
    base_color(s.floor, node.outputs[0])


@feature
def tex_math_chain(s):
    s.lit()
    nodes = tree(s.floor)
    first, second = nodes.nodes.new("ShaderNodeMath"), nodes.nodes.new("ShaderNodeMath")
    first.operation, second.operation = "SINE", "GREATER_THAN"
    split = add(nodes, "SeparateXYZ")
    nodes.links.new(add(nodes, "TexCoord").outputs["Object"], split.inputs[0])
    nodes.links.new(split.outputs[0], first.inputs[0])
    nodes.links.new(first.outputs[0], second.inputs[0])
    second.inputs[1].default_value = 0.2
    base_color(s.floor, second.outputs[0])


@feature
def tex_blackbody_wavelength(s):
    s.lit()
    base_color(s.floor, add(tree(s.floor), "Wavelength", Wavelength=560).outputs[0])


@feature
def tex_wireframe(s):
    s.lit()
    nodes = tree(s.monkey)
    s.monkey.modifiers.clear()
    base_color(s.monkey, add(nodes, "Wireframe", Size=0.02).outputs[0])


@feature
def tex_bevel(s):
    s.lit()
    nodes = tree(s.monkey)
    nodes.links.new(add(nodes, "Bevel", Radius=0.1).outputs[0], nodes.nodes["Principled BSDF"].inputs["Normal"])


@feature
def tex_roughness_by_noise(s):
    s.lit()
    nodes = tree(s.floor)
    nodes.links.new(add(nodes, "TexNoise", Scale=6).outputs[0], nodes.nodes["Principled BSDF"].inputs["Roughness"])
