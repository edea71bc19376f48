"""Shader nodes as materials of the contract, and the light that they emit."""
from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any, Callable

from . import normals, tangents
from .context import Context, digest, number_text
from .fold import as_number, as_triple
from .graph import Graph, Value, is_constant
from .place import Place
from .tree import Scope, Source, translate_in_order

MOST_TERMS = 64


@dataclass(frozen=True)
class Term:
    """Light that one shader emits: colour x strength x factors. A factor is a socket, and whether 1 minus it counts."""

    color: tuple[Any, Scope]
    strength: tuple[Any, Scope] | None
    factors: tuple[tuple[Any, Scope, bool], ...] = ()


@dataclass(frozen=True)
class Closure:
    """What a shader socket carries: a material that scatters (None: black), and emission."""

    material: str | None = None
    terms: tuple[Term, ...] = ()


NOTHING = Closure()


class Builder:
    """Materials of one tree. `lines` get the definitions, inner ones first."""

    def __init__(self, context: Context, place: Place, owner: str, material_index: int = 0) -> None:
        self.context, self.place, self.owner, self.material_index = context, place, owner, material_index
        self.lines: list[str] = []
        self.uses: set[str] = set()
        self.displacement: tuple[Any, Scope] | None = None
        self.emits = self.scatters = True

    def graph(self) -> Graph:
        graph = Graph(self.context, self.place, self.owner)
        graph.material_index = self.material_index
        return graph

    def took(self, graph: Graph) -> None:
        self.uses |= graph.uses

    def report(self, kind: str, node: Any, text: str) -> None:
        self.context.report.add(kind, self.owner, node.name if node else "", text)

    def value(self, socket: Any, scope: Scope) -> tuple[Graph, Value]:
        graph = self.graph()
        value = graph.value(socket, scope)
        self.took(graph)
        return graph, value

    def constant(self, node: Any, scope: Scope, name: str) -> float | None:
        """The number of an input, or None if it varies or is not there."""
        socket = node.inputs.get(name)
        if socket is None:
            return None
        value = self.value(socket, scope)[1]
        return as_number(value) if is_constant(value) else None

    def is_flat(self, radius: Any, scope: Scope) -> bool:
        """Whether a subsurface radius is 0 for all colours: what Cycles draws as diffuse."""
        value = self.value(radius, scope)[1]
        return is_constant(value) and max(as_triple(value)) <= 0

    def parameter(self, name: str, kind: str, socket: Any, scope: Scope, *, bounded: bool = False) -> str:
        graph, value = self.value(socket, scope)
        if kind == "float" and not is_constant(value):
            value = graph.number(value)
        if bounded and is_constant(value) and kind == "spectrum":
            value = tuple(min(max(c, 0.0), 1.0) for c in as_triple(value))
        if name == "radius" and is_constant(value):
            value = walkable(value)
        return self.context.parameter(name, kind, graph, value, self.lines)

    def material(self, type_: str, parameters: list[str]) -> str:
        """Defines a material; gives its name, which is that of its content."""
        body = " ".join([f'"string type" "{type_}"', *parameters])
        name = f"m_{digest(body)[:32]}"
        self.lines.append(f'MakeNamedMaterial "{name}" {body}')
        return name

    def black(self) -> str:
        return self.material("diffuse_bsdf", ['"rgb color" [0 0 0]'])

    def mixed(self, graph: Graph, factor: Value, first: Closure, second: Closure) -> str | None:
        """The material between two closures; factor 0 is the first."""
        if is_constant(factor):
            x = min(max(as_number(factor), 0.0), 1.0)
            if x in (0.0, 1.0):
                return (second if x else first).material
            factor = x
        else:
            factor = graph.number(factor)
        if first.material == second.material:
            return first.material
        both = [c.material or self.black() for c in (first, second)]
        return self.material("mix_bsdf", [f'"string materials" ["{both[0]}" "{both[1]}"]', self.context.parameter("factor", "float", graph, factor, self.lines)])

    # Walking the tree.

    def closure(self, socket: Any, scope: Scope) -> Closure:
        """What a shader input has."""
        source = scope.source(socket)
        if not source.linked:
            return NOTHING
        done: dict[Any, Closure] = {}
        translate_in_order(source, done, _key, _shader_inputs, lambda s: self._translated(s, done), self._cut)
        return done[_key(source)]

    def _translated(self, source: Source, done: dict[Any, Closure]) -> Closure:
        node = source.node
        translate = SHADERS.get(node.type)
        if translate is None:
            if any(s.type == "SHADER" for s in node.outputs):
                self.report(f"shader {node.type}", node, f"{node.bl_rna.name} is not supported; it is black")
                return NOTHING
            # Blender shows a colour that is linked to a shader socket as emission.
            return Closure(None, (Term((source, None), None),))

        def inner(index: int) -> Closure:
            sockets = [s for s in node.inputs if s.type == "SHADER"]
            found = source.scope.source(sockets[index]) if index < len(sockets) else None
            return done[_key(found)] if found is not None and found.linked else NOTHING

        return translate(self, node, source.scope, inner)

    def _cut(self, source: Source) -> Closure:
        self.report("cycle", source.node, "the shader feeds itself; it is cut here")
        return NOTHING

    def weighted(self, terms: tuple[Term, ...], socket: Any, scope: Scope, rest: bool) -> tuple[Term, ...]:
        return tuple(Term(t.color, t.strength, (*t.factors, (socket, scope, rest))) for t in terms)

    def together(self, node: Any, *terms: tuple[Term, ...]) -> tuple[Term, ...]:
        all_terms = sum(terms, ())
        if len(all_terms) > MOST_TERMS:
            self.report("emission terms", node, f"more than {MOST_TERMS} shaders emit; the rest is dark")
        return all_terms[:MOST_TERMS]


