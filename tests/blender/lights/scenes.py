"""Inside Blender: small scenes, each rendered by Cycles and written as a pbrt file in Lightmill's dialect.

    blender -b --factory-startup -P scenes.py -- FOLDER [CASE...]

FOLDER gets CASE.exr (linear) and CASE.pbrt. The scenes are of lights, visibility and cameras; their materials are the
few that both have alike: diffuse ones and a mirror.
"""
import math
import os
import sys

import bpy
import mathutils
import numpy

CASES = []
WIDTH, HEIGHT, SAMPLES = 96, 64, 1024


def case(build):
    CASES.append(build)
    return build


def look_at(thing, target):
    thing.rotation_euler = (mathutils.Vector(target) - thing.location).to_track_quat("-Z", "Y").to_euler()


class Stage:
    """A floor, a block, a mirror, a dim world and a camera; what a case adds comes as Blender's and as pbrt's."""

    def __init__(self, folder):
        bpy.ops.wm.read_factory_settings(use_empty=True)
        self.folder = folder
        self.scene = scene = bpy.context.scene
        scene.render.engine = "CYCLES"
        scene.render.resolution_x, scene.render.resolution_y = WIDTH, HEIGHT
        cycles = scene.cycles
        cycles.samples, cycles.use_denoising, cycles.use_adaptive_sampling = SAMPLES, False, False
        for bounces in ("max", "diffuse", "glossy", "transmission", "transparent_max"):
            setattr(cycles, bounces + "_bounces", 32)
        cycles.sample_clamp_direct = cycles.sample_clamp_indirect = cycles.blur_glossy = 0
        cycles.pixel_filter_type, cycles.filter_width = "BOX", 1
        settings = scene.render.image_settings
        settings.file_format, settings.color_depth, settings.color_mode = "OPEN_EXR", "32", "RGBA"
        scene.world = bpy.data.worlds.new("World")
        scene.world.use_nodes = True
        self.world((0.05, 0.06, 0.08))
        self.lines = []  # of the pbrt file's world
        self.hidden = {}  # of objects, by name
        self.camera_line = None
        bpy.ops.mesh.primitive_plane_add(size=20)
        self.paint("diffuse", (0.6, 0.6, 0.6))
        bpy.ops.mesh.primitive_cube_add(size=1.4, location=(0, 0, 0.75), rotation=(0, 0, 0.5))
        self.paint("diffuse", (0.8, 0.3, 0.15))
        bpy.ops.mesh.primitive_cube_add(size=1, location=(-2, 1.5, 1.2), rotation=(0, 0, 0.6))
        bpy.context.object.scale = (3, 0.1, 2.4)
        self.mirror = self.paint("mirror", (0.98, 0.98, 0.98))
        camera = self.camera = bpy.data.objects.new("Camera", bpy.data.cameras.new("Camera"))
        scene.collection.objects.link(camera)
        camera.location, camera.data.lens = (3.5, -5, 3), 35
        look_at(camera, (0, 0, 0.8))
        scene.camera = camera

    def without_mirror(self):
        """For lamps without a size, whose caustics Cycles does not find."""
        bpy.data.objects.remove(self.mirror)

    def paint(self, kind, colour):
        """The material of the object that was just made."""
        thing = bpy.context.object
        material = bpy.data.materials.new(kind)
        material.use_nodes = True
        nodes = material.node_tree
        shader = nodes.nodes.new({"diffuse": "ShaderNodeBsdfDiffuse", "mirror": "ShaderNodeBsdfGlossy",
                                  "emission": "ShaderNodeEmission"}[kind])
        shader.inputs[0].default_value = (*(min(c, 1) for c in colour), 1)
        if kind == "mirror":
            shader.distribution = "SHARP"
        if kind == "emission":
            shader.inputs[0].default_value = (*(c / max(colour) for c in colour), 1)
            shader.inputs[1].default_value = max(colour)
        nodes.links.new(shader.outputs[0], nodes.nodes["Material Output"].inputs[0])
        thing.data.materials.append(material)
        thing["pbrt"] = {"diffuse": 'Material "diffuse" "rgb reflectance" [%g %g %g]',
                         "mirror": 'Material "conductor" "rgb reflectance" [%g %g %g] "float roughness" 0',
                         "emission": 'Material "diffuse" "rgb reflectance" [0 0 0] AreaLightSource "diffuse" '
                                     '"rgb L" [%g %g %g] "bool twosided" true'}[kind] % colour
        return thing

    def world(self, colour):
        self.scene.world.node_tree.nodes["Background"].inputs[0].default_value = (*colour, 1)
        self.world_line = 'LightSource "infinite" "rgb L" [%g %g %g]' % colour

    def hide(self, thing, *kinds):
        self.hidden[thing.name] = kinds
        for kind in kinds:
            setattr(thing, "visible_" + kind, False)

    def lamp(self, kind, energy, location=(3, -3, 4), target=(0, 0, 0.8), **settings):
        data = bpy.data.lights.new(kind, kind)
        data.energy = energy
        for name, value in settings.items():
            setattr(data, name, value)
        lamp = bpy.data.objects.new(kind, data)
        self.scene.collection.objects.link(lamp)
        lamp.location = location
        look_at(lamp, target)
        return lamp

    def render(self, name):
        self.scene.render.filepath = os.path.join(self.folder, name + ".exr")
        bpy.ops.render.render(write_still=True)
        with open(os.path.join(self.folder, name + ".pbrt"), "w", encoding="utf-8") as out:
            out.write("\n".join(self.pbrt()) + "\n")

    def pbrt(self):
        flip = mathutils.Matrix.Diagonal((1, 1, -1, 1))
        yield "Transform " + numbers(flip @ self.camera.matrix_world.inverted())
        yield self.camera_line or perspective(self.scene, self.camera.data)
        size = self.scene.render
        yield (f'Film "rgb" "integer xresolution" {size.resolution_x} "integer yresolution" {size.resolution_y} '
               f'"string filename" "out.exr"')
        yield 'PixelFilter "box" "float xradius" 0.5 "float yradius" 0.5'
        yield 'Integrator "path" "integer maxdepth" 33'
        yield "WorldBegin"
        yield self.world_line
        yield from self.lines
        for thing in self.scene.objects:
            if thing.type not in ("MESH", "LIGHT"):
                continue
            kinds = list(self.hidden.get(thing.name, ()))
            yield "AttributeBegin"
            if thing.type == "LIGHT":
                yield "Transform " + numbers(thing.matrix_world)
                yield lamp_line(thing.data) + hidden(["camera"] + kinds)
            else:
                yield thing["pbrt"]
                yield mesh_line(thing) + hidden(kinds)
            yield "AttributeEnd"


