"""Volumes: shaders in cubes and balls, files, the world's, overlaps."""
from stage import add, cube, feature, link, principled, sphere, tree

import bpy


def filled(thing, *shaders, hollow=True):
    """A volume shader in place of the thing's surface; several are added up. Each: (node's kind, sockets)."""
    nodes = tree(thing)
    made = [add(nodes, kind, **values) for kind, values in shaders]
    out = made[0]
    for more in made[1:]:
        both = add(nodes, "AddShader")
        link(nodes, out, both, 0)
        link(nodes, more, both, 1)
        out = both
    if hollow:
        nodes.nodes.remove(nodes.nodes["Principled BSDF"])
    link(nodes, out, nodes.nodes["Material Output"], "Volume")
    return made[0]


def box(location=(0, 0, 1.52), size=3):
    """Above the floor. Where its bottom and the floor were one, half of Cycles' rays would pass both."""
    return cube(location, size)


@feature
def vol_absorption(s):
    s.lit()
    filled(box(), ("VolumeAbsorption", dict(Color=(0.2, 0.6, 0.9, 1), Density=0.6)))


@feature
def vol_scatter_forward(s):
    s.lit()
    filled(box(), ("VolumeScatter", dict(Color=(0.9, 0.7, 0.5, 1), Density=0.5, Anisotropy=0.7)))


@feature
def vol_scatter_back(s):
    s.lit()
    filled(box(), ("VolumeScatter", dict(Density=0.5, Anisotropy=-0.5)))


@feature
def vol_principled(s):
    s.lit()
    filled(box(), ("VolumePrincipled", dict(Color=(0.7, 0.4, 0.2, 1), Density=0.6, Anisotropy=0.2)))


@feature
def vol_principled_absorbing(s):
    s.lit()
    filled(box(), ("VolumePrincipled", {"Color": (0.7, 0.7, 0.7, 1), "Density": 0.6, "Absorption_Color": (0.3, 0.1, 0.05, 1)}))


@feature
def vol_principled_emission(s):
    filled(box(), ("VolumePrincipled", {"Density": 0.3, "Emission_Strength": 0.2, "Emission_Color": (0.2, 0.5, 1, 1)}))


@feature
def vol_principled_blackbody(s):
    filled(box(), ("VolumePrincipled", {"Density": 0.3, "Blackbody_Intensity": 1, "Temperature": 1800}))


@feature
def vol_emission(s):
    filled(box(), ("Emission", dict(Color=(1, 0.4, 0.1, 1), Strength=0.2)))


@feature
def vol_added(s):
    s.lit()
    filled(box(), ("VolumeScatter", dict(Density=0.3)), ("VolumeAbsorption", dict(Color=(0.9, 0.5, 0.2, 1), Density=0.4)),
           ("Emission", dict(Color=(0, 0.2, 1, 1), Strength=0.05)))


@feature
def vol_mixed(s):
    s.lit()
    cloud = box()
    nodes = tree(cloud)
    mix = add(nodes, "MixShader", Fac=0.3)
    link(nodes, add(nodes, "VolumeScatter", Density=0.8), mix, 1)
    link(nodes, add(nodes, "VolumeAbsorption", Density=0.8, Color=(0.8, 0.3, 0.2, 1)), mix, 2)
    nodes.nodes.remove(nodes.nodes["Principled BSDF"])
    link(nodes, mix, nodes.nodes["Material Output"], "Volume")


@feature
def vol_in_glass(s):
    """Coloured water: a surface of glass and absorption."""
    s.light("AREA", 300, (3, -2, 5), size=3)
    ball = sphere((0, -1.5, 1), 0.9)
    shader = tree(ball).nodes["Principled BSDF"]
    shader.inputs["Transmission"].default_value, shader.inputs["Roughness"].default_value = 1, 0
    shader.inputs["Base Color"].default_value = (1, 1, 1, 1)
    filled(ball, ("VolumeAbsorption", dict(Color=(0.9, 0.3, 0.2, 1), Density=1.2)), hollow=False)


@feature
def vol_in_ball(s):
    s.lit()
    filled(sphere((0, 0, 1.5), 1.6), ("VolumeScatter", dict(Color=(0.5, 0.8, 0.9, 1), Density=0.7)))


@feature
def vol_camera_inside(s):
    s.lit()
    filled(box((0, 0, 5), 14), ("VolumeScatter", dict(Density=0.06)))


@feature
def vol_two_overlap(s):
    s.lit()
    filled(box((-0.5, 0, 1.5), 2.5), ("VolumeScatter", dict(Color=(0.9, 0.3, 0.3, 1), Density=0.4)))
    filled(box((0.8, -0.3, 1.2), 2), ("VolumeAbsorption", dict(Color=(0.2, 0.4, 0.9, 1), Density=0.8)))


@feature
def vol_nested(s):
    s.lit()
    filled(box(size=3), ("VolumeScatter", dict(Density=0.2)))
    filled(sphere((0.6, -0.8, 1.5), 0.5), ("VolumeAbsorption", dict(Color=(0.1, 0.7, 0.2, 1), Density=2)))


