"""Cameras: Blender's settings as pbrt's Transform and Camera."""
import math
from dataclasses import dataclass

from mathutils import Matrix

from .motion import openness
from .pbrt_text import columns, is_usable, moving, numbers

# pbrt's camera looks along +z with +x to the right and +y up; Blender's along -z.
TO_PBRT = Matrix.Diagonal((1, 1, -1, 1))
MOST_SHEAR = 1e-4  # of cosines between axes
ZOOMING = {"lens", "ortho_scale", "sensor_width", "sensor_height", "shift_x", "shift_y"}
FISHEYES = {"FISHEYE_EQUIDISTANT": "equidistant", "FISHEYE_EQUISOLID": "equisolid", "MIRRORBALL": "mirrorball",
            "FISHEYE_LENS_POLYNOMIAL": "polynomial"}


@dataclass
class Window:
    """What a camera shows, in the plane one unit in front of a perspective one, in its own units for an
    orthographic one: left, right, bottom, top."""

    left: float
    right: float
    bottom: float
    top: float


def resolution(scene):
    """Width and height of the whole picture, in pixels."""
    render = scene.render
    scale = render.resolution_percentage / 100
    return max(1, int(render.resolution_x * scale)), max(1, int(render.resolution_y * scale))


def window(camera, scene, size):
    """The Window of a camera's data for a picture of `size` pixels."""
    width, height = size
    aspect = scene.render.pixel_aspect_y / scene.render.pixel_aspect_x
    tall = height * aspect  # in widths of a pixel
    fit = camera.sensor_fit
    if fit == "AUTO":
        fit = "HORIZONTAL" if width >= tall else "VERTICAL"
    sensor = camera.sensor_height if camera.sensor_fit == "VERTICAL" else camera.sensor_width
    side = width if fit == "HORIZONTAL" else tall
    whole = camera.ortho_scale if camera.type == "ORTHO" else sensor / camera.lens
    pixel = whole / side
    x, y = camera.shift_x * whole, camera.shift_y * whole
    return Window(x - width * pixel / 2, x + width * pixel / 2, y - tall * pixel / 2, y + tall * pixel / 2)


def lens(camera, matrix):
    """Parameters of the lens: none if it is a pinhole. `matrix` is the camera's, without its scale."""
    dof = camera.dof
    if not dof.use_dof:
        return ""
    if camera.type == "ORTHO":
        radius = 1 / (2 * dof.aperture_fstop)
    else:
        radius = camera.lens * 1e-3 / (2 * dof.aperture_fstop)
    distance = dof.focus_distance
    if dof.focus_object:
        # Along the view, as Blender measures it.
        distance = abs((matrix.inverted() @ dof.focus_object.matrix_world.translation).z)
    text = f' "float lensradius" {radius:.9g} "float focaldistance" {max(distance, 1e-5):.9g}'
    if dof.aperture_blades > 2:
        text += f' "integer blades" {dof.aperture_blades} "float bladerotation" {math.degrees(dof.aperture_rotation):.9g}'
    if dof.aperture_ratio != 1:
        text += f' "float apertureratio" {dof.aperture_ratio:.9g}'
    return text


def without_scale(matrix):
    """Blender's cameras do not scale; a mirrored one stays mirrored. Nor do ours shear: the view's axis stays, and the
    others are made perpendicular."""
    x, y, z = (matrix.col[k].xyz for k in range(3))
    z = z.normalized()
    y = (y - y.dot(z) * z).normalized()
    x = (x - x.dot(z) * z - x.dot(y) * y).normalized()
    out = Matrix.Identity(4)
    for k, axis in enumerate((x, y, z)):
        out.col[k].xyz = axis
    out.translation = matrix.translation
    return out