def numbers(matrix):
    return "[" + " ".join(f"{matrix[row][column]:.9g}" for column in range(4) for row in range(4)) + "]"


def hidden(kinds):
    return ' "string hidden" [' + " ".join(f'"{kind}"' for kind in kinds) + "]" if kinds else ""


def mesh_line(thing):
    mesh = thing.data
    mesh.calc_loop_triangles()
    points = " ".join("%.9g %.9g %.9g" % (thing.matrix_world @ v.co)[:] for v in mesh.vertices)
    indices = " ".join("%d %d %d" % t.vertices[:] for t in mesh.loop_triangles)
    return f'Shape "trianglemesh" "point3 P" [{points}] "integer indices" [{indices}]'


def lamp_line(lamp):
    def rgb(name, strength):
        return f' "rgb {name}" [' + " ".join(f"{strength * c:.9g}" for c in lamp.color) + "]"
    degrees = math.degrees
    if lamp.type == "POINT":
        return f'LightSource "point" "float radius" {lamp.shadow_soft_size:g}' + rgb("I", lamp.energy / (4 * math.pi))
    if lamp.type == "SPOT":
        return (f'LightSource "spot" "point3 from" [0 0 0] "point3 to" [0 0 -1] "float radius" {lamp.shadow_soft_size:g}'
                f' "float coneangle" {degrees(lamp.spot_size) / 2:.9g} "float blend" {lamp.spot_blend:.9g}'
                + rgb("I", lamp.energy / (4 * math.pi)))
    if lamp.type == "SUN":
        return (f'LightSource "distant" "point3 from" [0 0 0] "point3 to" [0 0 -1] "float angle" '
                f'{degrees(lamp.angle) / 2:.9g}' + rgb("L", lamp.energy))
    round_ = lamp.shape in ("DISK", "ELLIPSE")
    height = lamp.size if lamp.shape in ("SQUARE", "DISK") else lamp.size_y
    area = lamp.size * height * (math.pi / 4 if round_ else 1)
    return (f'LightSource "area" "string shape" "{"ellipse" if round_ else "rectangle"}" "float width" {lamp.size:g} '
            f'"float height" {height:g} "float spread" {degrees(lamp.spread):.9g}' + rgb("L", lamp.energy / (4 * area)))


