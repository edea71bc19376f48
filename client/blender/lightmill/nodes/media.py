"""Volume shaders as media: coefficients that are constant, times the density of a volume's grid, or over a grid of textures."""
from __future__ import annotations

import contextlib
import math
from dataclasses import dataclass
from typing import Any

import numpy
from mathutils import Vector

from . import spectrum
from ..light_groups import parameter
from .context import digest, number_text
from .drawn import volume_texture
from .drawn.volume_texture import Input
from .fold import as_number, as_triple
from .graph import is_constant
from .place import Place
from .shaders import Builder
from .tree import Scope, Source, translate_in_order

# Media shine where light would be scattered or absorbed. What only shines absorbs this part of what crosses its box, which
# makes little noise and is hardly seen; or, without a box or with fog, this little per metre.
THIN = 0.02
LEAST_ABSORPTION = 1e-4
MOST_COEFFICIENT = 1e6
# pbrt's "rgbgrid" shows Le this many times: the integral of the colour matching function of luminance.
GRID_LE = 106.856895


@dataclass(frozen=True)
class Grid:
    """An OpenVDB file of a volume object."""

    file: str  # relative to the export's folder
    names: tuple[str, ...] = ("density",)  # of its grids


@dataclass(frozen=True)
class Medium:
    name: str
    lines: tuple[str, ...]
    is_opaque: bool = False  # over a long way: no light of any colour gets through


@dataclass(frozen=True)
class Coefficients:
    """Of a volume, per metre: arrays [cells, 3], of one cell if the volume is the same everywhere. `forward` is the mean cosine
    times the grey of `scatter`."""

    scatter: Any = 0.0
    absorb: Any = 0.0
    emit: Any = 0.0  # W / (m3 sr)
    forward: Any = 0.0

    def scaled(self, k: Any) -> "Coefficients":
        return Coefficients(self.scatter * k, self.absorb * k, self.emit * k, self.forward * k)

    def plus(self, other: "Coefficients") -> "Coefficients":
        return Coefficients(self.scatter + other.scatter, self.absorb + other.absorb, self.emit + other.emit, self.forward + other.forward)


NONE = Coefficients()


class _Reader:
    """Reads a volume tree, more than once: with a grid, where its attributes are 0 and where they are 1; with textures, to find
    them and then with their values."""

    def __init__(self, b: Builder, grid: Grid | None, attribute: float, textures: dict[Input, Any] | None = None) -> None:
        """`textures` gets the inputs that vary (None: they are reported), and gives their values where it has them."""
        self.b, self.grid, self.attribute, self.textures = b, grid, attribute, textures

    def value(self, node: Any, scope: Scope, name: str) -> Any:
        """A number or a colour, or an array [cells, 3]."""
        socket = node.inputs.get(name)
        if socket is None:
            return 0.0
        graph = self.b.graph()
        graph.grid_value = self.attribute
        with self.b.context.report.paused() if self.textures is not None else contextlib.nullcontext():
            value = graph.value(socket, scope)
        self.b.took(graph)
        if is_constant(value):
            return value
        if self.textures is not None:
            found = self.textures.setdefault((_path(scope), node.name, socket.identifier), None)
            if found is not None:
                return found
        else:
            self.b.report("volume texture", node, f"{self.where()} can't have a {name} that varies; the value of the socket is taken")
        return socket.default_value if socket.type == "VALUE" else tuple(socket.default_value)

    def where(self) -> str:
        return "a volume with a grid" if self.grid is not None else "the world's volume"

    def number(self, node: Any, scope: Scope, name: str) -> Any:
        """An array [cells, 1]."""
        value = self.value(node, scope, name)
        return value[:, :1] if isinstance(value, numpy.ndarray) else numpy.array([[as_number(value)]])

    def color(self, node: Any, scope: Scope, name: str) -> Any:
        """An array [cells, 3]."""
        value = self.value(node, scope, name)
        return value if isinstance(value, numpy.ndarray) else numpy.array([as_triple(value)], float)

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
            fac = numpy.clip(self.number(node, scope, "Fac"), 0.0, 1.0)
            return a.scaled(1 - fac).plus(b.scaled(fac))
        if node.type == "VOLUME_SCATTER":
            scatter = _positive(self.number(node, scope, "Density")) * _positive(self.color(node, scope, "Color"))
            return _scattering(scatter, self.number(node, scope, "Anisotropy"))
        if node.type == "VOLUME_ABSORPTION":
            return Coefficients(absorb=_positive(self.number(node, scope, "Density")) * _positive(1 - self.color(node, scope, "Color")))
        if node.type == "PRINCIPLED_VOLUME":
            return self._principled(node, scope)
        if node.type == "EMISSION":
            return Coefficients(emit=_positive(self.number(node, scope, "Strength") * self.color(node, scope, "Color")))
        self.b.report(f"volume {node.type}", node, f"{node.bl_rna.name} in a volume is not supported; it is empty")
        return NONE

    def _principled(self, node: Any, scope: Scope) -> Coefficients:
        density = _positive(self.number(node, scope, "Density"))
        name = node.inputs["Density Attribute"].default_value
        if name and self.grid is not None and name in self.grid.names:
            density = density * self.attribute
        if node.inputs["Color Attribute"].default_value:
            self.b.report("color attribute", node, "the grid of the Color Attribute is not looked at")
        color, absorption = self.color(node, scope, "Color"), self.color(node, scope, "Absorption Color")
        absorb = _positive(1 - color) * _positive(1 - numpy.sqrt(_positive(absorption))) * density
        emit = _positive(self.number(node, scope, "Emission Strength")) * _positive(self.color(node, scope, "Emission Color"))
        heat = self.number(node, scope, "Blackbody Intensity")
        if heat.max() > 1e-3:
            kelvin = _positive(self.number(node, scope, "Temperature"))
            if node.inputs["Temperature Attribute"].default_value and self.grid is not None:
                self.b.report("temperature", node, "the grid of the Temperature Attribute is not looked at; the temperature is that of the socket")
            # Stefan and Boltzmann's law, scaled as Cycles does.
            power = 5.670373e-8 * 1e-6 / math.pi * (1 + (kelvin ** 4 - 1) * numpy.clip(heat, 0.0, 1.0))
            shades = numpy.array([spectrum.blackbody(float(k)) for k in kelvin[:, 0]])
            emit = emit + numpy.where(heat > 1e-3, power, 0.0) * shades * self.color(node, scope, "Blackbody Tint")
        scattering = _scattering(_positive(color) * density, self.number(node, scope, "Anisotropy"))
        return scattering.plus(Coefficients(absorb=absorb, emit=emit))


