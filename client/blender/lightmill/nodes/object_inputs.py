"""Nodes whose values belong to an object, an instance or a particle: constants once it is known which."""
from __future__ import annotations

from typing import Any

from .graph import Graph, Value
from .inputs import uv_of_name
from .tree import Source


def _as_color(value: Any) -> tuple[float, ...] | None:
    """A property of Blender as a colour with alpha."""
    if isinstance(value, (bool, int, float)):
        return (float(value),) * 3 + (1.0,)
    try:
        parts = [float(x) for x in value]
    except (TypeError, ValueError):
        return None
    return tuple((parts + [0.0, 0.0, 0.0])[:3]) + ((parts[3],) if len(parts) > 3 else (1.0,)) if parts else None


def _property(owner: Any, name: str) -> tuple[float, ...] | None:
    """A custom property, or one of Blender's by its path, of the object or its data."""
    for holder in (owner, getattr(owner, "data", None)):
        if holder is None:
            continue
        try:
            found = holder[name] if name in holder.keys() else holder.path_resolve(name)
        except (KeyError, ValueError, TypeError, AttributeError):
            continue
        color = _as_color(found)
        if color is not None:
            return color
    return None


def _output(color: tuple[float, ...], output: str) -> Value:
    if output == "Fac":
        return sum(color[:3]) / 3
    if output == "Alpha":
        return color[3]
    return color[:3] if output == "Vector" else color


def _attribute(graph: Graph, source: Source) -> Value:
    node, output = source.node, source.socket.identifier
    name, kind = node.attribute_name, node.attribute_type
    if graph.grid_value is not None and kind == "GEOMETRY":
        return _output((graph.grid_value,) * 3 + (1.0,), output)
    if kind in ("OBJECT", "INSTANCER"):
        graph.uses.add("instance")
        owner = graph.place.object if kind == "OBJECT" else graph.place.instancer or graph.place.object
        found = _property(owner, name) if owner is not None else None
        if found is None:
            graph.report(f"attribute {name}", node.name, f"the object has no property {name!r}; it is 0")
        return _output(found or (0.0, 0.0, 0.0, 0.0), output)
    if kind == "VIEW_LAYER":
        found = None
        for owner in (graph.context.view_layer, graph.context.scene, graph.context.scene.world):
            found = found or (_property(owner, name) if owner is not None else None)
        if found is None:
            graph.report(f"attribute {name}", node.name, f"no view layer or scene has the property {name!r}; it is 0")
        return _output(found or (0.0, 0.0, 0.0, 0.0), output)
    uv = uv_of_name(graph, name, node) if name and name != graph.place.attribute else None
    if uv is not None:
        if output == "Alpha":
            return 1.0
        return graph.add("SEPXYZ", "X", "number", {"Vector": uv}) if output == "Fac" else uv  # as in Cycles
    return _mesh_attribute(graph, node, name, output)


def _mesh_attribute(graph: Graph, node: Any, name: str, output: str) -> Value:
    graph.uses.add("mesh")
    if name != graph.place.attribute:
        if name:
            graph.report(f"attribute {name}", node.name, f"the mesh is exported without the attribute {name!r} "
                         "(a mesh has one; the first that its materials ask for); it is 0")
            return 0.0 if output in ("Fac", "Alpha") else (0.0, 0.0, 0.0)
    kind = "number" if output in ("Fac", "Alpha") else "vector" if output == "Vector" else "color"
    return graph.add("ATTRIBUTE", output, kind)


def _vertex_color(graph: Graph, source: Source) -> Value:
    return _mesh_attribute(graph, source.node, source.node.layer_name, source.socket.identifier)


def _object_info(graph: Graph, source: Source) -> Value:
    output, place = source.socket.identifier, graph.place
    graph.uses.add("instance")
    if output == "Location":
        return tuple(float(x) for x in place.matrix_world.translation)
    if output == "Color":
        return tuple(float(x) for x in place.color[:3]) + (1.0,)
    if output == "Alpha":
        return float(place.color[3]) if len(place.color) > 3 else 1.0
    if output == "Object Index":
        return float(place.pass_index)
    if output == "Material Index":
        return float(graph.material_index)
    if output == "Random":
        return float(place.random)
    graph.report(f"object info {output}", source.node.name, f"the output {output} is not known here; it is 0")
    return 0.0


def _particle_info(graph: Graph, source: Source) -> Value:
    graph.uses.add("instance")
    output = source.socket.identifier
    vector = source.socket.type == "VECTOR"
    found = graph.place.particle.get(output)
    if found is None:
        if not graph.place.particle:
            return (0.0, 0.0, 0.0) if vector else 0.0  # no particle: as in Blender
        graph.report(f"particle {output}", source.node.name, f"the particle's {output} is not known; it is 0")
        return (0.0, 0.0, 0.0) if vector else 0.0
    return tuple(float(x) for x in found) if vector else float(found)


def _hair_info(graph: Graph, source: Source) -> Value:
    output = source.socket.identifier
    if output == "Is Strand":
        graph.uses.add("instance")
        return float(graph.place.is_strand)
    if output == "Intercept" and graph.place.is_strand:
        # A strand's v runs from root to tip.
        return graph.add("SEPXYZ", "Y", "number", {"Vector": graph.add("UVMAP", "UV", "vector")})
    graph.report(f"hair {output}", source.node.name, f"the hair's {output} is not known here; it is 0")
    return (0.0, 0.0, 0.0) if source.socket.type == "VECTOR" else 0.0


def _volume_info(graph: Graph, source: Source) -> Value:
    output = source.socket.identifier
    if output == "Density":
        return graph.grid_value if graph.grid_value is not None else 0.0
    graph.report(f"volume info {output}", source.node.name, f"the volume's {output} is not looked at; it is 0")
    return (0.0, 0.0, 0.0, 1.0) if output == "Color" else 0.0


TRANSLATORS = {"VOLUME_INFO": _volume_info, "ATTRIBUTE": _attribute, "VERTEX_COLOR": _vertex_color, "OBJECT_INFO": _object_info, "PARTICLE_INFO": _particle_info,
               "HAIR_INFO": _hair_info}