def cloud_of_noise():
    """Density by a noise in object coordinates."""
    cloud = box()
    scatter = filled(cloud, ("VolumeScatter", {}))
    nodes = tree(cloud)
    noise = add(nodes, "TexNoise", Scale=1)
    link(nodes, add(nodes, "TexCoord").outputs["Object"], noise)
    ramp = add(nodes, "MapRange")
    ramp.inputs["From Min"].default_value, ramp.inputs["From Max"].default_value = 0.45, 0.7
    ramp.inputs["To Max"].default_value = 3
    link(nodes, noise.outputs["Fac"], ramp, "Value")
    link(nodes, ramp, scatter, "Density")
    return cloud


@feature
def vol_noise(s):
    s.lit()
    cloud_of_noise()


@feature
def vol_gradient(s):
    """Fog that thins upwards."""
    s.lit()
    fog = box()
    shader = filled(fog, ("VolumePrincipled", {}))
    nodes = tree(fog)
    split = add(nodes, "SeparateXYZ")
    link(nodes, add(nodes, "TexCoord").outputs["Generated"], split)
    thin = add(nodes, "MapRange")
    thin.inputs["To Min"].default_value, thin.inputs["To Max"].default_value = 1, 0
    link(nodes, split.outputs["Z"], thin, "Value")
    link(nodes, thin, shader, "Density")


@feature
def vol_textured_emission(s):
    fire = box()
    shader = filled(fire, ("Emission", dict(Strength=0.4)))
    nodes = tree(fire)
    checker = add(nodes, "TexChecker", Scale=3, Color1=(1, 0.3, 0, 1), Color2=(0, 0.1, 0.5, 1))
    link(nodes, add(nodes, "TexCoord").outputs["Generated"], checker)
    link(nodes, checker, shader)


@feature
def vol_scaled(s):
    """Density is by the world's metre, whatever the object's scale."""
    s.lit()
    cloud = cube((0, 0, 1.02), 1, scale=(4, 3, 2))
    filled(cloud, ("VolumeScatter", dict(Density=0.5)))


@feature
def vol_instances(s):
    s.lit()
    cloud = cube((-1.5, -1, 0.62), 1.2)
    filled(cloud, ("VolumeScatter", dict(Density=1, Color=(0.9, 0.9, 0.4, 1))))
    s.put(cloud.data, (1.5, -1, 0.62))


@feature
def vol_world_absorption(s):
    s.light("AREA", 300, (3, -2, 5), size=2)
    nodes = s.world.node_tree
    link(nodes, add(nodes, "VolumeAbsorption", Color=(0.8, 0.4, 0.3, 1), Density=0.1), nodes.nodes["World Output"], "Volume")


@feature
def vol_world_principled(s):
    s.lit()
    nodes = s.world.node_tree
    link(nodes, add(nodes, "VolumePrincipled", Density=0.05, Color=(0.5, 0.6, 0.8, 1)), nodes.nodes["World Output"], "Volume")


@feature
def vol_lit_by_spot(s):
    """A beam in fog."""
    s.light("SPOT", 3000, (3, -1, 4), spot_size=0.5, spot_blend=0.2, shadow_soft_size=0)
    filled(box((0, 0, 2.5), 8), ("VolumeScatter", dict(Density=0.08, Anisotropy=0.3)))


@feature
def vol_lit_by_sun(s):
    s.light("SUN", 3, (2, -2, 5), angle=0.1)
    filled(box(), ("VolumeScatter", dict(Density=0.6)))


@feature
def vol_surface_and_volume(s):
    """A diffuse, half see-through skin around a fog."""
    s.lit()
    ball = sphere((0, -0.5, 1.2), 1.2)
    tree(ball).nodes["Principled BSDF"].inputs["Alpha"].default_value = 0.3
    filled(ball, ("VolumeScatter", dict(Density=1)), hollow=False)


@feature
def vol_of_nodes(s):
    """A fog that geometry nodes make: OpenVDB."""
    s.lit()
    cloud = s.put(bpy.data.volumes.new("Cloud"), (0, 0, 1.5))
    group = bpy.data.node_groups.new("Fog", "GeometryNodeTree")
    group.inputs.new("NodeSocketGeometry", "Geometry")
    group.outputs.new("NodeSocketGeometry", "Geometry")
    fog = group.nodes.new("GeometryNodeVolumeCube")
    for name, value in (("Resolution X", 24), ("Resolution Y", 24), ("Resolution Z", 24), ("Density", 0.6)):
        fog.inputs[name].default_value = value
    paint = group.nodes.new("GeometryNodeSetMaterial")
    group.links.new(fog.outputs[0], paint.inputs["Geometry"])
    group.links.new(paint.outputs[0], group.nodes.new("NodeGroupOutput").inputs[0])
    cloud.modifiers.new("Fog", "NODES").node_group = group
    material = principled("Fog", (1, 1, 1))
    nodes = material.node_tree
    nodes.nodes.remove(nodes.nodes["Principled BSDF"])
    link(nodes, add(nodes, "VolumePrincipled", Density=1), nodes.nodes["Material Output"], "Volume")
    paint.inputs["Material"].default_value = material
