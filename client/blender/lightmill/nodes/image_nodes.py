"""Image and environment textures."""
from __future__ import annotations

from typing import Any

from .graph import Graph, Value
from .images import ImageFile
from .tree import Source

MISSING = (1.0, 0.0, 1.0, 1.0)  # as Cycles draws an image that is not there
MOST_TILES = 60


def _written(graph: Graph, node: Any, tile: int | None = None) -> ImageFile | None:
    return graph.context.images.write(node.image, graph.context.frame, node.image_user, owner=graph.owner, node=node.name, tile=tile,
                                      multiplied=not _alpha_is_used(node))


def _alpha_is_used(node: Any) -> bool:
    return "Alpha" in node.outputs and node.outputs["Alpha"].is_linked


def _interpolation(node: Any) -> str:
    return "Cubic" if node.interpolation == "Smart" else node.interpolation  # on a CPU both are one


def _lookup(graph: Graph, node: Any, file: ImageFile, output: str, inputs: dict[str, Value], **parameters: Any) -> Value:
    """Colour or alpha of a picture. Cycles shows colours multiplied by alpha, unless the node's Alpha is used.

    Straight alpha that is still there is of float files (linear), sequences and tiles."""
    def look(what: str) -> Value:
        return graph.add(node.type, what, "color" if what == "Color" else "number", inputs, image=file.name, colorspace=file.colorspace,
                         interpolation=_interpolation(node), **parameters)

    if output == "Alpha":
        return 1.0 if file.alpha == "none" else look("Alpha")
    color = look("Color")
    alpha_is_used = _alpha_is_used(node)
    if file.alpha == "straight" and not alpha_is_used:
        alpha = look("Alpha")
        return graph.add("MIX_RGB", "Color", "color", {"Fac": 1.0, "Color1": color, "Color2": alpha}, blend_type="MULTIPLY")
    if file.alpha == "multiplied" and alpha_is_used:
        alpha = look("Alpha")
        return graph.add("MIX_RGB", "Color", "color", {"Fac": 1.0, "Color1": color, "Color2": alpha}, blend_type="DIVIDE")
    return color


def _image(graph: Graph, source: Source) -> Value:
    node, output = source.node, source.socket.identifier
    if node.image is None:
        graph.report("no image", node.name, "the node has no image; it is drawn in magenta", lasting=True)
        return 1.0 if output == "Alpha" else MISSING
    socket = node.inputs["Vector"]
    inputs = {"Vector": graph.value(socket, source.scope)} if graph.is_linked(socket, source.scope) else {}
    if node.image.source == "TILED":
        return _tiles(graph, node, output, inputs)
    file = _written(graph, node)
    if file is None:
        return 1.0 if output == "Alpha" else MISSING
    parameters: dict[str, Any] = {"projection": node.projection, "extension": node.extension}
    if node.projection == "BOX":
        parameters["projection_blend"] = float(node.projection_blend)
    return _lookup(graph, node, file, output, inputs, **parameters)


def _tiles(graph: Graph, node: Any, output: str, inputs: dict[str, Value]) -> Value:
    """UDIM: each tile is shown in its own square of the uv plane."""
    tiles = sorted(t.number for t in node.image.tiles)
    if len(tiles) > MOST_TILES:
        graph.report("tiles", node.name, f"an image has more than {MOST_TILES} tiles; the rest is black")
    at = inputs.get("Vector") or graph.add("UVMAP", "UV", "vector")
    cell = graph.add("VECT_MATH", "Vector", "vector", {"Vector": at}, operation="FLOOR")
    parts = [graph.add("SEPXYZ", axis, "number", {"Vector": cell}) for axis in "XY"]
    total: Value = 0.0
    for number in tiles[:MOST_TILES]:
        file = _written(graph, node, number)
        if file is None:
            continue
        column, row = (number - 1001) % 10, (number - 1001) // 10
        inside = graph.math("MULTIPLY", *(graph.math("COMPARE", p, float(k), 0.5) for p, k in zip(parts, (column, row))))
        moved = graph.vector_math("SUBTRACT", at, (float(column), float(row), 0.0))
        shown = _lookup(graph, node, file, output, {"Vector": moved}, projection="FLAT", extension="EXTEND")
        total = graph.sum(total, graph.product(shown, inside))
    return graph.number(total) if output == "Alpha" else total


def _environment(graph: Graph, source: Source) -> Value:
    node = source.node
    if node.image is None:
        graph.report("no image", node.name, "the node has no image; it is drawn in magenta", lasting=True)
        return MISSING
    file = _written(graph, node)
    if file is None:
        return MISSING
    if node.projection != "EQUIRECTANGULAR":
        graph.report("projection", node.name, "a mirror ball as a surface's texture is read as equirectangular")
    socket = node.inputs["Vector"]
    vector = graph.value(socket, source.scope) if graph.is_linked(socket, source.scope) else graph.add("NEW_GEOMETRY", "Position", "vector")
    return _lookup(graph, node, file, "Color", {"Vector": vector})


TRANSLATORS = {"TEX_IMAGE": _image, "TEX_ENVIRONMENT": _environment}