def _positive(values: Any) -> Any:
    return numpy.maximum(values, 0.0)


def _scattering(scatter: Any, cosine: Any) -> Coefficients:
    return Coefficients(scatter=scatter, forward=numpy.clip(cosine, -0.999, 0.999) * scatter.mean(axis=1, keepdims=True))


def _path(scope: Scope) -> tuple[str, ...]:
    """Names of the group nodes that lead to a scope."""
    names: list[str] = []
    while scope.group is not None:
        names.insert(0, scope.group.name)
        scope = scope.parent
    return tuple(names)


def _key(source: Source) -> Any:
    return source.node.as_pointer(), id(source.scope), source.socket.identifier


def _inputs(source: Source) -> list[Source]:
    return [s for s in (source.scope.source(i) for i in source.node.inputs if i.type == "SHADER") if s.linked]


def medium_of_tree(b: Builder, socket: Any, scope: Scope, grid: Grid | None = None, material: Any = None) -> Medium | None:
    """The medium of a Volume socket; None if there is none or it is empty. `material` is that of the tree, where its textures
    can be looked up: not of a world."""
    source = scope.source(socket)
    if not source.linked:
        return None
    if grid is None and material is not None and b.place.box is not None:
        textures: dict[Input, Any] = {}
        full = _Reader(b, None, 1.0, textures).read(source)
        if textures:
            full = _with_textures(b, source, material, textures) or full
    else:
        full = _Reader(b, grid, 1.0).read(source)
    if material is None and grid is None:
        b.context.fog = full
    elif grid is None and b.context.fog is not None:
        full = full.plus(b.context.fog)  # volumes of Cycles add up
    if grid is not None:
        empty = _Reader(b, grid, 0.0).read(source)
        if numpy.any(empty.scatter) or numpy.any(empty.absorb):
            b.report("volume", source.node, "a volume that is dense where its grid is 0 is not supported; it is empty there")
        if numpy.any(full.emit):
            b.report("volume emission", source.node, "emission of a volume with a grid is not supported; it is dark")
            full = Coefficients(full.scatter, full.absorb, forward=full.forward)
    return _medium(b, full, grid)


def _with_textures(b: Builder, source: Source, material: Any, textures: dict[Input, Any]) -> Coefficients | None:
    """The coefficients over the grid of volume_texture.py. None (reported) if the textures can't be looked up."""
    try:
        values = volume_texture.looked_up(material, list(textures), b.context, b.place)
    except volume_texture.FAILURES as error:
        b.report("volume texture", source.node, f"the volume's textures could not be looked up; the values of the sockets are taken: {error}")
        return None
    b.uses |= {"object", "generated"}
    return _Reader(b, None, 1.0, dict(zip(textures, values))).read(source)


