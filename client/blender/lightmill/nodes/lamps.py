"""Lamp trees."""
from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from .context import Context
from .drawn import lamp_picture
from .drawn.world_picture import has_node
from .emitters import sum_of
from .fold import as_triple
from .graph import Value, is_constant
from .place import Place
from .shaders import Builder
from .surfaces import output_node
from .tree import Scope


@dataclass(frozen=True)
class LampColor:
    """What a lamp's colour and power are multiplied by."""

    rgb: tuple[float, float, float]
    texture: str = ""  # of an area lamp that is not even: a spectrum texture, of the `power` times that
    lines: tuple[str, ...] = ()
    # In place of everything else, of a point lamp or a spot that shines unevenly: colours and the files of goniometric
    # pictures in W/sr.
    pictures: tuple[tuple[tuple[float, float, float], str], ...] = ()


def light(lamp: Any, context: Context, place: Place | None = None, power: tuple[float, float, float] = (1.0, 1.0, 1.0)) -> LampColor:
    """Of a lamp (the object's data)."""
    if not lamp.use_nodes or lamp.node_tree is None:
        return LampColor((1.0, 1.0, 1.0))
    output = output_node(lamp.node_tree)
    if output is None:
        return LampColor((0.0, 0.0, 0.0))
    b = Builder(context, place or Place(), lamp.name_full)
    b.scatters = False
    if lamp.type in ("POINT", "SPOT") and has_node(lamp.node_tree, "TEX_IES"):
        return _pictured(b, lamp, output)
    closure = b.closure(output.inputs["Surface"], Scope(lamp.node_tree, b.owner, context.report))
    graph = b.graph()
    value: Value = sum_of(b, graph, closure.terms)
    if is_constant(value):
        return LampColor(tuple(max(c, 0.0) for c in as_triple(value)))
    if lamp.type == "AREA":
        lines: list[str] = []
        texture = context.texture(graph, graph.product(value, power), "spectrum", lines)
        return LampColor((1.0, 1.0, 1.0), texture, tuple(lines))
    if lamp.type in ("POINT", "SPOT"):
        return _pictured(b, lamp, output)
    b.report("lamp texture", output, "a sun's strength that varies with direction is not supported; it shines alike in all")
    return LampColor((1.0, 1.0, 1.0))


def _pictured(b: Builder, lamp: Any, output: Any) -> LampColor:
    if lamp.shadow_soft_size > 0:
        b.report("lamp size", output, "a lamp that shines unevenly is drawn without its size: its shadows are sharp")
    try:
        found = lamp_picture.pictures(lamp, b.context)
    except lamp_picture.FAILURES as error:
        b.report("lamp texture", output, f"how the lamp shines could not be measured; it shines alike in all directions: {error}")
        return LampColor((1.0, 1.0, 1.0))
    return LampColor((1.0, 1.0, 1.0) if found else (0.0, 0.0, 0.0), pictures=found)
