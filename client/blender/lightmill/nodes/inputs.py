"""Nodes that say where a point is, how it is seen, and constants."""
from __future__ import annotations

from typing import Any

from mathutils import Matrix, Vector

from . import fold, spectrum, tangents
from .graph import Graph, Value, is_constant, kind_of_socket
from .place import MADE_ATTRIBUTES
from .tree import Source


# As Cycles 3.4 has them: no object's coordinates, and those of textures are 0.
_OF_LAMPS = {"Object": lambda graph: graph.add("NEW_GEOMETRY", "Position", "vector"),
             "Generated": lambda graph: graph.add("NEW_GEOMETRY", "Position", "vector"),
             "Normal": lambda graph: graph.add("NEW_GEOMETRY", "Normal", "vector"),
             "UV": lambda graph: (0.0, 0.0, 0.0)}


def _coordinates(graph: Graph, source: Source) -> Value:
    node, output = source.node, source.socket.identifier
    if getattr(node, "from_instancer", False) and output in ("Generated", "UV"):
        graph.report("from instancer", node.name, "coordinates of the instancer are not known; the object's own are taken")
    if output == "Object" and node.object is not None:
        other = node.object
        if graph.context.depsgraph is not None:
            other = other.evaluated_get(graph.context.depsgraph)
        position = graph.add("NEW_GEOMETRY", "Position", "vector")
        return graph.transformed(position, other.matrix_world.inverted_safe())
    if output == "Window":
        return _window(graph)
    if graph.place.is_lamp and output in _OF_LAMPS:
        return _OF_LAMPS[output](graph)
    if output in ("Object", "Normal"):
        graph.uses.add("object")
    elif output in ("Generated", "Camera"):
        graph.uses.add(output.lower())
    return graph.add("TEX_COORD", output, "vector")


def _camera_point(graph: Graph) -> Value:
    graph.uses.add("camera")
    return graph.add("TEX_COORD", "Camera", "vector")


def _window(graph: Graph) -> Value:
    """Where the camera shows the point: 0 to 1 over the picture."""
    camera = graph.context.camera()
    render = graph.context.scene.render
    if camera is None or camera.type != "CAMERA" or camera.data.type == "PANO":
        graph.report("window coordinates", "", "Window coordinates need a perspective or orthographic camera; they are 0")
        return (0.0, 0.0, 0.0)
    projection = camera.calc_matrix_camera(graph.context.depsgraph, x=render.resolution_x, y=render.resolution_y,
                                           scale_x=render.pixel_aspect_x, scale_y=render.pixel_aspect_y)
    # The camera space of nodes looks along +z, that of the matrix along -z.
    projection = projection @ Matrix.Diagonal((1.0, 1.0, -1.0, 1.0))
    point = _camera_point(graph)
    rows = [graph.row_times(projection[i], point) for i in (0, 1, 3)]
    parts = {name: graph.math("MULTIPLY_ADD", graph.math("DIVIDE", rows[i], rows[2]), 0.5, 0.5) for i, name in enumerate("XY")}
    return graph.add("COMBXYZ", "Vector", "vector", {**parts, "Z": 0.0})


def _uv(graph: Graph, name: str, node: Any) -> Value:
    maps = graph.place.uv_maps
    graph.uses.add("mesh")
    number = maps.index(name) if name in maps else 0
    if name and name not in maps:
        graph.report("uv map", node.name, f"the mesh has no uv map {name!r}; its first one is taken")
    if number > 1:
        graph.report("uv map", node.name, f"the uv map {name!r} is the mesh's third or later; the first one is taken")
        number = 0
    return graph.add("UVMAP", "UV", "vector", uv_set=number) if number else graph.add("UVMAP", "UV", "vector")


def _uv_map(graph: Graph, source: Source) -> Value:
    if graph.place.is_lamp:
        return (0.0, 0.0, 0.0)
    if source.node.from_instancer:
        graph.report("from instancer", source.node.name, "coordinates of the instancer are not known; the object's own are taken")
    return _uv(graph, source.node.uv_map, source.node)


def uv_of_name(graph: Graph, name: str, node: Any) -> Value | None:
    """The uv map of that name as a vector, if the mesh has one."""
    return _uv(graph, name, node) if name in graph.place.uv_maps[:2] else None


_GEOMETRY_LEFT_OUT = {"Parametric": (0.0, 0.0, 0.0), "Pointiness": 0.5, "Random Per Island": 0.5}


def _geometry(graph: Graph, source: Source) -> Value:
    output = source.socket.identifier
    if output == "Tangent":
        return tangents.within_surface(graph, tangents.radial(graph, "Z"))
    made = MADE_ATTRIBUTES.get(output)
    if made is not None and made == graph.place.attribute:
        graph.uses.add("mesh")
        return graph.add("ATTRIBUTE", "Fac", "number")
    if output == "Parametric" and graph.place.is_lamp:
        return graph.add("UVMAP", "UV", "vector")  # of the shape that the exporter draws: 0 to 1 over the lamp
    if output in _GEOMETRY_LEFT_OUT:
        graph.report(f"geometry {output}", source.node.name, f"the output {output} is not known here; it is {_GEOMETRY_LEFT_OUT[output]}")
        return _GEOMETRY_LEFT_OUT[output]
    return graph.add("NEW_GEOMETRY", output, kind_of_socket(source.socket))


