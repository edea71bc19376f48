"""Kinds of geometry, modifiers and instances."""
import math
import random

from stage import add, base_color, cube, dressed, feature, principled, radians, sphere, surface, tree

import bpy
import mathutils


def away(s):
    """The monkey goes, the floor and a lamp stay."""
    s.lit()
    bpy.data.objects.remove(s.monkey)


def plain(s):
    """The monkey without its modifier, with its flat faces."""
    s.lit()
    s.monkey.modifiers.clear()
    return s.monkey


def mesh(s, vertices, faces, name="Mesh", colour=(0.2, 0.5, 0.3)):
    data = bpy.data.meshes.new(name)
    data.from_pydata(vertices, [], faces)
    data.update()
    thing = s.put(data)
    data.materials.append(principled(name, colour))
    return thing


@feature
def geo_text(s):
    away(s)
    bpy.ops.object.text_add(location=(-1.5, 0, 0.3), rotation=(radians(70), 0, 0.4))
    text = dressed("Text", (0.8, 0.2, 0.1)).data
    text.body, text.extrude, text.bevel_depth, text.size = "Äbc 1", 0.15, 0.02, 1.4


@feature
def geo_curve_bevel(s):
    away(s)
    bpy.ops.curve.primitive_bezier_curve_add(radius=1.5, location=(0, 0, 1))
    curve = dressed("Curve", (0.2, 0.6, 0.8)).data
    curve.bevel_depth, curve.bevel_resolution, curve.use_fill_caps = 0.25, 4, True


@feature
def geo_curve_taper(s):
    away(s)
    bpy.ops.curve.primitive_bezier_curve_add(radius=1)
    taper = bpy.context.object
    taper.hide_render = True
    bpy.ops.curve.primitive_bezier_circle_add(radius=0.4)
    profile = bpy.context.object
    profile.hide_render = True
    bpy.ops.curve.primitive_bezier_curve_add(radius=1.5, location=(0, 0, 1))
    curve = dressed("Curve", (0.2, 0.6, 0.8)).data
    curve.bevel_mode, curve.bevel_object, curve.taper_object = "OBJECT", profile, taper


@feature
def geo_curve_filled(s):
    away(s)
    bpy.ops.curve.primitive_bezier_circle_add(radius=1.2, location=(0, 0, 1.2), rotation=(radians(80), 0, 0.3))
    curve = dressed("Curve", (0.8, 0.6, 0.1)).data
    curve.dimensions, curve.fill_mode, curve.extrude = "2D", "BOTH", 0.2


@feature
def geo_nurbs_surface(s):
    away(s)
    bpy.ops.surface.primitive_nurbs_surface_torus_add(radius=1, location=(0, 0, 1), rotation=(0.5, 0.3, 0))
    dressed("Torus", (0.3, 0.7, 0.3))


@feature
def geo_metaballs(s):
    away(s)
    bpy.ops.object.metaball_add(type="BALL", radius=1.5, location=(0, 0, 1))
    ball = dressed("Blob", (0.8, 0.2, 0.4)).data
    ball.render_resolution = 0.1
    more = ball.elements.new()
    more.co, more.radius = (1.2, 0, 0.3), 1.2


def particles(s, count=150):
    system = s.floor.modifiers.new("Particles", "PARTICLE_SYSTEM").particle_system.settings
    system.type, system.count, system.frame_start, system.frame_end, system.lifetime = "EMITTER", count, 1, 1, 100
    system.physics_type, system.use_rotations, system.particle_size, system.size_random = "NO", True, 0.3, 0.5
    s.scene.frame_set(1)
    return system


@feature
def geo_particles_of_object(s):
    s.lit()
    system = particles(s)
    thing = cube((0, 0, -20), 1)
    system.render_type, system.instance_object = "OBJECT", thing


@feature
def geo_particles_of_collection(s):
    s.lit()
    system = particles(s)
    bits = bpy.data.collections.new("Bits")
    bits.objects.link(cube((0, 0, -20), 1))
    bits.objects.link(sphere((0, 0, -20), 0.5, (0.8, 0.8, 0.1)))
    system.render_type, system.instance_collection = "COLLECTION", bits


@feature
def geo_particles_halo(s):
    """Cycles draws no halos."""
    s.lit()
    particles(s)


@feature
def geo_hair_children(s):
    s.lit()
    hair = s.monkey.modifiers.new("Hair", "PARTICLE_SYSTEM").particle_system.settings
    hair.type, hair.count, hair.hair_length, hair.use_modifier_stack = "HAIR", 300, 0.4, True
    hair.child_type, hair.rendered_child_count, hair.child_nbr = "INTERPOLATED", 10, 10
    hair.root_radius, hair.radius_scale = 2, 0.02