def _rgb(name: str, c: Any) -> str:
    return f'"rgb {name}" [{" ".join(number_text(x) for x in c)}]'


def _grid_values(type_: str, name: str, values: Any) -> str:
    return f'"{type_} {name}" [{" ".join(f"{x:.5g}" for x in values.ravel().tolist())}]'


def _medium(b: Builder, c: Coefficients, grid: Grid | None) -> Medium | None:
    scatter, absorb, emit = (numpy.minimum(numpy.broadcast_to(x, (max(numpy.shape(x)[:1] or (1,)), 3)), MOST_COEFFICIENT)
                             for x in (c.scatter, c.absorb, c.emit))
    if not scatter.any() and not absorb.any() and not emit.any():
        return None
    is_opaque = bool((scatter + absorb).min() > 0)
    absorb = numpy.where(emit > 0, numpy.maximum(absorb, _least_absorption(b.place, scatter)), absorb)
    grey = scatter.mean()
    cosine = float(numpy.mean(c.forward)) / grey if grey > 0 else 0.0
    g = f'"float g" {number_text(cosine)}'
    group = ""
    if emit.any():
        b.uses.add("light_group")
        group = parameter(b.place.light_group)
    shine = numpy.divide(emit, absorb, out=numpy.zeros(numpy.broadcast(emit, absorb).shape), where=absorb > 0)
    if max(len(scatter), len(absorb), len(shine)) > 1:
        body = _grid_body(b.place, scatter, absorb, shine, g) + group
        return _placed(b.place, body)
    parameters = [_rgb("sigma_s", scatter[0]), _rgb("sigma_a", absorb[0]), g]
    if emit.any():
        parameters.append(_rgb("Le", shine[0]))
    if grid is None:
        body = " ".join(['"string type" "homogeneous"', *parameters]) + group
        name = f"v_{digest(body)[:32]}"
        return Medium(name, (f'MakeNamedMedium "{name}" {body}',), is_opaque)
    which = "density" if "density" in grid.names else grid.names[0]
    return _placed(b.place, " ".join(['"string type" "vdb"', f'"string filename" "{grid.file}" "string gridname" "{which}"', *parameters]))


def _least_absorption(place: Place, scatter: Any) -> Any:
    if place.box is None:
        return LEAST_ABSORPTION
    low, high = place.box
    across = (place.matrix_world.to_3x3() @ Vector([b - a for a, b in zip(low, high)])).length
    return numpy.where(scatter * across > THIN, LEAST_ABSORPTION, THIN / max(across, 1e-6))


def _grid_body(place: Place, scatter: Any, absorb: Any, shine: Any, g: str) -> str:
    """A medium over the grid of volume_texture.py: by a density if it is one colour that is thicker or thinner, else by
    colours."""
    low, high = volume_texture.box_of(place)
    n = volume_texture.SIDE
    box = (f'"integer nx" {n} "integer ny" {n} "integer nz" {n} "point3 p0" [{" ".join(map(number_text, low))}]'
           f' "point3 p1" [{" ".join(map(number_text, high))}]')
    both = numpy.hstack(numpy.broadcast_arrays(scatter, absorb))
    thickest = both[both.sum(axis=1).argmax()]
    density = both.sum(axis=1) / thickest.sum()
    if not shine.any() and numpy.allclose(both, density[:, None] * thickest, atol=1e-4 * thickest.max()):
        return " ".join(['"string type" "uniformgrid"', box, _rgb("sigma_s", thickest[:3]), _rgb("sigma_a", thickest[3:]), g,
                         _grid_values("float", "density", density)])
    cells = n ** 3
    fields = [_grid_values("rgb", name, numpy.broadcast_to(x, (cells, 3))) for name, x in
              (("sigma_s", scatter), ("sigma_a", absorb), ("Le", shine / GRID_LE)) if x.any()]
    return " ".join(['"string type" "rgbgrid"', box, g, *fields])


def _placed(place: Place, body: str) -> Medium:
    """A medium in the object's coordinates, which moves with it."""
    columns = " ".join(number_text(place.matrix_world[row][column]) for column in range(4) for row in range(4))
    placed = place.moving or f"Transform [{columns}]\n"
    name = f"v_{digest(body + placed)[:32]}"
    return Medium(name, (f'AttributeBegin\n{placed}MakeNamedMedium "{name}" {body}\nAttributeEnd',))