def _camera_data(graph: Graph, source: Source) -> Value:
    point, output = _camera_point(graph), source.socket.identifier
    if output == "View Z Depth":
        return graph.add("SEPXYZ", "Z", "number", {"Vector": point})
    if output == "View Distance":
        return graph.add("VECT_MATH", "Value", "number", {"Vector": point}, operation="LENGTH")
    return graph.add("VECT_MATH", "Vector", "vector", {"Vector": point}, operation="NORMALIZE")


def _light_path(graph: Graph, source: Source) -> Value:
    known = graph.context.light_path
    if known is not None:
        return known.get(source.socket.identifier, 0.0)
    return graph.add("LIGHT_PATH", source.socket.identifier, "number")


def _value(graph: Graph, source: Source) -> Value:
    return float(source.node.outputs[0].default_value)


def _rgb(graph: Graph, source: Source) -> Value:
    return tuple(float(c) for c in source.node.outputs[0].default_value)


def _normal(graph: Graph, source: Source) -> Value:
    node = source.node
    normal = tuple(float(c) for c in node.outputs["Normal"].default_value)
    if source.socket.identifier == "Normal":
        return tuple(Vector(normal).normalized())
    return graph.add("NORMAL", "Dot", "number", {"Normal": graph.value(node.inputs["Normal"], source.scope)}, normal=list(normal))


def _transform(graph: Graph, source: Source) -> Value:
    node = source.node
    spaces = {"WORLD": Matrix.Identity(4)}
    if "OBJECT" in (node.convert_from, node.convert_to):
        graph.uses.add("instance")
        spaces["OBJECT"] = graph.place.matrix_world
    if "CAMERA" in (node.convert_from, node.convert_to):
        graph.uses.add("camera")
        spaces["CAMERA"] = graph.context.to_camera().inverted_safe()
    # Normals turn as directions do, as in Cycles.
    matrix = spaces[node.convert_to].inverted_safe() @ spaces[node.convert_from]
    value = graph.transformed(graph.value(node.inputs["Vector"], source.scope), matrix, translate=node.vector_type == "POINT")
    if node.vector_type == "NORMAL":
        value = graph.add("VECT_MATH", "Vector", "vector", {"Vector": value}, operation="NORMALIZE")
    return value


def _wavelength(graph: Graph, source: Source) -> Value:
    nm = graph.value(source.node.inputs["Wavelength"], source.scope)
    if is_constant(nm):
        return (*spectrum.wavelength(fold.as_number(nm)), 1.0)
    low, high = 375.0, 785.0
    colors = [spectrum.wavelength(low + (high - low) * i / 255) for i in range(256)]
    same = graph.add("COMBXYZ", "Vector", "vector", {"X": nm, "Y": nm, "Z": nm})
    return graph.add("CURVE_RGB", "Color", "color", {"Color": same}, tables=[[c[k] for c in colors] for k in range(3)], low=low, high=high,
                     extend="HORIZONTAL")


def _occlusion(graph: Graph, source: Source) -> Value:
    graph.report("node AMBIENT_OCCLUSION", source.node.name, "ambient occlusion in textures is not supported; nothing is occluded")
    if source.socket.identifier == "AO":
        return 1.0
    return graph.value(source.node.inputs["Color"], source.scope)


def _bevel(graph: Graph, source: Source) -> Value:
    graph.report("node BEVEL", source.node.name, "Bevel is not supported; the surface's own normal is taken")
    return graph.add("NEW_GEOMETRY", "Normal", "vector")


def _light_falloff(graph: Graph, source: Source) -> Value:
    """Quadratic is how light falls off anyway."""
    if source.socket.identifier != "Quadratic":
        graph.report("falloff", source.node.name, f"{source.socket.name} falloff is not supported; it is quadratic")
    smooth = graph.value(source.node.inputs["Smooth"], source.scope)
    if not is_constant(smooth) or smooth != 0:
        graph.report("falloff smooth", source.node.name, "the Smooth of Light Falloff is not supported")
    return graph.number(graph.value(source.node.inputs["Strength"], source.scope))


TRANSLATORS = {"LIGHT_FALLOFF": _light_falloff, "TEX_COORD": _coordinates, "UVMAP": _uv_map, "NEW_GEOMETRY": _geometry, "CAMERA": _camera_data, "LIGHT_PATH": _light_path,
               "VALUE": _value, "RGB": _rgb, "NORMAL": _normal, "VECT_TRANSFORM": _transform, "WAVELENGTH": _wavelength,
               "AMBIENT_OCCLUSION": _occlusion, "BEVEL": _bevel}
