"""Lamp trees."""
from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from .context import Context
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
    texture: str = ""  # of an area lamp: a spectrum texture that varies over it, to be multiplied as well
    lines: tuple[str, ...] = ()


def light(lamp: Any, context: Context, place: Place | None = None) -> LampColor:
    """Of a lamp (the object's data)."""
    if not lamp.use_nodes or lamp.node_tree is None:
        return LampColor((1.0, 1.0, 1.0))
    output = output_node(lamp.node_tree)
    if output is None:
        return LampColor((0.0, 0.0, 0.0))
    b = Builder(context, place or Place(), lamp.name_full)
    b.scatters = False
    closure = b.closure(output.inputs["Surface"], Scope(lamp.node_tree, b.owner, context.report))
    graph = b.graph()
    value: Value = sum_of(b, graph, closure.terms)
    if is_constant(value):
        return LampColor(tuple(max(c, 0.0) for c in as_triple(value)))
    if lamp.type == "AREA":
        lines: list[str] = []
        texture = context.texture(graph, value, "spectrum", lines)
        return LampColor((1.0, 1.0, 1.0), texture, tuple(lines))
    b.report("lamp texture", output, "a lamp's strength that varies with direction is not supported; it shines alike in all")
    return LampColor((1.0, 1.0, 1.0))