def walkable(radius: Value) -> tuple[float, ...]:
    """A subsurface radius that light can walk by in every colour. Where Cycles has 0, the colour is diffuse: it leaves where
    it entered, as it all but does at a hundredth of the longest way."""
    longest = max(as_triple(radius))
    return tuple(max(c, longest / 100) for c in as_triple(radius))


def _key(source: Source) -> Any:
    return source.node.as_pointer(), id(source.scope), source.socket.identifier


def _shader_inputs(source: Source) -> list[Source]:
    found = [source.scope.source(s) for s in source.node.inputs if s.type == "SHADER"]
    return [s for s in found if s.linked]


Inner = Callable[[int], Closure]


def _mix(b: Builder, node: Any, scope: Scope, inner: Inner) -> Closure:
    first, second, fac = inner(0), inner(1), node.inputs[0]
    graph, factor = b.value(fac, scope)
    if is_constant(factor):
        x = min(max(as_number(factor), 0.0), 1.0)
        if x in (0.0, 1.0):
            return second if x else first
    terms = b.together(node, b.weighted(first.terms, fac, scope, True), b.weighted(second.terms, fac, scope, False))
    return Closure(b.mixed(graph, factor, first, second), terms)


def _add(b: Builder, node: Any, scope: Scope, inner: Inner) -> Closure:
    first, second = inner(0), inner(1)
    materials = [c.material for c in (first, second) if c.material]
    name = b.material("add_bsdf", [f'"string materials" ["{materials[0]}" "{materials[1]}"]']) if len(materials) == 2 else next(iter(materials), None)
    return Closure(name, b.together(node, first.terms, second.terms))


def _emission(b: Builder, node: Any, scope: Scope, inner: Inner) -> Closure:
    return Closure(None, (Term((node.inputs["Color"], scope), (node.inputs["Strength"], scope)),))


def _background(b: Builder, node: Any, scope: Scope, inner: Inner) -> Closure:
    if b.scatters:
        b.report("shader BACKGROUND", node, "Background in a surface is black, as in Cycles")
        return NOTHING
    return _emission(b, node, scope, inner)


def _holdout(b: Builder, node: Any, scope: Scope, inner: Inner) -> Closure:
    return Closure(b.material("holdout", []))


# Shaders that are one material: its type, and (socket, parameter, kind) of each.
Parameters = tuple[tuple[str, str, str], ...]
_COLOR = ("Color", "color", "spectrum")
_PLAIN: dict[str, tuple[str, Parameters]] = {
    "BSDF_DIFFUSE": ("diffuse_bsdf", (_COLOR, ("Roughness", "roughness", "float"))),
    "BSDF_GLOSSY": ("glossy_bsdf", (_COLOR, ("Roughness", "roughness", "float"), ("Anisotropy", "anisotropy", "float"), ("Rotation", "rotation", "float"))),
    "BSDF_ANISOTROPIC": ("glossy_bsdf", (_COLOR, ("Roughness", "roughness", "float"), ("Anisotropy", "anisotropy", "float"), ("Rotation", "rotation", "float"))),
    "BSDF_GLASS": ("glass_bsdf", (_COLOR, ("Roughness", "roughness", "float"), ("IOR", "ior", "float"))),
    "BSDF_REFRACTION": ("refraction_bsdf", (_COLOR, ("Roughness", "roughness", "float"), ("IOR", "ior", "float"))),
    "BSDF_TRANSLUCENT": ("translucent_bsdf", (_COLOR,)),
    "BSDF_TRANSPARENT": ("transparent_bsdf", (_COLOR,)),
    "BSDF_VELVET": ("velvet_bsdf", (_COLOR, ("Sigma", "sigma", "float"))),
    "BSDF_TOON": ("toon_bsdf", (_COLOR, ("Size", "size", "float"), ("Smooth", "smooth", "float"))),
    "BSDF_HAIR": ("hair_bsdf", (_COLOR, ("Offset", "offset", "float"), ("RoughnessU", "roughness_u", "float"), ("RoughnessV", "roughness_v", "float"))),
    "SUBSURFACE_SCATTERING": ("subsurface_bsdf", (_COLOR, ("Scale", "scale", "float"), ("Radius", "radius", "spectrum"), ("IOR", "ior", "float"),
                                                  ("Roughness", "roughness", "float"), ("Anisotropy", "anisotropy", "float")))}
