"""Bump, normal map and displacement nodes: what turns the shading normal."""
from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from .context import number_text
from .graph import Graph, Ref, Value, is_constant
from .tree import Scope, Source

MOST_BUMPS = 32
FLAT = (0.5, 0.5, 1.0)  # the colour of a tangent-space normal map that turns nothing


@dataclass(frozen=True)
class Turned:
    """A shading normal: heights that are added up, over a base that is None where it is the surface's own."""

    bumps: tuple[tuple[Any, Scope], ...]  # Bump nodes
    base: Source | None


def turned(socket: Any, scope: Scope) -> Turned:
    """What a Normal socket has."""
    bumps: list[tuple[Any, Scope]] = []
    source = scope.source(socket)
    while source.linked and source.node.type == "BUMP":
        bumps.append((source.node, source.scope))
        if len(bumps) >= MOST_BUMPS:
            scope.report.add("bumps", scope.owner, source.node.name, f"more than {MOST_BUMPS} Bump nodes in a row; the rest is left out")
            return Turned(tuple(bumps), None)
        source = source.scope.source(source.node.inputs["Normal"])
    own = not source.linked or source.node.type == "NEW_GEOMETRY" and source.socket.identifier == "Normal"
    return Turned(tuple(bumps), None if own else source)


def bump_height(graph: Graph, node: Any, scope: Scope) -> Value:
    """Height in metres of a Bump node, at the strength 1."""
    if not graph.is_linked(node.inputs["Height"], scope):
        return 0.0
    height = graph.product(graph.number(graph.value(node.inputs["Height"], scope)), graph.number(graph.value(node.inputs["Distance"], scope)))
    return graph.product(height, -1.0) if node.invert else height


def bump_strength(graph: Graph, node: Any, scope: Scope) -> Value:
    """The share of a Bump node's tilt that is kept; may be above 1."""
    return graph.math("MAXIMUM", graph.number(graph.value(node.inputs["Strength"], scope)), 0.0)


def displacement_height(graph: Graph, socket: Any, scope: Scope, *, in_object: bool = False) -> Value:
    """Height of a material's displacement, in metres or in the object's units."""
    source = scope.source(socket)
    if not source.linked:
        return 0.0
    node = source.node
    if node.type != "DISPLACEMENT":
        graph.report("displacement", node.name, f"only the Displacement node displaces; {node.bl_rna.name} is left out")
        return 0.0
    value = {name: graph.number(graph.value(node.inputs[name], source.scope)) for name in ("Height", "Midlevel", "Scale")}
    height = graph.product(graph.math("SUBTRACT", value["Height"], value["Midlevel"]), value["Scale"])
    if (node.space == "OBJECT") != in_object:
        graph.uses.add("instance")
        scale = graph.place.matrix_world.to_scale()
        mean = (abs(scale.x) + abs(scale.y) + abs(scale.z)) / 3
        height = graph.product(height, 1 / max(mean, 1e-12) if in_object else mean)
    return height


def moved_vertices(builder: Any, displacement: tuple[Any, Scope]) -> str:
    """pbrt parameter of shapes whose vertices the displacement moves; empty if it moves none."""
    graph = builder.graph()
    height = displacement_height(graph, *displacement, in_object=True)
    builder.took(graph)
    if isinstance(height, Ref):
        return f' "texture displacement" "{builder.context.texture(graph, height, "float", builder.lines)}" "float edgelength" 0'
    return f' "float displacement" {number_text(height)} "float edgelength" 0' if height else ""


def plain_normal_map(graph: Graph, source: Source) -> str | None:
    """The file of a tangent-space normal map that is an image over the mesh's first uv map and nothing else."""
    node = source.node
    strength = graph.value(node.inputs["Strength"], source.scope)
    color = source.scope.source(node.inputs["Color"])
    if not is_constant(strength) or graph.number(strength) != 1.0 or not color.linked or color.node.type != "TEX_IMAGE":
        return None
    image = color.node
    if image.projection != "FLAT" or image.extension != "REPEAT" or image.image is None or image.image.source == "TILED":
        return None
    vector = color.scope.source(image.inputs["Vector"])
    if vector.linked and not (vector.node.type == "TEX_COORD" and vector.socket.identifier == "UV" or vector.node.type == "UVMAP"):
        return None
    maps = graph.place.uv_maps
    if vector.linked and vector.node.type == "UVMAP" and vector.node.uv_map and vector.node.uv_map != (maps[0] if maps else ""):
        return None
    file = graph.context.images.write(image.image, graph.context.frame, image.image_user, owner=graph.owner, node=image.name)
    return file.name if file is not None and file.colorspace != "sRGB" else None


def tangent_color(graph: Graph, source: Source) -> Value:
    """The colour of a tangent-space normal map at the strength of its node."""
    node = source.node
    color = graph.value(node.inputs["Color"], source.scope)
    strength = graph.value(node.inputs["Strength"], source.scope)
    if is_constant(strength) and graph.number(strength) == 1.0:
        return color
    turned_by = graph.vector_math("SUBTRACT", graph.triple(color), FLAT)
    strength = graph.math("MAXIMUM", graph.number(strength), 0.0)
    return graph.vector_math("ADD", graph.add("VECT_MATH", "Vector", "vector", {"Vector": turned_by, "Scale": strength}, operation="SCALE"), FLAT)