def perspective(scene, camera, more=""):
    aspect = (scene.render.resolution_y * scene.render.pixel_aspect_y) / (
        scene.render.resolution_x * scene.render.pixel_aspect_x)
    x, y = 2 * camera.shift_x, 2 * camera.shift_y
    fov = 2 * math.degrees(math.atan(camera.sensor_width / 2 / camera.lens))
    if camera.dof.use_dof:
        dof = camera.dof
        more += (f' "float lensradius" {camera.lens / 1000 / (2 * dof.aperture_fstop):.9g} "float focaldistance" '
                 f'{dof.focus_distance:g} "integer blades" {dof.aperture_blades} "float bladerotation" '
                 f'{math.degrees(dof.aperture_rotation):.9g} "float apertureratio" {dof.aperture_ratio:.9g}')
    return (f'Camera "perspective" "float fov" {fov:.9g} "float screenwindow" [{x - 1:.9g} {x + 1:.9g} '
            f'{y - aspect:.9g} {y + aspect:.9g}]{more}')


# Lamps

@case
def point_hard(s):
    s.without_mirror()
    s.lamp("POINT", 600, shadow_soft_size=0)


@case
def point_soft(s):
    s.lamp("POINT", 600, shadow_soft_size=0.7)


@case
def point_near(s):
    """Where a disk that faces the floor and a sphere would differ."""
    s.lamp("POINT", 100, (1.5, -1.5, 0.9), shadow_soft_size=0.6)


@case
def spot_hard(s):
    s.without_mirror()
    s.lamp("SPOT", 1500, spot_size=math.radians(60), spot_blend=0.3, shadow_soft_size=0)


@case
def spot_soft(s):
    s.lamp("SPOT", 1500, (1, -2, 2.5), spot_size=math.radians(70), spot_blend=0.8, shadow_soft_size=0.4)


@case
def sun_soft(s):
    s.lamp("SUN", 3, (2, -2, 5), angle=math.radians(15))


@case
def area_rectangle(s):
    s.lamp("AREA", 300, (2, -2, 3), shape="RECTANGLE", size=3, size_y=0.6)


@case
def area_ellipse(s):
    s.lamp("AREA", 300, (2, -2, 3), shape="ELLIPSE", size=2.5, size_y=1)


@case
def area_spread(s):
    s.lamp("AREA", 300, (2, -2, 3), shape="SQUARE", size=1.5, spread=math.radians(70))


@case
def area_behind(s):
    """The lamp is in the way of the camera and of another one's light."""
    s.lamp("AREA", 100, (1.2, -1.7, 1.6), shape="SQUARE", size=1.5)
    s.lamp("POINT", 600, (2.4, -3.4, 3), shadow_soft_size=0.1)