@feature
def geo_hair_alone(s):
    """The emitter is not shown; the hair is straight and thick."""
    s.lit()
    hair = s.monkey.modifiers.new("Hair", "PARTICLE_SYSTEM").particle_system.settings
    hair.type, hair.count, hair.hair_length, hair.radius_scale = "HAIR", 500, 0.6, 0.03
    s.monkey.show_instancer_for_render = False


def nodes_of(thing):
    """A new tree of geometry nodes on the thing: group, its input and output."""
    group = bpy.data.node_groups.new("Geometry", "GeometryNodeTree")
    group.inputs.new("NodeSocketGeometry", "Geometry")
    group.outputs.new("NodeSocketGeometry", "Geometry")
    thing.modifiers.new("Nodes", "NODES").node_group = group
    return group, group.nodes.new("NodeGroupInput"), group.nodes.new("NodeGroupOutput")


def chain(group, source, target, *kinds):
    """Nodes in a row between two; returns them."""
    made = [group.nodes.new("GeometryNode" + kind) for kind in kinds]
    line = [source, *made, target]
    for left, right in zip(line, line[1:]):
        out = next(o for o in left.outputs if o.type == "GEOMETRY")
        group.links.new(out, next(i for i in right.inputs if i.type == "GEOMETRY"))
    return made


@feature
def geo_nodes_material(s):
    """Geometry and its material both come from nodes."""
    away(s)
    thing = s.put(bpy.data.meshes.new("Nothing"), (0, 0, 1))
    group, source, target = nodes_of(thing)
    ball = group.nodes.new("GeometryNodeMeshIcoSphere")
    ball.inputs["Subdivisions"].default_value = 4
    paint, smooth = chain(group, ball, target, "SetMaterial", "SetShadeSmooth")
    paint.inputs["Material"].default_value = principled("Painted", (0.1, 0.7, 0.3))


@feature
def geo_nodes_curve_to_mesh(s):
    away(s)
    thing = s.put(bpy.data.meshes.new("Nothing"), (0, 0, 1))
    group, source, target = nodes_of(thing)
    spiral, circle = group.nodes.new("GeometryNodeCurveSpiral"), group.nodes.new("GeometryNodeCurvePrimitiveCircle")
    circle.inputs["Radius"].default_value = 0.12
    tube, paint = chain(group, spiral, target, "CurveToMesh", "SetMaterial")
    group.links.new(circle.outputs["Curve"], tube.inputs["Profile Curve"])
    paint.inputs["Material"].default_value = principled("Painted", (0.8, 0.5, 0.1))


@feature
def geo_nodes_points(s):
    """A cloud of points: spheres."""
    s.lit()
    s.monkey.modifiers.clear()
    group, source, target = nodes_of(s.monkey)
    points, paint = chain(group, source, target, "MeshToPoints", "SetMaterial")
    points.inputs["Radius"].default_value = 0.08
    paint.inputs["Material"].default_value = principled("Painted", (0.8, 0.5, 0.1))


@feature
def geo_nodes_instances_turned(s):
    """Instances with turns and sizes of their own, and the mesh beside them."""
    s.lit()
    bpy.ops.mesh.primitive_grid_add(x_subdivisions=8, y_subdivisions=8, size=6, location=(0, 1, 0.02))
    thing = dressed("Grid", (0.3, 0.3, 0.1))
    group, source, target = nodes_of(thing)
    make = group.nodes.new
    place, cone, join = make("GeometryNodeInstanceOnPoints"), make("GeometryNodeMeshCone"), make("GeometryNodeJoinGeometry")
    size, turn = make("FunctionNodeRandomValue"), make("FunctionNodeRandomValue")
    size.inputs[2].default_value, size.inputs[3].default_value = 0.1, 0.4
    turn.data_type = "FLOAT_VECTOR"
    group.links.new(source.outputs[0], place.inputs["Points"])
    group.links.new(cone.outputs[0], place.inputs["Instance"])
    group.links.new(size.outputs[1], place.inputs["Scale"])
    group.links.new(turn.outputs[0], place.inputs["Rotation"])
    group.links.new(place.outputs[0], join.inputs[0])
    group.links.new(source.outputs[0], join.inputs[0])
    group.links.new(join.outputs[0], target.inputs[0])


