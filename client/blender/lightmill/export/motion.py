"""Where things stand, and how meshes are bent, while the shutter is open."""
from dataclasses import dataclass, field

from . import mesh_arrays
from .pbrt_text import columns

MOST_STEPS = 16  # of the shutter's time
CURVE_PARTS = 64  # of the shutter's curve
SAME = 1e-6  # of a thing's way, within which it goes straight
DRAWN = ("MESH", "LIGHT", "CURVES", "VOLUME", "POINTCLOUD")


@dataclass
class Motion:
    """Empty without motion blur. A way is a tuple of transforms (16 numbers each, column by column) at even times from
    the shutter's opening to its closing, or of one."""

    steps: list = field(default_factory=list)  # transforms at each time, by the thing's key
    bends: dict = field(default_factory=dict)  # (positions, corner normals or None) of a mesh at each time, by object

    def way(self, key, now):
        """The way of a thing; one that is not there all the time stands still where it is `now`."""
        found = [step.get(key) for step in self.steps]
        if not found or None in found or all(m == found[0] for m in found):
            return (found[0],) if found and found[0] else (now,)
        return (found[0], found[-1]) if goes_straight(found) else tuple(found)


def goes_straight(way):
    """Whether a thing moves evenly along a line without turning."""
    first, last = way[0], way[-1]
    size = max(abs(b - a) for a, b in zip(first[12:], last[12:])) + 1e-30
    for i, m in enumerate(way):
        s = i / (len(way) - 1)
        if m[:12] != first[:12] or any(abs(a + s * (b - a) - x) > SAME * size for a, b, x in
                                       zip(first[12:], last[12:], m[12:])):
            return False
    return True


def instance_key(instance):
    """What an instance is known by at all times."""
    if not instance.is_instance:
        return instance.object.original.as_pointer()
    data = instance.object.data
    return (instance.parent.original.as_pointer() if instance.parent else 0,
            instance.object.original.as_pointer(), data.name if data else "", tuple(instance.persistent_id))


def shutter(scene):
    """(opening, closing) in frames after the scene's; equal without motion blur."""
    render = scene.render
    if not render.use_motion_blur:
        return 0.0, 0.0
    length = render.motion_blur_shutter
    position = getattr(render, "motion_blur_position", None) or getattr(scene.cycles, "motion_blur_position", "CENTER")
    opens = {"START": 0.0, "CENTER": -length / 2, "END": -length}[position]
    return opens, opens + length


def stands_still(instance):
    """Whether motion blur is switched off for the object or for what it is instanced by."""
    settings = getattr(instance.parent or instance.object, "cycles", None)
    return settings is not None and not settings.use_motion_blur


def step_count(scene):
    """Into how many even parts the shutter's time is cut: Cycles' rule for the object that asks for most."""
    most = max((getattr(getattr(o, "cycles", None), "motion_steps", 1) for o in scene.objects), default=1)
    return min(2 ** max(most, 1), MOST_STEPS)


def transforms(depsgraph, camera):
    """Transforms of everything at the depsgraph's time; the camera under the key "camera"."""
    found = {instance_key(i): columns(i.matrix_world) for i in depsgraph.object_instances
             if i.object.type in DRAWN and not stands_still(i)}
    if camera is not None:
        found["camera"] = columns(camera.evaluated_get(depsgraph).matrix_world)
    return found


def bending_objects(depsgraph, scene):
    """Original mesh objects whose modifiers or shape keys may bend them."""
    def may_bend(thing):
        settings = getattr(thing, "cycles", None)
        return (thing.type == "MESH" and (settings is None or (settings.use_motion_blur and settings.use_deform_motion))
                and thing.is_deform_modified(scene, "RENDER"))

    return [o.original for o in depsgraph.objects if may_bend(o.original)]


def sample(depsgraph, scene, frame_set, report):
    """The scene's motion while the shutter is open. `frame_set(frame, subframe)` moves time, and the depsgraph with
    it; it is back at the scene's frame afterwards."""
    opens, closes = shutter(scene)
    motion = Motion()
    if opens == closes:
        return motion
    now = scene.frame_current + scene.frame_subframe
    parts = step_count(scene)
    bending = bending_objects(depsgraph, scene)
    shapes = {thing.as_pointer(): [] for thing in bending}
    try:
        for k in range(parts + 1):
            time = now + opens + (closes - opens) * k / parts
            frame_set(int(time // 1), time % 1)
            motion.steps.append(transforms(depsgraph, scene.camera))
            for thing in bending:
                shapes[thing.as_pointer()].append(mesh_shape(thing.evaluated_get(depsgraph).data))
    finally:
        frame_set(int(now // 1), now % 1)
    for key, found in shapes.items():
        sizes = {(p.shape, None if n is None else n.shape) for p, n in found}
        if len(sizes) > 1:
            name = next(t.name for t in bending if t.as_pointer() == key)
            report.warn("changing mesh", name, "has other vertices from time to time; it does not bend in its blur")
        elif any((p != found[0][0]).any() for p, _ in found):
            motion.bends[key] = found
    return motion


def mesh_shape(mesh):
    """(positions, normals of all corners, or None of a mesh of flat faces) at the depsgraph's time."""
    smooth = mesh_arrays.get(mesh.polygons, "use_smooth", "?").any()
    return mesh_arrays.get(mesh.vertices, "co", "f4", 3), mesh_arrays.corner_normals(mesh).copy() if smooth else None


def openness(scene):
    """How far the shutter is open at even times of its curve; None if it is so all the time, as by Blender's default."""
    mapping = scene.render.motion_blur_shutter_curve
    curve = mapping.curves[0]
    if all(p.location[1] >= 0.98 for p in curve.points):
        return None
    mapping.initialize()
    found = [max(mapping.evaluate(curve, k / CURVE_PARTS), 0.0) for k in range(CURVE_PARTS + 1)]
    return found if any(found) else None
