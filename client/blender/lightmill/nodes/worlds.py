"""World trees as infinite lights, suns and a medium.

A constant stays one, an environment texture stays an image. Every other tree is drawn by Cycles as a picture
of all directions, in a Blender of its own (drawn/world_picture.py).
"""
from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from mathutils import Euler, Matrix

from ..light_groups import group_of, parameter
from .context import Context, number_text
from .drawn import world_picture
from .emitters import ALL_KINDS, sum_of
from .fold import as_number, as_triple
from .graph import is_constant
from .place import Place
from .shaders import Builder, Term
from .surfaces import output_node
from .tree import Scope, Source
from .media import Medium, medium_of_tree

# What Light Path says of rays of a kind that leave the scene.
LIGHT_PATHS: dict[str, dict[str, float]] = {
    "camera": {"Is Camera Ray": 1.0},
    "diffuse": {"Is Diffuse Ray": 1.0, "Is Reflection Ray": 1.0, "Ray Depth": 1.0, "Diffuse Depth": 1.0},
    "glossy": {"Is Glossy Ray": 1.0, "Is Reflection Ray": 1.0, "Ray Depth": 1.0, "Glossy Depth": 1.0},
    "transmission": {"Is Transmission Ray": 1.0, "Ray Depth": 1.0, "Transmission Depth": 1.0},
    "volume_scatter": {"Is Volume Scatter Ray": 1.0, "Ray Depth": 1.0}}


@dataclass(frozen=True)
class World:
    lines: tuple[str, ...]  # LightSource directives, each with its own scope if it has a transform
    medium: Medium | None = None  # what fills the space around everything


@dataclass(frozen=True)
class _Sky:
    """Light from all directions: a constant, or an image."""

    rgb: tuple[float, float, float] = (0.0, 0.0, 0.0)
    file: str = ""
    scale: float = 1.0
    to_world: tuple[float, ...] = ()  # columns of a 4 x 4 matrix
    suns: tuple[world_picture.Sun, ...] = ()


def world(data: Any, context: Context, hidden: tuple[str, ...] = ()) -> World:
    """Lines of the scene's world; `data` may be None: black. `hidden` are kinds of rays that do not see it, beside those
    that its own settings hide it from."""
    if data is None:
        return World(())
    invisible, group = (*hidden, *_invisible(data)), group_of(data)
    if not data.use_nodes or data.node_tree is None:
        return World(tuple(_lines(_Sky(tuple(data.color)), tuple(k for k in ALL_KINDS if k in invisible), group)))
    output = output_node(data.node_tree)
    if output is None:
        return World(())
    scope = Scope(data.node_tree, data.name_full, context.report)
    by_kind = _skies(data, output, scope, context)
    lines: list[str] = []
    for sky in dict.fromkeys(by_kind.values()):
        lines += _lines(sky, tuple(k for k in ALL_KINDS if by_kind[k] != sky or k in invisible), group)
    b = Builder(context, Place(light_group=group), data.name_full)
    medium = medium_of_tree(b, output.inputs["Volume"], scope)
    # What is infinitely far is behind infinitely much of it.
    return World(() if medium is not None and medium.is_opaque else tuple(lines), medium)


def _invisible(data: Any) -> tuple[str, ...]:
    flags = getattr(data, "cycles_visibility", None)
    names = {"camera": "camera", "diffuse": "diffuse", "glossy": "glossy", "transmission": "transmission", "scatter": "volume_scatter"}
    return tuple(kind for name, kind in names.items() if not getattr(flags, name, True))


def _skies(data: Any, output: Any, scope: Scope, context: Context) -> dict[str, _Sky]:
    """What rays of each kind see."""
    apart = world_picture.has_node(data.node_tree, "LIGHT_PATH")
    kinds = ALL_KINDS if apart else ALL_KINDS[:1]
    found: dict[str, _Sky | None] = {}
    for kind in kinds:
        context.light_path = LIGHT_PATHS[kind]
        try:
            found[kind] = _simple(output, scope, context)
        finally:
            context.light_path = None
    missing = [k for k in kinds if found[k] is None]
    if missing:
        pictures = world_picture.pictures(data, context, [LIGHT_PATHS[k] if apart else {} for k in missing])
        for kind, picture in zip(missing, pictures):
            file = context.images.write_bytes(picture.exr, ".exr") if picture.exr else ""
            found[kind] = _Sky(rgb=picture.rgb, file=file, suns=picture.suns)
    return {k: found[k if apart else kinds[0]] or _Sky() for k in ALL_KINDS}