@feature
def geo_nodes_attribute(s):
    """A colour that nodes store, read by the material."""
    s.lit()
    group, source, target = nodes_of(s.monkey)
    store, = chain(group, source, target, "StoreNamedAttribute")
    store.data_type, store.domain = "FLOAT_COLOR", "POINT"
    store.inputs["Name"].default_value = "tint"
    position, positive = group.nodes.new("GeometryNodeInputPosition"), group.nodes.new("ShaderNodeVectorMath")
    positive.operation = "ABSOLUTE"
    group.links.new(position.outputs[0], positive.inputs[0])
    group.links.new(positive.outputs[0], next(i for i in store.inputs if i.type == "RGBA"))
    attribute = add(tree(s.monkey), "Attribute")
    attribute.attribute_name = "tint"
    base_color(s.monkey, attribute.outputs["Color"])


@feature
def geo_collection_instance(s):
    s.lit()
    bits = bpy.data.collections.new("Bits")
    bits.objects.link(s.monkey)
    bits.instance_offset = (0, 0, 1)
    for x in (-1.8, 1.8):
        empty = s.put(None, (x, 1, 1))
        empty.instance_type, empty.instance_collection = "COLLECTION", bits
        empty.scale, empty.rotation_euler = (0.6, 0.6, 0.6), (0, 0, x / 2)


@feature
def geo_instances_on_vertices(s):
    away(s)
    bpy.ops.mesh.primitive_uv_sphere_add(segments=12, ring_count=8, radius=1.2, location=(0, 0, 1.5))
    ball = dressed("Ball", (0.5, 0.5, 0.5))
    child = cube((0, 0, 0), 0.25)
    child.parent = ball
    ball.instance_type, ball.use_instance_vertices_rotation = "VERTS", True


@feature
def geo_instances_on_faces(s):
    away(s)
    bpy.ops.mesh.primitive_ico_sphere_add(subdivisions=2, radius=1.2, location=(0, 0, 1.5))
    ball = dressed("Ball", (0.5, 0.5, 0.5))
    child = cube((0, 0, 0), 0.8)
    child.parent = ball
    ball.instance_type, ball.use_instance_faces_scale, ball.show_instancer_for_render = "FACES", True, False


@feature
def geo_array(s):
    s.lit()
    s.monkey.scale, s.monkey.location = (0.4, 0.4, 0.4), (-1.8, 0, 0.5)
    array = s.monkey.modifiers.new("Array", "ARRAY")
    array.count, array.relative_offset_displace = 4, (1.1, 0.2, 0)


@feature
def geo_mirror(s):
    s.lit()
    s.monkey.location.x = 0
    s.monkey.data.transform(mathutils.Matrix.Translation((1.2, 0, 0)))
    s.monkey.modifiers.new("Mirror", "MIRROR")


@feature
def geo_negative_scale(s):
    s.lit()
    s.monkey.scale = (-1, 1, 1.2)


@feature
def geo_sheared(s):
    """A parent's scale shears its turned child."""
    s.lit()
    s.monkey.parent = s.put(None)
    s.monkey.parent.scale, s.monkey.rotation_euler = (1.6, 0.7, 1), (0, 0, 0.7)


@feature
def geo_flat(s):
    for face in plain(s).data.polygons:
        face.use_smooth = False


@feature
def geo_smooth_coarse(s):
    plain(s)


@feature
def geo_auto_smooth(s):
    monkey = plain(s)
    monkey.data.use_auto_smooth, monkey.data.auto_smooth_angle = True, radians(30)


@feature
def geo_custom_normals(s):
    data = plain(s).data
    data.use_auto_smooth = True
    data.normals_split_custom_set_from_vertices([v.co.normalized() for v in data.vertices])


@feature
def geo_sharp_edges(s):
    data = plain(s).data
    data.use_auto_smooth, data.auto_smooth_angle = True, math.pi
    for edge in data.edges:
        edge.use_edge_sharp = edge.index % 3 == 0


@feature
def geo_bevel_weighted_normals(s):
    away(s)
    box = cube((0, 0, 1), 1.6)
    box.rotation_euler = (0, 0, 0.4)
    bevel = box.modifiers.new("Bevel", "BEVEL")
    bevel.width, bevel.segments = 0.2, 3
    for face in box.data.polygons:
        face.use_smooth = True
    box.data.use_auto_smooth = True
    box.modifiers.new("Normals", "WEIGHTED_NORMAL")


@feature
def geo_edges_alone(s):
    """A mesh of edges and points shows nothing."""
    s.lit()
    wire = bpy.data.meshes.new("Wire")
    wire.from_pydata([(0, 0, 3), (1, 0, 3), (1, -2, 3)], [(0, 1), (1, 2)], [])
    s.put(wire)


