"""Pictures of worlds, drawn by Cycles.

Another Blender (other_blender.py) gets a file with the world alone and runs draw_world.py. Pictures are kept by what the
tree says, so the frames of an animation and the restarts of a viewport draw an unchanged world once.
"""
from __future__ import annotations

import json
import pathlib
import subprocess
import tempfile
from dataclasses import dataclass
from typing import Any

from .. import image_files
from ..context import Context, digest
from . import other_blender
from .draw_world import trees as trees_of

MOST_KEPT = 8
FIXED_TO_CAMERA = {"Window", "Camera"}
SMOOTH, FINE, MOST = 1024, 4096, 8192  # pixels around
# Nodes whose details are finer than a smooth sky's.
_DETAILS = {"TEX_NOISE", "TEX_MUSGRAVE", "TEX_VORONOI", "TEX_WHITE_NOISE", "TEX_WAVE", "TEX_MAGIC", "TEX_CHECKER", "TEX_BRICK"}
_LAYOUT = {"name", "label", "location", "width", "width_hidden", "height", "select", "hide", "color", "use_custom_color", "parent", "dimensions",
           "show_options", "show_preview", "show_texture", "rna_type", "internal_links", "inputs", "outputs"}


@dataclass(frozen=True)
class Sun:
    """A sun disc of a sky texture."""

    direction: tuple[float, float, float]  # to the sun
    irradiance: tuple[float, float, float]  # W / m2
    angle: float  # half of its width, in degrees


@dataclass(frozen=True)
class Picture:
    """Light from all directions without suns: an OpenEXR file, or "" for the constant `rgb`."""

    exr: bytes
    rgb: tuple[float, float, float]
    suns: tuple[Sun, ...]


_kept: dict[str, list[Picture]] = {}


def has_node(tree: Any, type_: str) -> bool:
    return any(n.type == type_ for t in trees_of(tree) for n in t.nodes)


def _value(value: Any) -> Any:
    """A property of Blender as JSON."""
    import bpy

    if value is None or isinstance(value, (bool, int, float, str)):
        return value
    if isinstance(value, bpy.types.Image):
        return [value.name_full, value.filepath, value.size[:], value.colorspace_settings.name, value.alpha_mode, value.is_dirty, _image_state(value)]
    if isinstance(value, bpy.types.ID):
        return value.name_full
    if isinstance(value, bpy.types.ColorRamp):
        return [value.color_mode, value.interpolation, value.hue_interpolation, [[e.position, *e.color] for e in value.elements]]
    if isinstance(value, bpy.types.CurveMapping):
        return [[[*p.location, p.handle_type] for p in c.points] for c in value.curves]
    if isinstance(value, bpy.types.ImageUser):
        return [value.frame_current, value.frame_duration, value.frame_offset, value.frame_start, value.use_cyclic]
    if isinstance(value, bpy.types.bpy_struct):
        return str(value.bl_rna.identifier)
    try:
        return [_value(x) for x in value]
    except TypeError:
        return str(type(value))


def _image_state(image: Any) -> Any:
    """Changes when the picture does, as far as can be told quickly."""
    import bpy
    import numpy

    if image.source == "GENERATED" or image.is_dirty:
        if image.size[0] * image.size[1] > 1 << 24:
            return None
        pixels = numpy.empty(len(image.pixels), numpy.float32)
        image.pixels.foreach_get(pixels)
        return [image.generated_type, float(pixels.sum()), float(pixels[::7].sum())]
    if image.packed_file:
        return image.packed_file.size
    path = pathlib.Path(bpy.path.abspath(image.filepath, library=image.library))
    return path.stat().st_mtime_ns if path.is_file() else 0


def fingerprint(data: Any, frame: int) -> str:
    """Of all that a world's picture depends on."""
    trees = trees_of(data.node_tree)
    told: list[Any] = []
    for tree in trees:
        for node in tree.nodes:
            told.append([node.name, node.type, trees.index(node.node_tree) if node.type == "GROUP" and node.node_tree else -1])
            told.append([[p.identifier, _value(getattr(node, p.identifier))] for p in node.bl_rna.properties if p.identifier not in _LAYOUT])
            told.append([_value(getattr(s, "default_value", None)) for s in [*node.inputs, *node.outputs]])
            image = getattr(node, "image", None)
            if image is not None and image.source in ("SEQUENCE", "MOVIE"):
                told.append(frame)
        told.append([[k.from_node.name, k.from_socket.identifier, k.to_node.name, k.to_socket.identifier, k.is_muted] for k in tree.links])
    return digest(json.dumps(told, default=str))


def _width(tree: Any) -> int:
    nodes = [n for t in trees_of(tree) for n in t.nodes]
    width = FINE if any(n.type in _DETAILS for n in nodes) else SMOOTH
    for node in nodes:
        if node.type in ("TEX_ENVIRONMENT", "TEX_IMAGE") and node.image is not None:
            width = max(width, min(node.image.size[0], MOST))
    return width


def pictures(data: Any, context: Context, light_paths: list[dict[str, float]]) -> list[Picture]:
    """A picture for each kind of ray, given by what Light Path says of it. Black (reported) if Blender can't be started."""
    if any(k.from_node.type == "TEX_COORD" and k.from_socket.identifier in FIXED_TO_CAMERA for t in trees_of(data.node_tree) for k in t.links):
        context.report.add("world coordinates", data.name_full, "Texture Coordinate", "a world that is fixed to the camera is drawn as seen from the origin")
    name = digest(fingerprint(data, context.frame) + json.dumps(light_paths))
    if name not in _kept:
        try:
            found = _drawn(data, context, light_paths)
        except (OSError, RuntimeError, ValueError, subprocess.SubprocessError) as error:
            context.report.add("world", data.name_full, "", f"the world could not be drawn, and is black: {error}")
            return [Picture(b"", (0.0, 0.0, 0.0), ())] * len(light_paths)
        while len(_kept) >= MOST_KEPT:
            _kept.pop(next(iter(_kept)))
        _kept[name] = found
    return _kept[name]


def _drawn(data: Any, context: Context, light_paths: list[dict[str, float]]) -> list[Picture]:
    import numpy

    original = data.original
    with tempfile.TemporaryDirectory(prefix="lightmill-world-") as folder:
        at = pathlib.Path(folder)
        task = {"world": original.name, "width": _width(data.node_tree), "light_paths": light_paths,
                **other_blender.moment(context.scene, context.frame)}
        found = []
        for one in other_blender.answer_of("draw_world.py", at, original, task):
            exr = image_files.exr(numpy.load(at / one["file"])) if one["file"] else b""
            suns = tuple(Sun(tuple(s["direction"]), tuple(s["irradiance"]), s["angle"]) for s in one["suns"])
            found.append(Picture(exr, tuple(one["rgb"]), suns))
        return found
