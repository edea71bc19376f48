"""Cameras, film and motion blur."""
from stage import feature, look_at, radians
from volumes import cloud_of_noise

import bpy


@feature
def cam_ortho(s):
    s.lit()
    s.camera.data.type, s.camera.data.ortho_scale = "ORTHO", 5


@feature
def cam_ortho_portrait(s):
    s.lit()
    s.camera.data.type, s.camera.data.ortho_scale, s.camera.data.shift_y = "ORTHO", 5, 0.1
    s.scene.render.resolution_x, s.scene.render.resolution_y = 128, 192


def panorama(s, kind, **settings):
    s.lit()
    s.camera.data.type, s.camera.data.cycles.panorama_type = "PANO", kind
    for name, value in settings.items():
        setattr(s.camera.data.cycles, name, value)
    s.camera.location = (1, -2.5, 1.5)
    look_at(s.camera, (0, 0, 0.8))


@feature
def cam_fisheye_equidistant(s):
    panorama(s, "FISHEYE_EQUIDISTANT", fisheye_fov=radians(180))


@feature
def cam_fisheye_equisolid(s):
    panorama(s, "FISHEYE_EQUISOLID", fisheye_lens=10.5, fisheye_fov=radians(180))


@feature
def cam_mirror_ball(s):
    panorama(s, "MIRRORBALL")


@feature
def cam_panorama_part(s):
    panorama(s, "EQUIRECTANGULAR", longitude_min=radians(-60), longitude_max=radians(80), latitude_min=radians(-40),
             latitude_max=radians(30))


@feature
def cam_fisheye_polynomial(s):
    panorama(s, "FISHEYE_LENS_POLYNOMIAL", fisheye_fov=radians(180))


@feature
def cam_portrait(s):
    s.lit()
    s.scene.render.resolution_x, s.scene.render.resolution_y = 128, 192


@feature
def cam_fit_vertical(s):
    s.lit()
    s.camera.data.sensor_fit, s.camera.data.sensor_height = "VERTICAL", 20


@feature
def cam_fit_horizontal_portrait(s):
    s.lit()
    s.camera.data.sensor_fit, s.camera.data.shift_x = "HORIZONTAL", 0.1
    s.scene.render.resolution_x, s.scene.render.resolution_y = 128, 192


@feature
def cam_sensor(s):
    s.lit()
    s.camera.data.sensor_width, s.camera.data.lens = 24, 35


@feature
def cam_angle(s):
    s.lit()
    s.camera.data.lens_unit, s.camera.data.angle = "FOV", radians(70)


@feature
def cam_clip_start(s):
    """What is nearer is cut away."""
    s.lit()
    s.camera.data.clip_start = 6


@feature
def cam_clip_end(s):
    s.lit()
    s.camera.data.clip_end = 7


@feature
def cam_lens_blades(s):
    s.lit()
    lens = s.camera.data.dof
    lens.use_dof, lens.focus_distance, lens.aperture_fstop = True, 4, 0.2
    lens.aperture_blades, lens.aperture_rotation, lens.aperture_ratio = 5, radians(20), 2


@feature
def cam_lens_focus_object(s):
    s.lit()
    lens = s.camera.data.dof
    lens.use_dof, lens.focus_object, lens.aperture_fstop = True, s.monkey, 0.3


@feature
def cam_lens_ortho(s):
    s.lit()
    s.camera.data.type, s.camera.data.ortho_scale = "ORTHO", 5
    lens = s.camera.data.dof
    lens.use_dof, lens.focus_distance, lens.aperture_fstop = True, 4, 2


@feature
def cam_border(s):
    """Only a part is drawn; the rest of the picture is empty."""
    s.lit()
    render = s.scene.render
    render.use_border = True
    render.border_min_x, render.border_max_x, render.border_min_y, render.border_max_y = 0.25, 0.75, 0.25, 0.875


@feature
def cam_crop(s):
    cam_border(s)
    s.scene.render.use_crop_to_border = True


@feature
def cam_percentage(s):
    s.lit()
    s.scene.render.resolution_x, s.scene.render.resolution_y, s.scene.render.resolution_percentage = 384, 256, 50


@feature
def cam_pixel_aspect_y(s):
    s.lit()
    s.scene.render.pixel_aspect_y = 1.5


@feature
def cam_on_scaled_parent(s):
    s.lit()
    parent = s.put(None, (0, 0, 0))
    parent.scale, parent.rotation_euler = (2, 1, 1), (0, 0, radians(20))
    s.camera.parent = parent
    s.camera.location, s.camera.scale = (1.5, -5, 3), (3, 3, 3)
    look_at(s.camera, (0, 0, 0.8))


@feature
def cam_by_constraint(s):
    s.lit()
    s.camera.location = (-3, -5, 2)
    track = s.camera.constraints.new("TRACK_TO")
    track.target, track.track_axis, track.up_axis = s.monkey, "TRACK_NEGATIVE_Z", "UP_Y"