_DISTRIBUTIONS = {"BSDF_GLOSSY", "BSDF_ANISOTROPIC", "BSDF_GLASS", "BSDF_REFRACTION"}


def _plain(b: Builder, node: Any, scope: Scope, inner: Inner) -> Closure:
    type_, table = _PLAIN[node.type]
    if type_ == "subsurface_bsdf" and (b.is_flat(node.inputs["Radius"], scope) or b.constant(node, scope, "Scale") == 0):
        type_, table = "diffuse_bsdf", (_COLOR,)
    parameters = []
    for socket_name, name, kind in table:
        socket = node.inputs.get(socket_name)
        if socket is not None and socket.enabled:
            parameters.append(b.parameter(name, kind, socket, scope, bounded=name == "color" and type_ != "transparent_bsdf"))
    if node.type in _DISTRIBUTIONS:
        parameters.append(f'"string distribution" "{node.distribution.lower()}"')
    if node.type in ("BSDF_TOON", "BSDF_HAIR"):
        parameters.append(f'"string component" "{node.component.lower()}"')
    if type_ == "subsurface_bsdf" and node.falloff == "BURLEY":
        b.report("subsurface", node, "Christensen-Burley subsurface scattering is drawn as random walk")
    if node.type not in ("BSDF_TRANSPARENT", "BSDF_HAIR"):
        parameters += normals.normal_parameters(b, node.inputs.get("Normal"), scope)
    socket = node.inputs.get("Tangent")
    if type_ == "glossy_bsdf" and socket is not None and b.constant(node, scope, "Anisotropy") != 0.0:
        parameters += tangents.tangent_parameters(b, socket, scope)
    return Closure(b.material(type_, parameters))


def _sheen(b: Builder, node: Any, scope: Scope, inner: Inner) -> Closure:
    b.report("shader BSDF_SHEEN", node, "Sheen of Blender 4 is drawn as Velvet of the same colour and roughness")
    parameters = [b.parameter("color", "spectrum", node.inputs["Color"], scope, bounded=True), b.parameter("sigma", "float", node.inputs["Roughness"], scope)]
    return Closure(b.material("velvet_bsdf", parameters + normals.normal_parameters(b, node.inputs.get("Normal"), scope)))


def _hair_color_absorption(color: tuple[float, ...], roughness: float) -> list[float]:
    """Absorption that gives hair of a colour (Chiang et al. 2016, equation 9)."""
    r = roughness
    width = 5.969 - 0.215 * r + 2.532 * r ** 2 - 10.73 * r ** 3 + 5.574 * r ** 4 + 0.245 * r ** 5
    return [(math.log(max(c, 1e-5)) / width) ** 2 for c in color[:3]]


def _principled_hair(b: Builder, node: Any, scope: Scope, inner: Inner) -> Closure:
    def get(name: str) -> Any:
        return node.inputs[name]

    parameters = []
    if node.parametrization == "COLOR":
        parameters.append(b.parameter("color", "spectrum", get("Color"), scope, bounded=True))
    elif node.parametrization == "ABSORPTION":
        parameters.append(b.parameter("sigma_a", "spectrum", get("Absorption Coefficient"), scope))
    else:
        found = [b.value(get(name), scope)[1] for name in ("Melanin", "Melanin Redness", "Tint", "Radial Roughness")]
        if not all(is_constant(v) for v in found):
            b.report("melanin", node, "melanin, redness and tint that vary are not supported; the values of the sockets are taken")
            found = [as_number(get(n).default_value) for n in ("Melanin", "Melanin Redness")] + [tuple(get("Tint").default_value), get("Radial Roughness").default_value]
        quantity = -math.log(max(1 - as_number(found[0]), 1e-4))
        red = as_number(found[1])
        tint = _hair_color_absorption(as_triple(found[2]), as_number(found[3]))
        # Absorption of eumelanin and of pheomelanin.
        sigma = [quantity * ((1 - red) * e + red * p) + t for e, p, t in zip((0.506, 0.841, 1.653), (0.343, 0.733, 1.924), tint)]
        parameters.append(f'"rgb sigma_a" [{" ".join(number_text(x) for x in sigma)}]')
    for socket, name in (("Roughness", "roughness"), ("Radial Roughness", "radial_roughness"), ("Coat", "coat"), ("IOR", "ior"), ("Offset", "offset")):
        parameters.append(b.parameter(name, "float", get(socket), scope))
    for name in ("Random Color", "Random Roughness"):
        socket = node.inputs.get(name)
        if socket is not None and socket.enabled and b.constant(node, scope, name) != 0:
            b.report("hair random", node, f"{name} is not supported; all strands are alike")
    return Closure(b.material("principled_hair_bsdf", parameters))


SHADERS: dict[str, Callable[[Builder, Any, Scope, Inner], Closure]] = {
    **{name: _plain for name in _PLAIN}, "MIX_SHADER": _mix, "ADD_SHADER": _add, "EMISSION": _emission, "BACKGROUND": _background,
    "HOLDOUT": _holdout, "BSDF_SHEEN": _sheen, "BSDF_HAIR_PRINCIPLED": _principled_hair}