@case
def area_in_mirror(s):
    s.lamp("AREA", 200, (-0.5, -1.5, 1.8), (-2, 1.5, 1.2), shape="DISK", size=1)


# What is hidden

def block(s):
    bpy.ops.mesh.primitive_cube_add(size=1, location=(1.6, -1.2, 1.3))
    return s.paint("diffuse", (0.1, 0.2, 0.8))


@case
def hidden_camera(s):
    s.lamp("POINT", 600, shadow_soft_size=0.7)
    s.hide(block(s), "camera")


@case
def hidden_shadow(s):
    s.without_mirror()
    s.lamp("POINT", 600, shadow_soft_size=0.1)
    s.hide(block(s), "shadow")


@case
def hidden_glossy(s):
    s.lamp("POINT", 600, shadow_soft_size=0.7)
    thing = block(s)
    thing.location = (-0.8, -0.6, 1.6)
    s.hide(thing, "glossy")


@case
def hidden_diffuse(s):
    s.world((0.8, 0.8, 0.8))
    s.hide(block(s), "diffuse")


@case
def lamp_hidden_glossy(s):
    s.hide(s.lamp("AREA", 200, (-0.5, -1.5, 1.8), (-2, 1.5, 1.2), shape="DISK", size=1), "glossy")


@case
def lamp_hidden_diffuse(s):
    s.hide(s.lamp("AREA", 200, (-0.5, -1.5, 1.8), (-2, 1.5, 1.2), shape="DISK", size=1), "diffuse")


@case
def emitter_hidden_camera(s):
    bpy.ops.mesh.primitive_plane_add(size=1, location=(1.2, -1.7, 1.6), rotation=(0.4, 0, 0))
    s.hide(s.paint("emission", (9, 8, 6)), "camera")


@case
def world_seen_and_lighting(s):
    """Shows blue, lights with white."""
    nodes = s.scene.world.node_tree
    s.world((0.8, 0.8, 0.8))
    seen = nodes.nodes.new("ShaderNodeBackground")
    seen.inputs[0].default_value = (0, 0, 0.3, 1)
    mix = nodes.nodes.new("ShaderNodeMixShader")
    nodes.links.new(nodes.nodes.new("ShaderNodeLightPath").outputs["Is Camera Ray"], mix.inputs[0])
    nodes.links.new(nodes.nodes["Background"].outputs[0], mix.inputs[1])
    nodes.links.new(seen.outputs[0], mix.inputs[2])
    nodes.links.new(mix.outputs[0], nodes.nodes["World Output"].inputs[0])
    s.camera.location.z = 1.2
    look_at(s.camera, (0, 0, 1.2))
    s.world_line += hidden(["camera"])
    s.lines.append('LightSource "infinite" "rgb L" [0 0 0.3]' +
                   hidden(["diffuse", "glossy", "transmission", "volume_scatter", "shadow"]))


@case
def world_picture(s):
    """A picture with a window as bright as a sun, turned."""
    y, x = numpy.mgrid[0:32, 0:64]
    pixels = numpy.ones((32, 64, 4), "f4")
    pixels[..., 0], pixels[..., 1], pixels[..., 2] = 0.2 + x / 128, 0.3, 0.2 + y / 53
    pixels[22:24, 10:12, :3] = 200
    image = bpy.data.images.new("World", 64, 32, float_buffer=True)
    image.pixels.foreach_set(pixels.ravel())
    image.filepath_raw, image.file_format = os.path.join(s.folder, "world_picture_map.exr"), "OPEN_EXR"
    image.save()
    image = bpy.data.images.load(image.filepath_raw)
    image.colorspace_settings.name = "Linear"
    nodes = s.scene.world.node_tree
    texture = nodes.nodes.new("ShaderNodeTexEnvironment")
    texture.image, texture.interpolation = image, "Closest"
    mapping, place = nodes.nodes.new("ShaderNodeMapping"), nodes.nodes.new("ShaderNodeTexCoord")
    turn = mathutils.Euler((0.2, -0.3, 1.1))
    mapping.inputs["Rotation"].default_value = turn
    nodes.links.new(place.outputs["Generated"], mapping.inputs[0])
    nodes.links.new(mapping.outputs[0], texture.inputs[0])
    nodes.links.new(texture.outputs[0], nodes.nodes["Background"].inputs[0])
    to_world = turn.to_matrix().inverted().to_4x4()
    s.world_line = ("AttributeBegin Transform " + numbers(to_world) +
                    ' LightSource "infinite" "string filename" "world_picture_map.exr" "string mapping" '
                    '"equirectangular" AttributeEnd')


