"""Colour ramps and curves."""
from __future__ import annotations

from typing import Any

from .graph import Graph, Value, kind_of_socket
from .textures import plain_inputs
from .tree import Source

TABLE = 256  # values, as many as Cycles takes


def _ramp(graph: Graph, source: Source) -> Value:
    node = source.node
    ramp = node.color_ramp
    elements = [{"position": float(e.position), "color": [float(c) for c in e.color]} for e in ramp.elements]
    return graph.add("VALTORGB", source.socket.identifier, kind_of_socket(source.socket), plain_inputs(graph, node, source.scope, ("Fac",)),
                     elements=elements, interpolation=ramp.interpolation, color_mode=ramp.color_mode,
                     hue_interpolation=ramp.hue_interpolation)


def _tables(mapping: Any, count: int) -> dict[str, Any]:
    """Values of the first `count` curves at even steps over all of their points."""
    mapping.initialize()
    curves = list(mapping.curves)
    places = [p.location[0] for c in curves for p in c.points]
    low, high = min(places, default=0.0), max(places, default=1.0)
    if not high > low:
        high = low + 1
    at = [low + (high - low) * i / (TABLE - 1) for i in range(TABLE)]
    together = curves[3] if len(curves) > 3 else None  # of all colours; it comes first
    # A curve that was never edited has no table of its own until it is asked.
    inner = [mapping.evaluate(together, x) for x in at] if together else at
    return {"tables": [[float(mapping.evaluate(c, x)) for x in inner] for c in curves[:count]], "low": float(low), "high": float(high),
            "extend": getattr(mapping, "extend", "EXTRAPOLATED")}


def _curves(count: int, inputs: tuple[str, ...]) -> Any:
    def translate(graph: Graph, source: Source) -> Value:
        node = source.node
        return graph.add(node.type, source.socket.identifier, kind_of_socket(source.socket),
                         plain_inputs(graph, node, source.scope, inputs), **_tables(node.mapping, count))

    return translate


TRANSLATORS = {"VALTORGB": _ramp, "CURVE_FLOAT": _curves(1, ("Factor", "Value")), "CURVE_RGB": _curves(3, ("Fac", "Color")),
               "CURVE_VEC": _curves(3, ("Fac", "Vector"))}
