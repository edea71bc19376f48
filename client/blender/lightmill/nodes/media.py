"""Volume shaders as media: constant coefficients, times the density of a volume's grid."""
from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

from . import spectrum
from .context import digest, number_text
from .fold import as_number, as_triple
from .graph import is_constant
from .shaders import Builder
from .tree import Scope, Source, translate_in_order

Color = tuple[float, float, float]
# Media shine by what they absorb. What only shines absorbs this little, per metre.
LEAST_ABSORPTION = 1e-4
MOST_COEFFICIENT = 1e6


@dataclass(frozen=True)
class Grid:
    """An OpenVDB file of a volume object."""

    file: str  # relative to the export's folder
    names: tuple[str, ...] = ("density",)  # of its grids


@dataclass(frozen=True)
class Medium:
    name: str
    lines: tuple[str, ...]


@dataclass(frozen=True)
class Coefficients:
    """Of a volume, per metre; `forward` is the mean cosine times the grey of `scatter`."""

    scatter: Color = (0.0, 0.0, 0.0)
    absorb: Color = (0.0, 0.0, 0.0)
    emit: Color = (0.0, 0.0, 0.0)  # W / (m3 sr)
    forward: float = 0.0

    def scaled(self, k: float) -> "Coefficients":
        times = lambda c: tuple(x * k for x in c)  # noqa: E731
        return Coefficients(times(self.scatter), times(self.absorb), times(self.emit), self.forward * k)

    def plus(self, other: "Coefficients") -> "Coefficients":
        add = lambda a, b: tuple(x + y for x, y in zip(a, b))  # noqa: E731
        return Coefficients(add(self.scatter, other.scatter), add(self.absorb, other.absorb), add(self.emit, other.emit), self.forward + other.forward)


NONE = Coefficients()


class _Reader:
    """Reads a volume tree twice if there is a grid: where its attributes are 0, and where they are 1."""

    def __init__(self, b: Builder, grid: Grid | None, attribute: float) -> None:
        self.b, self.grid, self.attribute = b, grid, attribute

    def value(self, node: Any, scope: Scope, name: str) -> Any:
        socket = node.inputs.get(name)
        if socket is None:
            return 0.0
        graph = self.b.graph()
        graph.grid_value = self.attribute
        value = graph.value(socket, scope)
        self.b.took(graph)
        if not is_constant(value):
            self.b.report("volume texture", node, f"a volume's {name} that varies is not supported; the value of the socket is taken")
            value = socket.default_value if socket.type == "VALUE" else tuple(socket.default_value)
        return value

    def number(self, node: Any, scope: Scope, name: str) -> float:
        return as_number(self.value(node, scope, name))

    def color(self, node: Any, scope: Scope, name: str) -> Color:
        return as_triple(self.value(node, scope, name))

    def read(self, source: Source) -> Coefficients:
        done: dict[Any, Coefficients] = {}
        translate_in_order(source, done, _key, _inputs, lambda s: self._node(s, done), self._cut)
        return done[_key(source)]

    def _cut(self, source: Source) -> Coefficients:
        self.b.report("cycle", source.node, "the volume feeds itself; it is cut here")
        return NONE

    def _node(self, source: Source, done: dict[Any, Coefficients]) -> Coefficients:
        node, scope = source.node, source.scope
        if node.type in ("MIX_SHADER", "ADD_SHADER"):
            inner = [scope.source(s) for s in node.inputs if s.type == "SHADER"]
            a, b = (done[_key(s)] if s.linked else NONE for s in inner[:2])
            if node.type == "ADD_SHADER":
                return a.plus(b)
            fac = min(max(self.number(node, scope, "Fac"), 0.0), 1.0)
            return a.scaled(1 - fac).plus(b.scaled(fac))
        if node.type == "VOLUME_SCATTER":
            density, color = max(self.number(node, scope, "Density"), 0.0), self.color(node, scope, "Color")
            return _scattering(tuple(max(c, 0.0) * density for c in color), self.number(node, scope, "Anisotropy"))
        if node.type == "VOLUME_ABSORPTION":
            density, color = max(self.number(node, scope, "Density"), 0.0), self.color(node, scope, "Color")
            return Coefficients(absorb=tuple(max(1 - c, 0.0) * density for c in color))
        if node.type == "PRINCIPLED_VOLUME":
            return self._principled(node, scope)
        if node.type == "EMISSION":
            strength, color = self.number(node, scope, "Strength"), self.color(node, scope, "Color")
            return Coefficients(emit=tuple(max(c * strength, 0.0) for c in color))
        self.b.report(f"volume {node.type}", node, f"{node.bl_rna.name} in a volume is not supported; it is empty")
        return NONE

    def _principled(self, node: Any, scope: Scope) -> Coefficients:
        density = max(self.number(node, scope, "Density"), 0.0)
        name = node.inputs["Density Attribute"].default_value
        if name and self.grid is not None and name in self.grid.names:
            density *= self.attribute
        if node.inputs["Color Attribute"].default_value:
            self.b.report("color attribute", node, "the grid of the Color Attribute is not looked at")
        color, absorption = self.color(node, scope, "Color"), self.color(node, scope, "Absorption Color")
        scatter = tuple(max(c, 0.0) * density for c in color)
        absorb = tuple(max(1 - c, 0.0) * max(1 - math.sqrt(max(a, 0.0)), 0.0) * density for c, a in zip(color, absorption))
        strength = max(self.number(node, scope, "Emission Strength"), 0.0)
        emit = tuple(max(c, 0.0) * strength for c in self.color(node, scope, "Emission Color"))
        heat = self.number(node, scope, "Blackbody Intensity")
        if heat > 1e-3:
            kelvin = max(self.number(node, scope, "Temperature"), 0.0)
            if node.inputs["Temperature Attribute"].default_value and self.grid is not None:
                self.b.report("temperature", node, "the grid of the Temperature Attribute is not looked at; the temperature is that of the socket")
            # Stefan and Boltzmann's law, scaled as Cycles does.
            power = 5.670373e-8 * 1e-6 / math.pi * (1 + (kelvin ** 4 - 1) * min(heat, 1.0))
            if power > 0:
                tint = self.color(node, scope, "Blackbody Tint")
                emit = tuple(e + power * c * t for e, c, t in zip(emit, spectrum.blackbody(kelvin), tint))
        scattering = _scattering(scatter, self.number(node, scope, "Anisotropy"))
        return scattering.plus(Coefficients(absorb=absorb, emit=emit))


