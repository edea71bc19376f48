"""Features: shader nodes, how they are mixed, and what a material may ask for."""
import bpy

from stage import add, feature, principled, surface, tree


def body(s, **sockets):
    """The monkey's Principled BSDF under the lamp, with other values."""
    s.lit()
    shader = tree(s.monkey).nodes["Principled BSDF"]
    for name, value in sockets.items():
        shader.inputs[name.replace("_", " ")].default_value = value
    return shader


def output(thing):
    return tree(thing).nodes["Material Output"]


@feature
def mat_metallic(s):
    body(s, Metallic=1, Roughness=0.3)


@feature
def mat_rough_metal_multiscatter(s):
    body(s, Metallic=1, Roughness=0.8).distribution = "MULTI_GGX"


@feature
def mat_specular(s):
    body(s, Specular=1, Roughness=0.15)


@feature
def mat_specular_tint(s):
    body(s, Specular=0.8, Specular_Tint=1, Roughness=0.3)


@feature
def mat_sheen(s):
    body(s, Sheen=1, Sheen_Tint=0.8)


@feature
def mat_clearcoat(s):
    body(s, Clearcoat=1, Clearcoat_Roughness=0.05)


@feature
def mat_clearcoat_normal(s):
    shader = body(s, Clearcoat=1, Clearcoat_Roughness=0.1)
    nodes = tree(s.monkey)
    bump = add(nodes, "Bump", Strength=0.5, Distance=0.1)
    nodes.links.new(add(nodes, "TexNoise", Scale=5).outputs[0], bump.inputs["Height"])
    nodes.links.new(bump.outputs[0], shader.inputs["Clearcoat Normal"])


@feature
def mat_anisotropic(s):
    shader = body(s, Metallic=1, Roughness=0.4, Anisotropic=0.9)
    nodes = tree(s.monkey)
    tangent = add(nodes, "Tangent")
    tangent.direction_type, tangent.axis = "RADIAL", "Z"
    nodes.links.new(tangent.outputs[0], shader.inputs["Tangent"])


@feature
def mat_anisotropic_default_tangent(s):
    body(s, Metallic=1, Roughness=0.4, Anisotropic=0.7)


@feature
def mat_transmission_rough(s):
    body(s, Transmission=1, Roughness=0.4)


@feature
def mat_transmission_half(s):
    body(s, Transmission=0.5, Roughness=0.2)


@feature
def mat_emission(s):
    shader = body(s)
    shader.inputs["Emission"].default_value, shader.inputs["Emission Strength"].default_value = (0.2, 0.8, 0.3, 1), 2


@feature
def mat_alpha(s):
    body(s, Alpha=0.4)


@feature
def mat_alpha_texture(s):
    shader = body(s)
    nodes = tree(s.monkey)
    nodes.links.new(add(nodes, "TexChecker", Scale=8).outputs["Fac"], shader.inputs["Alpha"])


@feature
def mat_subsurface_node(s):
    s.lit()
    surface(s.monkey, "SubsurfaceScattering", Color=(0.9, 0.6, 0.4, 1), Scale=0.3)


@feature
def mat_oren_nayar(s):
    s.lit()
    surface(s.monkey, "BsdfDiffuse", Color=(0.6, 0.5, 0.3, 1), Roughness=1)


@feature
def mat_glossy_beckmann(s):
    s.lit()
    surface(s.monkey, "BsdfGlossy", Color=(0.9, 0.7, 0.3, 1), Roughness=0.4)
    tree(s.monkey).nodes["Glossy BSDF"].distribution = "BECKMANN"


@feature
def mat_glossy_sharp(s):
    s.lit()
    surface(s.monkey, "BsdfGlossy", Color=(0.9, 0.9, 0.9, 1))
    tree(s.monkey).nodes["Glossy BSDF"].distribution = "SHARP"


@feature
def mat_anisotropic_bsdf(s):
    s.lit()
    surface(s.monkey, "BsdfAnisotropic", Color=(0.8, 0.8, 0.8, 1), Roughness=0.3, Anisotropy=0.8, Rotation=0.2)


@feature
def mat_glass_bsdf_rough(s):
    s.lit()
    surface(s.monkey, "BsdfGlass", Color=(0.9, 0.95, 1, 1), Roughness=0.3, IOR=1.5)


@feature
def mat_refraction(s):
    s.lit()
    surface(s.monkey, "BsdfRefraction", Roughness=0.2, IOR=1.2)


@feature
def mat_velvet(s):
    s.lit()
    surface(s.monkey, "BsdfVelvet", Color=(0.7, 0.2, 0.6, 1), Sigma=0.6)


@feature
def mat_toon(s):
    s.lit()
    surface(s.monkey, "BsdfToon", Color=(0.7, 0.4, 0.2, 1), Size=0.6, Smooth=0.2)


def furry(s, kind, **values):
    """Hair on the monkey with this shader."""
    s.lit()
    hair = s.monkey.modifiers.new("Hair", "PARTICLE_SYSTEM").particle_system.settings
    hair.type, hair.count, hair.hair_length, hair.use_modifier_stack, hair.material = "HAIR", 1500, 0.4, True, 2
    s.monkey.data.materials.append(principled("Hair", (0.5, 0.3, 0.1)))
    nodes = s.monkey.data.materials[1].node_tree
    nodes.links.new(add(nodes, kind, **values).outputs[0], nodes.nodes["Material Output"].inputs[0])


@feature
def mat_hair_bsdf(s):
    furry(s, "BsdfHair", Color=(0.6, 0.4, 0.2, 1))


@feature
def mat_hair_principled(s):
    furry(s, "BsdfHairPrincipled")