@feature
def geo_two_slots(s):
    monkey = plain(s)
    monkey.data.materials.append(principled("Second", (0.1, 0.2, 0.8)))
    for face in monkey.data.polygons:
        face.material_index = face.index % 2


@feature
def geo_empty_slot(s):
    monkey = plain(s)
    monkey.data.materials.append(None)
    for face in monkey.data.polygons:
        face.material_index = face.index % 2


@feature
def geo_slot_of_object(s):
    """The object's material stands before its mesh's."""
    s.lit()
    slot = s.monkey.material_slots[0]
    slot.link = "OBJECT"
    slot.material = principled("Own", (0.1, 0.6, 0.2))


@feature
def geo_hidden_in_render(s):
    s.lit()
    cube((1.5, -1.5, 0.5)).hide_render = True


@feature
def geo_hidden_in_view(s):
    """Hidden in the viewport alone: drawn."""
    s.lit()
    cube((1.5, -1.5, 0.5)).hide_set(True)


@feature
def geo_excluded_collection(s):
    s.lit()
    bits = bpy.data.collections.new("Bits")
    s.scene.collection.children.link(bits)
    box = cube((1.5, -1.5, 0.5))
    s.scene.collection.objects.unlink(box)
    bits.objects.link(box)
    bpy.context.view_layer.layer_collection.children["Bits"].exclude = True


def in_collection(s, thing, **settings):
    """A collection of its own, with settings of the view layer."""
    bits = bpy.data.collections.new("Bits")
    s.scene.collection.children.link(bits)
    bits.objects.link(thing)
    s.scene.collection.objects.unlink(thing)
    for name, value in settings.items():
        setattr(bpy.context.view_layer.layer_collection.children["Bits"], name, value)


@feature
def geo_holdout(s):
    s.lit()
    s.scene.render.film_transparent = True
    cube((1.5, -1.5, 0.5)).is_holdout = True


@feature
def geo_holdout_collection(s):
    s.lit()
    in_collection(s, cube((1.5, -1.5, 0.5)), holdout=True)


@feature
def geo_indirect_collection(s):
    """Lights and shades and is not seen."""
    s.lit()
    in_collection(s, cube((1.5, -1.5, 0.5), colour=(0.9, 0.1, 0.1)), indirect_only=True)


@feature
def geo_shadow_catcher(s):
    s.lit()
    s.scene.render.film_transparent = True
    s.floor.is_shadow_catcher = True


@feature
def geo_casts_no_shadow(s):
    s.lit()
    s.monkey.visible_shadow = False


@feature
def geo_hidden_from_diffuse(s):
    s.background.inputs["Strength"].default_value = 10
    box = cube((1.2, -1, 0.5), colour=(0.9, 0.05, 0.05))
    box.visible_diffuse = False


@feature
def geo_hidden_from_glossy(s):
    s.lit()
    surface(s.floor, "BsdfGlossy", Color=(0.8, 0.8, 0.8, 1), Roughness=0.1)
    s.monkey.visible_glossy = False


@feature
def geo_hidden_from_transmission(s):
    s.lit()
    shader = tree(s.monkey).nodes["Principled BSDF"]
    shader.inputs["Transmission"].default_value, shader.inputs["Roughness"].default_value = 1, 0
    cube((-1, 2, 0.8), 1.5).visible_transmission = False


@feature
def geo_concave(s):
    """Faces of many corners that turn in on themselves."""
    away(s)
    star = [((1.2 if i % 2 else 0.5) * math.cos(i * math.pi / 5), 0.0, 1.3 + (1.2 if i % 2 else 0.5) * math.sin(i * math.pi / 5))
            for i in range(10)]
    thing = mesh(s, star, [tuple(range(10))])
    thing.rotation_euler = (0, 0, 0.6)


@feature
def geo_bent_quads(s):
    away(s)
    random.seed(5)
    n = 8
    points = [(x / 2 - 2, y / 2 - 2, 0.4 + random.random()) for y in range(n) for x in range(n)]
    mesh(s, points, [(y * n + x, y * n + x + 1, y * n + x + n + 1, y * n + x + n) for y in range(n - 1) for x in range(n - 1)])


@feature
def geo_no_area(s):
    """A triangle that is a line, beside a good one."""
    s.lit()
    mesh(s, [(1, -2, 0.5), (2, -2, 0.5), (1.5, -2, 1.2), (1.5, -2, 0.5)], [(0, 1, 2), (0, 3, 1)])