def _simple(output: Any, scope: Scope, context: Context) -> _Sky | None:
    """A constant or an environment texture; None for what needs a picture."""
    b = Builder(context, Place(), scope.owner)
    b.scatters = False
    with context.report.paused():  # what can't be written as a texture is drawn in the picture
        closure = b.closure(output.inputs["Surface"], scope)
        image = _environment(b, closure.terms)
        if image is not None:
            return image
        if world_picture.has_node(scope.tree, "TEX_SKY"):
            return None
        value = sum_of(b, b.graph(), closure.terms)
    return _Sky(tuple(as_triple(value))) if is_constant(value) else None


def _environment(b: Builder, terms: tuple[Term, ...]) -> _Sky | None:
    """A world that is one environment texture, turned perhaps."""
    shown = []
    for term in terms:
        factors = [(b.value(socket, scope)[1], rest) for socket, scope, rest in term.factors]
        if not all(is_constant(f) for f, _ in factors):
            return None
        scale = 1.0
        for f, rest in factors:
            x = min(max(as_number(f), 0.0), 1.0)
            scale *= 1 - x if rest else x
        if scale > 0:
            shown.append((term, scale))
    if len(shown) != 1 or shown[0][0].strength is None:
        return None
    term, scale = shown[0]
    strength = b.value(*term.strength)[1]
    source = term.color[1].source(term.color[0])
    if not is_constant(strength) or not source.linked or source.node.type != "TEX_ENVIRONMENT":
        return None
    node = source.node
    if node.image is None or node.projection != "EQUIRECTANGULAR" or node.interpolation != "Linear":
        return None
    turn = _rotation(b, source.scope.source(node.inputs["Vector"]))
    if turn is None:
        return None
    file = b.context.images.write(node.image, b.context.frame, node.image_user, owner=b.owner, node=node.name)
    if file is None:
        return None
    bytes_of_colors = file.name.endswith((".png", ".jpg", ".tga", ".bmp", ".webp", ".tif"))
    if file.alpha not in ("none", "data") or bytes_of_colors != (file.colorspace == "sRGB"):
        return None
    matrix = turn.inverted_safe()
    turned = any(abs(matrix[i][k] - (i == k)) > 1e-6 for i in range(3) for k in range(3))
    columns = tuple(matrix[row][column] for column in range(4) for row in range(4)) if turned else ()
    return _Sky(file=file.name, scale=as_number(strength) * scale, to_world=columns)


def _rotation(b: Builder, source: Source) -> Matrix | None:
    """What takes directions to those of the texture, if that is a rotation."""
    if not source.linked:
        return Matrix.Identity(4)
    node = source.node
    if node.type == "TEX_COORD":
        plain = source.socket.identifier in ("Generated", "Object") and node.object is None
        return Matrix.Identity(4) if plain else None
    if node.type != "MAPPING" or not source.scope.source(node.inputs["Vector"]).linked:
        return None
    values = {name: b.value(node.inputs[name], source.scope)[1] for name in ("Location", "Rotation", "Scale") if node.inputs[name].enabled}
    if not all(is_constant(v) for v in values.values()):
        return None
    moved = any(as_triple(values.get("Location", 0.0)))
    if moved or any(abs(s - 1) > 1e-6 for s in as_triple(values.get("Scale", 1.0))):
        return None
    before = _rotation(b, source.scope.source(node.inputs["Vector"]))
    if before is None:
        return None
    turn = Euler(as_triple(values["Rotation"]), "XYZ").to_matrix().to_4x4()
    return (turn.transposed() if node.vector_type == "TEXTURE" else turn) @ before


def _lines(sky: _Sky, hidden: tuple[str, ...], group: str) -> list[str]:
    if len(hidden) == len(ALL_KINDS):
        return []
    end = f' "string hidden" [{" ".join(chr(34) + k + chr(34) for k in hidden)}]' if hidden else ""
    end += parameter(group)
    lines = []
    if sky.file:
        line = f'LightSource "infinite" "string filename" "{sky.file}" "string mapping" "equirectangular" "float scale" {number_text(sky.scale)}{end}'
        if sky.to_world:
            line = f'AttributeBegin\nTransform [{" ".join(number_text(x) for x in sky.to_world)}]\n{line}\nAttributeEnd'
        lines.append(line)
    elif any(sky.rgb):
        lines.append(f'LightSource "infinite" "rgb L" [{" ".join(number_text(max(c, 0.0)) for c in sky.rgb)}]{end}')
    for sun in sky.suns:
        lines.append(f'LightSource "distant" "rgb L" [{" ".join(number_text(c) for c in sun.irradiance)}] '
                     f'"point3 from" [{" ".join(number_text(c) for c in sun.direction)}] "point3 to" [0 0 0] "float angle" {number_text(sun.angle)}{end}')
    return lines