def camera_lines(camera_object, scene, size, motion, report):
    """Transform and Camera of an evaluated camera object. None, reported, if it can't be drawn."""
    camera = camera_object.data
    matrix = without_scale(camera_object.matrix_world)
    settings = getattr(camera, "cycles", None)
    kind = camera_type(camera, settings, matrix, scene, size, camera_object.name, report)
    if not is_usable(columns(matrix)):
        report.warn("flat camera", camera_object.name, "has a scale of 0 or is nowhere; nothing can be seen by it")
        return None

    if shears(camera_object.matrix_world):
        report.warn("sheared camera", camera_object.name, "is sheared by its parents' scales; its axes are made perpendicular")
    if motion.steps and zooms(camera):
        report.warn("zoom", camera_object.name, "its lens stays as it is while the shutter is open")
    if motion.steps and (curve := openness(scene)):
        kind += f' "float shuttercurve" {numbers(curve)}'
    way = motion.way("camera", columns(camera_object.matrix_world))
    if len(way) > 2:  # the reader's cameras go straight
        way = (way[0], way[-1])
    return moving([columns((without_scale(from_columns(m)) @ TO_PBRT).inverted()) for m in way]) + kind + "\n"


def shears(matrix):
    axes = [matrix.col[k].xyz.normalized() for k in range(3)]
    return any(abs(a.dot(b)) > MOST_SHEAR for a, b in ((axes[0], axes[1]), (axes[1], axes[2]), (axes[2], axes[0])))


def zooms(camera):
    """Whether what the camera shows at a place is animated."""
    animation = camera.original.animation_data
    action = animation.action if animation else None
    return action is not None and any(c.data_path in ZOOMING for c in action.fcurves)


def from_columns(m):
    return Matrix([m[k::4] for k in range(4)])


def camera_type(camera, settings, matrix, scene, size, name, report):
    """The Camera directive."""
    if camera.type == "PANO":
        return panorama(camera, settings, size, name, report)
    w = window(camera, scene, size)
    extent = f'"float screenwindow" {numbers((w.left, w.right, w.bottom, w.top))}'
    if camera.type == "ORTHO":
        return f'Camera "orthographic" {extent}{lens(camera, matrix)}'
    return f'Camera "perspective" "float fov" 90 {extent}{lens(camera, matrix)}'  # at 90 the window's unit is 1


def panorama(camera, settings, size, name, report):
    """The Camera directive of a panoramic camera; its settings are the camera's own from Blender 4.0 on."""
    s = settings if hasattr(settings, "panorama_type") else camera
    kind = s.panorama_type
    if camera.dof.use_dof:
        report.warn("panorama lens", name, "panoramas have no depth of field")
    if kind == "EQUIRECTANGULAR":
        text = 'Camera "spherical" "string mapping" "equirectangular"'
        for key, most in (("longitude_min", 180), ("longitude_max", 180), ("latitude_min", 90), ("latitude_max", 90)):
            # Their presence says that the picture is laid out as Blender's.
            angle = min(max(math.degrees(getattr(s, key)), -most), most)
            text += f' "float {key.replace("_", "")}" {angle:.9g}'
        return text
    if kind not in FISHEYES:
        report.warn("panorama type", name, f"a panorama of type {kind} is drawn as an equidistant fisheye")
    text = f'Camera "fisheye" "string projection" "{FISHEYES.get(kind, "equidistant")}"'
    if kind != "MIRRORBALL":
        text += f' "float fov" {math.degrees(s.fisheye_fov):.9g}'
    if kind in ("FISHEYE_EQUISOLID", "FISHEYE_LENS_POLYNOMIAL"):
        # The sensor of a picture that is wider than its sensor is fitted along its longer side.
        width, height = size
        sensor = camera.sensor_height if camera.sensor_fit == "VERTICAL" else camera.sensor_width
        along = width if camera.sensor_fit == "HORIZONTAL" or (camera.sensor_fit == "AUTO" and width >= height) else height
        text += (f' "float lens" {s.fisheye_lens:.9g} "float sensorwidth" {sensor * width / along:.9g}'
                 f' "float sensorheight" {sensor * height / along:.9g}')
    if kind == "FISHEYE_LENS_POLYNOMIAL":
        # Blender's polynomial is the angle with the sign turned.
        text += f' "float coefficients" {numbers([-getattr(s, f"fisheye_polynomial_k{i}") for i in range(5)])}'
    return text