def scaled(s, factor):
    s.lit()
    for thing in list(s.scene.objects):
        thing.location *= factor
        if thing.type == "MESH":
            thing.scale *= factor
        elif thing.type == "LIGHT":
            thing.data.energy *= factor ** 2
    s.camera.data.clip_start, s.camera.data.clip_end = 0.1 * factor, 1000 * factor


@feature
def geo_tiny(s):
    scaled(s, 1e-3)


@feature
def geo_huge(s):
    scaled(s, 1000)


@feature
def geo_far_away(s):
    """10 km from the origin."""
    s.lit()
    for thing in s.scene.objects:
        thing.location.x += 10000


@feature
def geo_shape_keys(s):
    s.lit()
    s.monkey.shape_key_add(name="Basis")
    wide = s.monkey.shape_key_add(name="Wide")
    for point in wide.data:
        point.co.x *= 1.6
    wide.value = 0.7


@feature
def geo_armature(s):
    s.lit()
    bpy.ops.object.armature_add(location=(0, 0, 0))
    bones = bpy.context.object
    bones.pose.bones[0].rotation_mode = "XYZ"
    bones.pose.bones[0].rotation_euler = (0.3, 0, 0.5)
    group = s.monkey.vertex_groups.new(name="Bone")
    group.add([v.index for v in s.monkey.data.vertices if v.co.x > 0], 1, "REPLACE")
    s.monkey.modifiers.new("Armature", "ARMATURE").object = bones


@feature
def geo_displace_modifier(s):
    s.lit()
    clouds = bpy.data.textures.new("Clouds", "CLOUDS")
    displace = s.monkey.modifiers.new("Displace", "DISPLACE")
    displace.texture, displace.strength = clouds, 0.3


@feature
def geo_ocean(s):
    s.lit()
    ocean = s.floor.modifiers.new("Ocean", "OCEAN")
    ocean.geometry_mode, ocean.resolution, ocean.spatial_size, ocean.wave_scale = "GENERATE", 8, 20, 0.4
    s.floor.scale = (0.5, 0.5, 1)


@feature
def geo_modifiers(s):
    """Cut by a boolean and made thick."""
    s.lit()
    cutter = cube((0.6, -0.8, 1.4), 1)
    cutter.hide_render = True
    s.monkey.modifiers.new("Cut", "BOOLEAN").object = cutter
    s.monkey.modifiers.new("Solid", "SOLIDIFY").thickness = 0.05


@feature
def geo_wireframe_modifier(s):
    monkey = plain(s)
    monkey.modifiers.new("Wire", "WIREFRAME").thickness = 0.06


@feature
def geo_shared_mesh(s):
    s.lit()
    s.monkey.scale = (0.6, 0.6, 0.6)
    for x in (-2, 2):
        other = s.put(s.monkey.data, (x, 1, 0.7))
        other.rotation_euler, other.scale = (0, 0, x), (0.5, 0.5, 0.8)


@feature
def geo_shared_mesh_other_modifiers(s):
    """One mesh, two objects, of which one alone has a modifier."""
    s.lit()
    s.monkey.scale = (0.6, 0.6, 0.6)
    s.put(s.monkey.data, (1.5, 1, 0.7)).scale = (0.5, 0.5, 0.8)


@feature
def geo_parent_of_vertex(s):
    s.lit()
    ball = sphere((0, 0, 0), 0.3)
    ball.parent, ball.parent_type, ball.parent_vertices = s.monkey, "VERTEX", (0, 0, 0)


@feature
def geo_odd_names(s):
    s.lit()
    box = cube((1.5, -1.5, 0.5))
    box.name, box.data.name, box.data.materials[0].name = 'a "b" / \\ é', "][", 'mat "x"\n日本'


@feature
def geo_bent_along_curve(s):
    """A mesh that is bent along a curve."""
    s.lit()
    bpy.ops.curve.primitive_bezier_curve_add(radius=2, location=(0, 0, 0))
    path = bpy.context.object
    bend = s.monkey.modifiers.new("Bend", "CURVE")
    bend.object, bend.deform_axis = path, "POS_X"


@feature
def geo_new_hair(s):
    """Blender 3.4's hair curves."""
    s.lit()
    bpy.ops.object.select_all(action="DESELECT")
    bpy.context.view_layer.objects.active = s.monkey
    bpy.ops.object.curves_random_add(location=(0, 0, 1))
    dressed("Strand", (0.8, 0.6, 0.2))
