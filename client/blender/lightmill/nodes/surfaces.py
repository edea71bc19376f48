"""Materials: the surface, emission and volume of a tree's active output."""
from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from . import normals
from . import principled  # noqa: F401  (registers its shader)
from .context import Context, number_text
from .emitters import Emission, emission
from .place import MADE_ATTRIBUTES, Place
from .shaders import Builder
from .tree import Scope
from .media import Grid, Medium, medium_of_tree

DEFAULT_GREY = '"rgb color" [0.8 0.8 0.8]'  # what Blender draws without a material


@dataclass(frozen=True)
class Surface:
    """A material in a place."""

    name: str
    lines: tuple[str, ...]  # Texture, MakeNamedMaterial and MakeNamedMedium directives, each a whole one
    emission: Emission | None = None
    volume: Medium | None = None
    displacement: str = ""  # parameters of shapes whose vertices it moves
    uses: frozenset[str] = frozenset()  # of the place: "object", "generated", "instance", "mesh", "light_group"


@dataclass(frozen=True)
class Needs:
    """What a tree asks of a mesh."""

    uv_maps: tuple[str, ...]
    attributes: tuple[str, ...]


def output_node(tree: Any) -> Any:
    """The active output of a tree for Cycles, or None."""
    if hasattr(tree, "get_output_node"):
        return tree.get_output_node("CYCLES")
    return None


def place_key(place: Place, uses: frozenset[str], context: Context) -> Any:
    """What must be equal for two places to share a material."""
    key: list[Any] = []
    if "mesh" in uses:
        key.append((place.uv_maps, place.attribute))
    if "light_group" in uses:
        key.append(place.light_group)
    if uses & {"object", "generated", "instance"}:
        key.append((place.moving, *(x for row in place.matrix_world for x in row)))
    if "generated" in uses:
        key.append(tuple(x for row in place.generated for x in row))
    if "instance" in uses:
        key.append((place.name, place.random, place.color, place.pass_index, place.is_strand, tuple(sorted(map(str, place.particle.items()))),
                    id(place.object), id(place.instancer)))
    return tuple(key)


def surface(material: Any, context: Context, place: Place | None = None) -> Surface:
    """What is to be written for a material slot. `material` may be None: Blender's default grey."""
    place = place or Place()
    name = material.as_pointer() if material is not None else 0
    for uses, key, found in context.surfaces.get(name, ()):
        if place_key(place, uses, context) == key:
            return found
    found = _translated(material, context, place)
    context.surfaces.setdefault(name, []).append((found.uses, place_key(place, found.uses, context), found))
    return found


def _translated(material: Any, context: Context, place: Place) -> Surface:
    owner = material.name_full if material is not None else ""
    b = Builder(context, place, owner, material.pass_index if material is not None else 0)
    if material is None or not material.use_nodes or material.node_tree is None:
        color = DEFAULT_GREY if material is None else f'"rgb color" [{" ".join(number_text(min(max(c, 0.0), 1.0)) for c in material.diffuse_color[:3])}]'
        return Surface(b.material("diffuse_bsdf", [color]), tuple(b.lines))
    output = output_node(material.node_tree)
    if output is None:
        return Surface(b.black(), tuple(b.lines))
    scope = Scope(material.node_tree, owner, context.report)
    displacement = output.inputs["Displacement"]
    moved = ""
    if scope.source(displacement).linked:
        method = getattr(material, "displacement_method", None) or getattr(getattr(material, "cycles", None), "displacement_method", "BUMP")
        if method != "BUMP":
            moved = normals.moved_vertices(b, (displacement, scope))
        if method != "DISPLACEMENT":
            b.displacement = (displacement, scope)
    closure = b.closure(output.inputs["Surface"], scope)
    light = emission(b, closure.terms)
    volume = medium_of_tree(b, output.inputs["Volume"], scope, material=material)
    if closure.material is not None:
        name = closure.material
    elif not scope.source(output.inputs["Surface"]).linked and volume is not None:
        name = b.material("interface", [])
    else:
        name = b.black()
    lines = list(b.lines)
    if light is not None:
        lines += light.lines
    if volume is not None:
        lines += volume.lines
    return Surface(name, tuple(dict.fromkeys(lines)), light, volume, moved, frozenset(b.uses - {"camera"}))


def volume(material: Any, context: Context, place: Place | None = None, grid: Grid | None = None) -> Medium | None:
    """The medium of a volume object's material; `grid` is its file. None if the material has no volume."""
    if material is None or not material.use_nodes or material.node_tree is None:
        return None
    output = output_node(material.node_tree)
    if output is None:
        return None
    b = Builder(context, place or Place(), material.name_full, material.pass_index)
    return medium_of_tree(b, output.inputs["Volume"], Scope(material.node_tree, b.owner, context.report), grid, material)


def needs(material: Any) -> Needs:
    """Names of uv maps and attributes that a material's tree and its groups name. "" is the active one."""
    uv_maps: dict[str, None] = {}
    attributes: dict[str, None] = {}
    trees = [material.node_tree] if material is not None and material.use_nodes and material.node_tree else []
    seen = set()
    while trees:
        tree = trees.pop()
        if tree.as_pointer() in seen:
            continue
        seen.add(tree.as_pointer())
        for node in tree.nodes:
            if node.type == "GROUP" and node.node_tree is not None:
                trees.append(node.node_tree)
            elif node.type in ("UVMAP", "NORMAL_MAP", "TANGENT"):
                uv_maps[node.uv_map] = None
            elif node.type == "ATTRIBUTE" and node.attribute_type == "GEOMETRY":
                attributes[node.attribute_name] = None
            elif node.type == "VERTEX_COLOR":
                attributes[node.layer_name] = None
            elif node.type == "NEW_GEOMETRY":
                attributes.update({name: None for output, name in MADE_ATTRIBUTES.items() if node.outputs[output].is_linked})
    return Needs(tuple(uv_maps), tuple(attributes))