def world_normal(graph: Graph, source: Source) -> Value:
    """The normal of a node in the world's space."""
    node = source.node
    if node.type != "NORMAL_MAP":
        return graph.value_of(source)
    own = graph.add("NEW_GEOMETRY", "Normal", "vector")
    if node.space == "TANGENT":
        graph.report("normal map", node.name, "a tangent-space normal map is only known as a shader's Normal; the surface's own normal is taken here")
        return own
    color = graph.triple(graph.value(node.inputs["Color"], source.scope))
    flip = -1.0 if node.space.startswith("BLENDER_") else 1.0
    normal = graph.vector_math("MULTIPLY", graph.vector_math("SUBTRACT", color, (0.5, 0.5, 0.5)), (2.0, 2.0 * flip, 2.0 * flip))
    if node.space.endswith("OBJECT"):
        graph.uses.add("instance")
        normal = graph.transformed(normal, graph.place.matrix_world.inverted_safe().transposed(), translate=False)
    normal = graph.add("VECT_MATH", "Vector", "vector", {"Vector": normal}, operation="NORMALIZE")
    strength = graph.value(node.inputs["Strength"], source.scope)
    if is_constant(strength) and graph.number(strength) == 1.0:
        return normal
    strength = graph.math("MAXIMUM", graph.number(strength), 0.0)
    moved = graph.add("VECT_MATH", "Vector", "vector", {"Vector": graph.vector_math("SUBTRACT", normal, own), "Scale": strength}, operation="SCALE")
    return graph.vector_math("ADD", own, moved)


def normal_parameters(builder: Any, socket: Any, scope: Scope) -> list[str]:
    """pbrt parameters of a shader's Normal socket and of the material's displacement."""
    normal = turned(socket, scope) if socket is not None else Turned((), None)
    parameters = []
    graph = builder.graph()
    height, strength = _lift(builder, graph, normal.bumps)
    builder.took(graph)
    if isinstance(height, Ref):  # a constant lifts all alike
        parameters.append(f'"texture displacement" "{builder.context.texture(graph, height, "float", builder.lines)}"')
        if isinstance(strength, Ref):
            parameters.append(f'"texture bump_strength" "{builder.context.texture(graph, strength, "float", builder.lines)}"')
        elif strength != 1.0:
            parameters.append(f'"float bump_strength" {number_text(strength)}')
    if normal.base is not None:
        parameters += _base_parameters(builder, normal.base)
    return parameters


def _lift(builder: Any, graph: Graph, bumps: tuple[tuple[Any, Scope], ...]) -> tuple[Value, Value]:
    """Height and strength of the Bump nodes and the displacement together. Bumps that follow each other add up. Where their
    strengths differ, each height is multiplied by its own, which is the same for slopes that are not steep."""
    heights = [bump_height(graph, node, scope) for node, scope in bumps]
    strengths = [graph.number(bump_strength(graph, node, scope)) for node, scope in bumps]
    if builder.displacement is not None:
        heights.append(displacement_height(graph, *builder.displacement))
        strengths.append(1.0)
    alike = all(s == strengths[0] for s in strengths)
    height: Value = 0.0
    for one, strength in zip(heights, strengths):
        height = graph.add_numbers(height, one if alike else graph.product(one, strength))
    return height, strengths[0] if strengths and alike else 1.0


def _base_parameters(builder: Any, source: Source) -> list[str]:
    graph = builder.graph()
    if source.node.type == "NORMAL_MAP" and source.node.space == "TANGENT":
        maps = builder.place.uv_maps
        if source.node.uv_map and maps and source.node.uv_map != maps[0]:
            graph.report("normal map", source.node.name, f"tangents are those of the first uv map, not of {source.node.uv_map!r}")
        file = plain_normal_map(graph, source)
        if file is not None:
            return [f'"string normalmap" "{file}"']
        name, value = "normalmap", tangent_color(graph, source)
    else:
        name, value = "normal", world_normal(graph, source)
    builder.took(graph)
    if not isinstance(value, Ref):
        if name == "normalmap" and max(abs(a - b) for a, b in zip(graph.triple(value), FLAT)) < 1e-5:
            return []
        value = graph.add("RGB", "Color", "color", color=list(graph.triple(value)))
    return [f'"texture {name}" "{builder.context.texture(graph, value, "spectrum", builder.lines)}"']


def _nested(graph: Graph, source: Source) -> Value:
    """A Bump or Normal Map node that something else than a shader reads."""
    if source.node.type == "NORMAL_MAP":
        return world_normal(graph, source)
    graph.report("bump", source.node.name, "the bump is only known as a shader's Normal; the surface's own normal is taken here")
    return graph.add("NEW_GEOMETRY", "Normal", "vector")


TRANSLATORS = {"BUMP": _nested, "NORMAL_MAP": _nested}
