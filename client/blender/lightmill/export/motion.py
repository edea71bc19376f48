"""Where things stand when the shutter opens and when it closes."""
from dataclasses import dataclass, field

from .pbrt_text import columns


@dataclass
class Motion:
    """Transforms (16 numbers, column by column) at the shutter's opening and closing, by the thing's key. Empty
    without motion blur."""

    opening: dict = field(default_factory=dict)
    closing: dict = field(default_factory=dict)

    def of(self, key, now):
        """(at the opening, at the closing or None): a thing that is not there all the time stands still."""
        start, end = self.opening.get(key), self.closing.get(key)
        return (now, None) if start is None or end is None or start == end else (start, end)


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


def transforms(depsgraph, camera):
    """Transforms of everything at the depsgraph's time; the camera under the key "camera"."""
    found = {instance_key(i): columns(i.matrix_world) for i in depsgraph.object_instances
             if i.object.type in ("MESH", "LIGHT", "CURVES", "VOLUME") and not stands_still(i)}
    if camera is not None:
        found["camera"] = columns(camera.evaluated_get(depsgraph).matrix_world)
    return found


def sample(depsgraph, scene, frame_set, report):
    """The scene's motion while the shutter is open. `frame_set(frame, subframe)` moves time, and the depsgraph with
    it; it is back at the scene's frame afterwards."""
    opens, closes = shutter(scene)
    if opens == closes:
        return Motion()
    if is_shaped(scene):
        report.warn("shutter curve", scene.name, "the shutter opens and closes at once, not by its curve")
    now = scene.frame_current + scene.frame_subframe
    try:
        steps = []
        for offset in (opens, closes):
            frame = int((now + offset) // 1)
            frame_set(frame, now + offset - frame)
            steps.append(transforms(depsgraph, scene.camera))
    finally:
        frame_set(int(now // 1), now % 1)
    return Motion(*steps)


def is_shaped(scene):
    """Whether the shutter's curve is not open all the time, as Blender's default is."""
    return any(p.location[1] < 0.98 for p in scene.render.motion_blur_shutter_curve.curves[0].points)
