"""The light that a tree emits: one graph, the sum over its shaders of colour x strength x factors."""
from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from .fold import as_triple
from .graph import Graph, Value, is_constant
from .shaders import Builder, Term
from .tree import Source

# Kinds of rays as the contract names them, by what Light Path says of a ray.
RAY_KINDS = {"Is Camera Ray": "camera", "Is Diffuse Ray": "diffuse", "Is Glossy Ray": "glossy", "Is Transmission Ray": "transmission",
             "Is Volume Scatter Ray": "volume_scatter"}
ALL_KINDS = ("camera", "diffuse", "glossy", "transmission", "volume_scatter")


@dataclass(frozen=True)
class Emission:
    """What follows `AreaLightSource "diffuse"`. `lines` go before it."""

    parameters: str
    lines: tuple[str, ...]
    two_sided: bool
    hidden: tuple[str, ...]  # kinds of rays that do not see the light, but the surface


def _factor_source(socket: Any, scope: Any) -> Source | None:
    source = scope.source(socket)
    return source if source.linked else None


def _tricks(b: Builder, term: Term) -> tuple[Term, str, frozenset[str]]:
    """Takes factors away that say on which side, and for which rays, light shines."""
    side, hidden, factors = "both", frozenset(), []
    for socket, scope, rest in term.factors:
        source = _factor_source(socket, scope)
        if source is not None and source.node.type == "NEW_GEOMETRY" and source.socket.identifier == "Backfacing":
            side = "front" if rest else "back"
        elif source is not None and source.node.type == "LIGHT_PATH" and source.socket.identifier in RAY_KINDS:
            kind = RAY_KINDS[source.socket.identifier]
            hidden |= frozenset([kind]) if rest else frozenset(ALL_KINDS) - {kind}
        else:
            factors.append((socket, scope, rest))
    return Term(term.color, term.strength, tuple(factors)), side, hidden


def sum_of(b: Builder, graph: Graph, terms: tuple[Term, ...]) -> Value:
    """Radiance in W / (m2 sr)."""
    total: Value = 0.0
    for term in terms:
        value = graph.value_of(term.color[0]) if isinstance(term.color[0], Source) else graph.value(*term.color)
        if term.strength is not None:
            value = graph.product(value, graph.number(graph.value(*term.strength)))
        for socket, scope, rest in term.factors:
            factor = graph.clamped(graph.number(graph.value(socket, scope)))
            value = graph.product(value, graph.math("SUBTRACT", 1.0, factor) if rest else factor)
        total = graph.sum(total, value)
    b.took(graph)
    return total


def emission(b: Builder, terms: tuple[Term, ...]) -> Emission | None:
    """None if nothing is emitted."""
    if not terms:
        return None
    found = [_tricks(b, t) for t in terms]
    sides, hiddens = {f[1] for f in found}, {f[2] for f in found}
    if len(sides) > 1 or "back" in sides:
        b.report("emission side", None, "emission of one side alone is supported for the front, and for all shaders of a material alike; both sides shine")
        sides = {"both"}
    if len(hiddens) > 1:
        b.report("emission rays", None, "shaders of one material that emit for different kinds of rays are not supported; all rays see them")
        hiddens = {frozenset()}
    graph = b.graph()
    value = sum_of(b, graph, tuple(f[0] for f in found))
    lines: list[str] = []
    if is_constant(value):
        rgb = as_triple(value)
        if min(rgb) < 0:
            b.report("negative emission", None, "negative emission is not supported; it is 0 there")
            rgb = tuple(max(c, 0.0) for c in rgb)
        if not any(rgb):
            return None
        value = rgb
    two_sided, hidden = sides == {"both"}, tuple(k for k in ALL_KINDS if k in next(iter(hiddens)))
    if len(hidden) == len(ALL_KINDS):
        return None
    parameters = [b.context.parameter("L", "spectrum", graph, value, lines), f'"bool twosided" {"true" if two_sided else "false"}']
    return Emission(" ".join(parameters), tuple(lines), two_sided, hidden)
