"""Tangents: what anisotropic lobes lie along."""
from __future__ import annotations

from typing import Any

from .graph import Graph, Ref, Value
from .tree import Scope, Source

_ACROSS = {"X": (None, "Z", "Y"), "Y": ("Z", None, "X"), "Z": ("Y", "X", None)}


def radial(graph: Graph, axis: str) -> Value:
    """Around an axis through the middle of the object's bounds, in the world's space."""
    graph.uses.update(("generated", "instance"))
    point = graph.vector_math("SUBTRACT", graph.add("TEX_COORD", "Generated", "vector"), (0.5, 0.5, 0.5))
    parts: dict[str, Value] = {}
    signs = iter((-1.0, 1.0))
    for name, other in zip("XYZ", _ACROSS[axis]):
        part = graph.add("SEPXYZ", other, "number", {"Vector": point}) if other else 0.0
        parts[name] = graph.product(part, next(signs)) if other else part
    around = graph.add("COMBXYZ", "Vector", "vector", parts)
    return graph.transformed(around, graph.place.matrix_world.inverted_safe().transposed(), translate=False)


def value(graph: Graph, source: Source) -> Value:
    """Of a Tangent node, or None where it is dp/du."""
    node = source.node
    if node.direction_type == "RADIAL":
        return radial(graph, node.axis)
    maps = graph.place.uv_maps
    if node.uv_map and maps and node.uv_map != maps[0]:
        graph.report("tangent", node.name, f"the tangent is that of the first uv map, not of {node.uv_map!r}")
    return None


def within_surface(graph: Graph, vector: Value) -> Value:
    """The unit vector of the surface's plane that is nearest to `vector`."""
    normal = graph.add("NEW_GEOMETRY", "Normal", "vector")
    across = graph.add("VECT_MATH", "Vector", "vector", {"Vector": graph.vector_math("CROSS_PRODUCT", vector, normal)}, operation="NORMALIZE")
    return graph.vector_math("CROSS_PRODUCT", normal, across)


def tangent_parameters(builder: Any, socket: Any, scope: Scope) -> list[str]:
    """pbrt parameters of a shader's Tangent socket. Unlinked it is the radial tangent around z, as in Cycles."""
    graph = builder.graph()
    source = scope.source(socket)
    if not source.linked:
        found = radial(graph, "Z")
    elif source.node.type == "TANGENT":
        found = value(graph, source)
    else:
        found = graph.value(socket, scope)
    builder.took(graph)
    return [f'"texture tangent" "{builder.context.texture(graph, found, "spectrum", builder.lines)}"'] if isinstance(found, Ref) else []


def _nested(graph: Graph, source: Source) -> Value:
    """A Tangent node that something else than a shader reads."""
    found = value(graph, source)
    if found is None:
        graph.report("tangent node", source.node.name, "the tangent of a uv map is only known as a shader's Tangent; it is 0")
        return (0.0, 0.0, 0.0)
    return within_surface(graph, found)


TRANSLATORS = {"TANGENT": _nested}