# Cameras

@case
def camera_shift(s):
    s.without_mirror()
    s.lamp("POINT", 600, shadow_soft_size=0)
    s.camera.data.shift_x, s.camera.data.shift_y = 0.25, -0.1


@case
def camera_pixel_aspect(s):
    s.without_mirror()
    s.lamp("POINT", 600, shadow_soft_size=0)
    s.scene.render.pixel_aspect_x = 2


@case
def camera_blades(s):
    s.without_mirror()
    for x in range(5):
        bpy.ops.mesh.primitive_cube_add(size=0.12, location=(-2 + 0.9 * x, 1 + 0.4 * x, 2.6))
        s.paint("emission", (30, 25, 20))
    dof = s.camera.data.dof
    dof.use_dof, dof.focus_distance, dof.aperture_fstop = True, 3, 0.06
    dof.aperture_blades, dof.aperture_rotation, dof.aperture_ratio = 5, 0.4, 1.6


def panorama(s, kind, **settings):
    s.without_mirror()
    s.lamp("POINT", 600, shadow_soft_size=0.2)
    s.camera.location = (0.6, -2.2, 1.2)
    look_at(s.camera, (0, 0, 1.1))
    s.camera.data.type = "PANO"
    s.camera.data.cycles.panorama_type = kind
    for name, value in settings.items():
        setattr(s.camera.data.cycles, name, value)


@case
def camera_equirectangular(s):
    panorama(s, "EQUIRECTANGULAR")
    s.camera_line = ('Camera "spherical" "string mapping" "equirectangular" "float longitudemin" -180 '
                     '"float longitudemax" 180 "float latitudemin" -90 "float latitudemax" 90')


@case
def camera_equirectangular_part(s):
    panorama(s, "EQUIRECTANGULAR", longitude_min=-1, longitude_max=1.5, latitude_min=-0.6, latitude_max=0.8)
    s.camera_line = ('Camera "spherical" "string mapping" "equirectangular" "float longitudemin" %.9g '
                     '"float longitudemax" %.9g "float latitudemin" %.9g "float latitudemax" %.9g' %
                     tuple(math.degrees(x) for x in (-1, 1.5, -0.6, 0.8)))


@case
def camera_fisheye_equidistant(s):
    panorama(s, "FISHEYE_EQUIDISTANT", fisheye_fov=math.radians(200))
    s.camera_line = 'Camera "fisheye" "string projection" "equidistant" "float fov" 200'


@case
def camera_fisheye_equisolid(s):
    panorama(s, "FISHEYE_EQUISOLID", fisheye_fov=math.radians(170), fisheye_lens=10.5)
    s.camera_line = ('Camera "fisheye" "string projection" "equisolid" "float fov" 170 "float lens" 10.5 '
                     '"float sensorwidth" 36 "float sensorheight" 24')


@case
def camera_mirrorball(s):
    panorama(s, "MIRRORBALL")
    s.camera_line = 'Camera "fisheye" "string projection" "mirrorball"'


folder, *wanted = sys.argv[sys.argv.index("--") + 1:]
os.makedirs(folder, exist_ok=True)
for build in CASES:
    if not wanted or build.__name__ in wanted:
        stage = Stage(os.path.abspath(folder))
        build(stage)
        bpy.context.view_layer.update()
        stage.render(build.__name__)