@feature
def mat_holdout(s):
    s.lit()
    surface(s.monkey, "Holdout")


@feature
def mat_add_shader(s):
    s.lit()
    nodes = tree(s.monkey)
    both = add(nodes, "AddShader")
    nodes.links.new(add(nodes, "BsdfDiffuse", Color=(0.3, 0.1, 0.1, 1)).outputs[0], both.inputs[0])
    nodes.links.new(add(nodes, "Emission", Color=(0.1, 0.2, 0.8, 1), Strength=0.5).outputs[0], both.inputs[1])
    nodes.links.new(both.outputs[0], output(s.monkey).inputs[0])


@feature
def mat_mix_transparent(s):
    s.lit()
    nodes = tree(s.monkey)
    mix = add(nodes, "MixShader", Fac=0.4)
    nodes.links.new(add(nodes, "BsdfTransparent").outputs[0], mix.inputs[1])
    nodes.links.new(nodes.nodes["Principled BSDF"].outputs[0], mix.inputs[2])
    nodes.links.new(mix.outputs[0], output(s.monkey).inputs[0])


@feature
def mat_layer_weight(s):
    s.lit()
    nodes = tree(s.monkey)
    mix = add(nodes, "MixShader")
    nodes.links.new(add(nodes, "LayerWeight", Blend=0.4).outputs["Facing"], mix.inputs[0])
    nodes.links.new(add(nodes, "BsdfDiffuse", Color=(0.7, 0.1, 0.1, 1)).outputs[0], mix.inputs[1])
    nodes.links.new(add(nodes, "BsdfGlossy", Roughness=0.2).outputs[0], mix.inputs[2])
    nodes.links.new(mix.outputs[0], output(s.monkey).inputs[0])


@feature
def mat_glass_shadow_trick(s):
    """Glass that shadow rays pass: the usual way to light a room through a window."""
    s.lit()
    nodes = tree(s.monkey)
    mix = add(nodes, "MixShader")
    nodes.links.new(add(nodes, "LightPath").outputs["Is Shadow Ray"], mix.inputs[0])
    nodes.links.new(add(nodes, "BsdfGlass", IOR=1.45).outputs[0], mix.inputs[1])
    nodes.links.new(add(nodes, "BsdfTransparent", Color=(0.8, 0.9, 0.8, 1)).outputs[0], mix.inputs[2])
    nodes.links.new(mix.outputs[0], output(s.monkey).inputs[0])


@feature
def mat_backfacing(s):
    s.lit()
    s.monkey.modifiers.clear()
    bpy.ops.mesh.primitive_plane_add(size=2, location=(1.6, -1, 1), rotation=(1.2, 0, 2.4))
    sheet = bpy.context.object
    sheet.data.materials.append(principled("Sheet", (1, 1, 1)))
    nodes = tree(sheet)
    mix = add(nodes, "MixShader")
    nodes.links.new(add(nodes, "NewGeometry").outputs["Backfacing"], mix.inputs[0])
    nodes.links.new(add(nodes, "BsdfDiffuse", Color=(0.1, 0.6, 0.1, 1)).outputs[0], mix.inputs[1])
    nodes.links.new(add(nodes, "BsdfDiffuse", Color=(0.6, 0.1, 0.6, 1)).outputs[0], mix.inputs[2])
    nodes.links.new(mix.outputs[0], output(sheet).inputs[0])


@feature
def mat_group(s):
    s.lit()
    group = bpy.data.node_groups.new("Paint", "ShaderNodeTree")
    group.inputs.new("NodeSocketColor", "Tint").default_value = (0.1, 0.5, 0.7, 1)
    group.outputs.new("NodeSocketShader", "Shader")
    start, end = group.nodes.new("NodeGroupInput"), group.nodes.new("NodeGroupOutput")
    shader = group.nodes.new("ShaderNodeBsdfDiffuse")
    group.links.new(start.outputs[0], shader.inputs[0])
    group.links.new(shader.outputs[0], end.inputs[0])
    nodes = tree(s.monkey)
    node = nodes.nodes.new("ShaderNodeGroup")
    node.node_tree = group
    nodes.links.new(node.outputs[0], output(s.monkey).inputs[0])


@feature
def mat_without_nodes(s):
    s.lit()
    material = s.monkey.data.materials[0]
    material.use_nodes, material.diffuse_color = False, (0.2, 0.3, 0.8, 1)


@feature
def mat_output_unlinked(s):
    s.lit()
    nodes = tree(s.monkey)
    nodes.links.remove(output(s.monkey).inputs[0].links[0])


@feature
def mat_displacement_bump(s):
    s.lit()
    nodes = tree(s.monkey)
    displacement = add(nodes, "Displacement", Scale=0.1)
    nodes.links.new(add(nodes, "TexVoronoi", Scale=6).outputs[0], displacement.inputs["Height"])
    nodes.links.new(displacement.outputs[0], output(s.monkey).inputs["Displacement"])


@feature
def mat_displacement_true(s):
    s.lit()
    s.monkey.modifiers[0].render_levels = 4
    s.monkey.data.materials[0].cycles.displacement_method = "DISPLACEMENT"
    nodes = tree(s.monkey)
    displacement = add(nodes, "Displacement", Scale=0.2)
    nodes.links.new(add(nodes, "TexNoise", Scale=3).outputs[0], displacement.inputs["Height"])
    nodes.links.new(displacement.outputs[0], output(s.monkey).inputs["Displacement"])


@feature
def mat_ambient_occlusion(s):
    s.lit()
    nodes = tree(s.monkey)
    nodes.links.new(add(nodes, "AmbientOcclusion", Distance=0.5).outputs["Color"], nodes.nodes["Principled BSDF"].inputs[0])