def _scattering(scatter: Color, cosine: float) -> Coefficients:
    return Coefficients(scatter=scatter, forward=min(max(cosine, -0.999), 0.999) * sum(scatter) / 3)


def _key(source: Source) -> Any:
    return source.node.as_pointer(), id(source.scope), source.socket.identifier


def _inputs(source: Source) -> list[Source]:
    return [s for s in (source.scope.source(i) for i in source.node.inputs if i.type == "SHADER") if s.linked]


def medium_of_tree(b: Builder, socket: Any, scope: Scope, grid: Grid | None = None) -> Medium | None:
    """The medium of a Volume socket; None if there is none or it is empty."""
    source = scope.source(socket)
    if not source.linked:
        return None
    full = _Reader(b, grid, 1.0).read(source)
    if grid is not None:
        empty = _Reader(b, grid, 0.0).read(source)
        if any(empty.scatter) or any(empty.absorb):
            b.report("volume", source.node, "a volume that is dense where its grid is 0 is not supported; it is empty there")
        if any(full.emit):
            b.report("volume emission", source.node, "emission of a volume with a grid is not supported; it is dark")
            full = Coefficients(full.scatter, full.absorb, forward=full.forward)
    return _medium(b, full, grid)


def _rgb(name: str, c: Color) -> str:
    return f'"rgb {name}" [{" ".join(number_text(min(x, MOST_COEFFICIENT)) for x in c)}]'


def _medium(b: Builder, c: Coefficients, grid: Grid | None) -> Medium | None:
    if not any(c.scatter) and not any(c.absorb) and not any(c.emit):
        return None
    absorb = tuple(max(a, LEAST_ABSORPTION) if e > 0 else a for a, e in zip(c.absorb, c.emit))
    cosine = c.forward / (sum(c.scatter) / 3) if any(c.scatter) else 0.0
    parameters = [_rgb("sigma_s", c.scatter), _rgb("sigma_a", absorb), f'"float g" {number_text(cosine)}']
    if any(c.emit):
        parameters.append(_rgb("Le", tuple(e / a if a else 0.0 for e, a in zip(c.emit, absorb))))
    if grid is None:
        body = " ".join(['"string type" "homogeneous"', *parameters])
        name = f"v_{digest(body)[:32]}"
        return Medium(name, (f'MakeNamedMedium "{name}" {body}',))
    which = "density" if "density" in grid.names else grid.names[0]
    body = " ".join(['"string type" "vdb"', f'"string filename" "{grid.file}" "string gridname" "{which}"', *parameters])
    columns = " ".join(number_text(b.place.matrix_world[row][column]) for column in range(4) for row in range(4))
    name = f"v_{digest(body + columns)[:32]}"
    return Medium(name, (f'AttributeBegin\nTransform [{columns}]\nMakeNamedMedium "{name}" {body}\nAttributeEnd',))