@feature
def cam_by_marker(s):
    """A marker of the timeline chooses the camera."""
    s.lit()
    other = s.put(bpy.data.cameras.new("Other"), (-3, -4, 2))
    look_at(other, (0, 0, 0.8))
    s.scene.timeline_markers.new("Cut", frame=1).camera = other
    s.scene.frame_set(1)


@feature
def film_transparent(s):
    s.lit()
    s.scene.render.film_transparent = True
    s.floor.scale = (0.1, 0.1, 1)


@feature
def film_filter_box(s):
    s.lit()
    s.scene.cycles.pixel_filter_type = "BOX"


@feature
def film_filter_gaussian(s):
    s.lit()
    s.scene.cycles.pixel_filter_type, s.scene.cycles.filter_width = "GAUSSIAN", 4


@feature
def film_filter_wide(s):
    s.lit()
    s.scene.cycles.filter_width = 6


@feature
def film_exposure_low(s):
    s.lit()
    s.scene.cycles.film_exposure = 0.3


@feature
def film_view_settings(s):
    """Looks and exposure of the view do not touch a scene-linear file."""
    s.lit()
    s.scene.view_settings.view_transform, s.scene.view_settings.exposure = "Filmic", 2


def moving(s, **settings):
    """Blur between frames 0 and 2 of the monkey, which moves to the right."""
    s.lit()
    render = s.scene.render
    render.use_motion_blur, render.motion_blur_shutter = True, 1
    for name, value in settings.items():
        setattr(render if hasattr(render, name) else s.scene.cycles, name, value)


def keyed(s, thing, path, first, last, frames=(0, 2)):
    for frame, value in zip(frames, (first, last)):
        setattr(thing, path, value)
        thing.keyframe_insert(path, frame=frame)
    for curve in thing.id_data.animation_data.action.fcurves:
        for key in curve.keyframe_points:
            key.interpolation = "LINEAR"
    s.scene.frame_set(1)


@feature
def blur_rotation(s):
    moving(s)
    keyed(s, s.monkey, "rotation_euler", (0, 0, -1), (0, 0, 1))


@feature
def blur_scale(s):
    moving(s)
    keyed(s, s.monkey, "scale", (0.5, 1, 1), (1.5, 1, 1))


@feature
def blur_volume(s):
    moving(s)
    keyed(s, cloud_of_noise(), "location", (-0.8, 0, 1.52), (0.8, 0, 1.52))


@feature
def blur_camera(s):
    moving(s)
    keyed(s, s.camera, "location", (2.5, -5, 3), (4.5, -5, 3))


@feature
def blur_camera_turning(s):
    moving(s)
    s.camera.rotation_mode = "XYZ"
    turn = s.camera.rotation_euler.copy()
    keyed(s, s.camera, "rotation_euler", (turn.x, turn.y, turn.z - 0.2), (turn.x, turn.y, turn.z + 0.2))


@feature
def blur_zoom(s):
    moving(s)
    keyed(s, s.camera.data, "lens", 30, 70)


@feature
def blur_lamp(s):
    moving(s)
    keyed(s, s.light("POINT", 400, shadow_soft_size=0), "location", (-3, -3, 3), (-1, -3, 3))


@feature
def blur_shape_key(s):
    """The mesh itself bends."""
    moving(s)
    s.monkey.shape_key_add(name="Basis")
    tall = s.monkey.shape_key_add(name="Tall")
    for point in tall.data:
        point.co.x *= 2
    keyed(s, tall, "value", 0, 1)


@feature
def blur_at_start(s):
    moving(s, motion_blur_position="START", motion_blur_shutter=0.7)
    keyed(s, s.monkey, "location", (-1, 0, 1.05), (1, 0, 1.05))


@feature
def blur_at_end(s):
    moving(s, motion_blur_position="END")
    keyed(s, s.monkey, "location", (-1, 0, 1.05), (1, 0, 1.05))


@feature
def blur_shutter_curve(s):
    """A shutter that opens slowly."""
    moving(s)
    curve = s.scene.render.motion_blur_shutter_curve.curves[0]
    while len(curve.points) > 2:
        curve.points.remove(curve.points[1])
    curve.points[0].location, curve.points[-1].location = (0, 0), (1, 1)
    s.scene.render.motion_blur_shutter_curve.update()
    keyed(s, s.monkey, "location", (-1, 0, 1.05), (1, 0, 1.05))


@feature
def blur_off_for_object(s):
    moving(s)
    s.monkey.cycles.use_motion_blur = False
    keyed(s, s.monkey, "location", (-1, 0, 1.05), (1, 0, 1.05))


@feature
def blur_of_child(s):
    moving(s)
    s.monkey.parent = s.put(None)
    keyed(s, s.monkey.parent, "rotation_euler", (0, 0, -0.6), (0, 0, 0.6))


@feature
def blur_of_instances(s):
    moving(s)
    s.monkey.scale = (0.4, 0.4, 0.4)
    collection = bpy.data.collections.new("Bits")
    collection.objects.link(s.monkey)
    empty = s.put(None, (0, 0, 0))
    empty.instance_type, empty.instance_collection = "COLLECTION", collection
    keyed(s, empty, "location", (-1, 1, 0), (1, 1, 0))
