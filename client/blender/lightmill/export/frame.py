"""One frame of a scene as a folder that Lightmill renders."""
from dataclasses import dataclass
from pathlib import Path

from .camera import camera_lines, resolution, without_scale
from .clip import Clip
from .content import Cache, Folder
from .film import film_lines
from .motion import Motion, sample
from .objects import Objects
from .pbrt_text import Names, columns, is_usable, quoted
from .report import Message, Report
from .shading import Materials

MAIN = "scene.pbrt"
HEADER = "# Written by Lightmill's exporter for Blender. Units are metres, z is up.\n"
DARKNESS = 'LightSource "infinite" "rgb L" [0 0 0]\n'  # a file without any light would be shown under a white sky


@dataclass
class Export:
    """What was written. `files`: all that the scene needs, `main` first; `report`: one Message a kind; `owners`: an object of
    each file of a mesh."""

    main: Path
    files: list
    report: list
    written: int  # files that were not there before, `main` apart
    owners: dict


class FrameExport:
    """The state of one export; modules of this package write to it."""

    def __init__(self, depsgraph, scene, view_layer, folder, cache, nodes):
        self.depsgraph, self.scene, self.view_layer, self.nodes = depsgraph, scene, view_layer, nodes
        self.report, self.names, self.cache = Report(), Names(), cache
        self.folder = Folder(folder)
        self.context = nodes.Context(self.folder.path, scene, depsgraph, view_layer=view_layer, memory=cache.pictures)
        self.has_volumes = False
        self.outside = ""  # the medium around everything
        self.hides_suns = False  # it is so wide that no light comes from infinitely far
        self.owners = {}  # names of objects by files of meshes
        self.lines = []  # of the world block: materials, textures, media
        self.materials = Materials(self)


def export_frame(depsgraph, scene, view_layer, folder, *, size=None, cache=None, camera=None, frame_set=None):
    """Writes the scene as the evaluated `depsgraph` shows it into `folder` and returns an Export.

    size: (width, height) of the whole picture in pixels; None: the render settings', with their border.
    cache: a Cache that lives from export to export, so that what stays is neither hashed nor written again.
    camera: lines of pbrt in the place of the scene's camera.
    frame_set(frame, subframe): moves the depsgraph's time; a render engine gives its own. None: scene.frame_set.
    Raises OSError if the folder can't be written. Everything else that goes wrong is in the report.
    """
    from .. import nodes

    export = FrameExport(depsgraph, scene, view_layer, folder, cache if cache is not None else Cache(), nodes)
    motion = Motion()
    if camera is None:
        motion = sample(depsgraph, scene, frame_set or by_scene(scene), export.report)
    sky = world(export)
    medium_lines = sky.medium.lines if sky.medium else []
    export.outside = sky.medium.name if sky.medium else ""
    around = f"MediumInterface {quoted(export.outside)} {quoted(export.outside)}" if sky.medium else ""
    export.hides_suns = bool(sky.medium) and sky.medium.is_opaque
    export.has_volumes = bool(sky.medium) or any(map(may_have_volume, depsgraph.objects))
    view = camera if camera is not None else scene_camera(export, size or resolution(scene), motion)
    objects = Objects(export, motion, clip_of(export, size) if camera is None else None, eye_of(export) if camera is None else None)
    objects.add_all()
    camera_in = around
    if objects.around_camera:
        inside = objects.around_camera
        medium_lines = list(dict.fromkeys([*medium_lines, *inside.lines]))
        export.lines = [line for line in export.lines if line.rstrip("\n") not in inside.lines]
        camera_in, around = f"MediumInterface {quoted(inside.name)} {quoted(inside.name)}", around or 'MediumInterface "" ""'
    text = [HEADER, film_lines(scene, size), *ended([*medium_lines, camera_in, view]), "WorldBegin\n",
            *ended([around, *sky.lines]), *export.lines, *objects.lines]
    if not any("LightSource" in line for line in text):
        text.append(DARKNESS)
    main = export.folder.path / MAIN
    files = [main, *export.folder.files, *(export.folder.path / name for name in sorted(export.context.files))]
    written = export.folder.written
    export.folder.replace(MAIN, ["".join(text).encode("utf-8", "replace")])
    messages = export.report.messages + [Message(m.kind, f"{m.owner}, node {m.node}" if m.node else m.owner, m.text)
                                         for m in export.context.report.messages]
    return Export(main, list(dict.fromkeys(files)), messages, written, export.owners)


def by_scene(scene):
    """Moves time by the scene itself."""
    return lambda frame, subframe: scene.frame_set(frame, subframe=subframe)


def ended(lines):
    """Lines with their ends, without empty ones."""
    return [line.rstrip("\n") + "\n" for line in lines if line]


def world(export):
    """The scene's world, by nodes.world, which knows its visibility."""
    evaluated = export.scene.world.evaluated_get(export.depsgraph) if export.scene.world else None
    hidden = ("camera",) if export.scene.render.film_transparent else ()
    return export.nodes.world(evaluated, export.context, hidden=hidden)


def may_have_volume(thing):
    """Whether an evaluated object is or holds a volume."""
    def has(material):
        tree = material.node_tree if material is not None and material.use_nodes else None
        end = tree.get_output_node("CYCLES") if tree else None
        return end is not None and end.inputs["Volume"].is_linked

    # Blender 3.4 may crash over the slots of evaluated objects once time has moved.
    return thing.type == "VOLUME" or any(has(slot.material) for slot in thing.original.material_slots)


def eye_of(export):
    """Where the scene's camera stands."""
    eye = export.scene.camera
    return tuple(eye.evaluated_get(export.depsgraph).matrix_world.translation) if eye is not None else None


def clip_of(export, size):
    """The Clip of the scene's camera; None of none, of a panorama, and in the fog of a world: its ends would be cut, too."""
    eye = export.scene.camera
    if eye is None or eye.type != "CAMERA" or eye.data.type == "PANO" or export.outside:
        return None
    eye = eye.evaluated_get(export.depsgraph)
    return Clip(eye, export.scene, size) if is_usable(columns(without_scale(eye.matrix_world))) else None


def scene_camera(export, size, motion):
    """Lines of the scene's camera; without one, of a camera at Blender's usual place, reported."""
    camera = export.scene.camera
    lines = None
    if camera is None:
        export.report.warn("no camera", export.scene.name, "has no camera; it is seen from above")
    else:
        lines = camera_lines(camera.evaluated_get(export.depsgraph), export.scene, size, motion, export.report)
    return lines or 'LookAt 7.36 -6.93 4.96 0 0 0 0 0 1\nScale -1 1 1\nCamera "perspective" "float fov" 40'
