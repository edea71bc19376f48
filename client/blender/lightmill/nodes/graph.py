"""A texture graph under construction (docs/texture-graph.md), from sockets of Blender's trees."""
from __future__ import annotations

import json
import math
from dataclasses import dataclass
from typing import Any

from . import fold
from .place import Place
from .tree import Scope, Source, translate_in_order

MOST_NODES = 1024


@dataclass(frozen=True)
class Ref:
    """An output of a node of the graph."""

    node: str
    output: str
    kind: str  # "number", "vector" or "color"

    def json(self) -> list[str]:
        return [self.node, self.output]


# A constant is a float, a vector of 3 or a colour of 4 (see fold.py).
Value = Any

_KINDS = {"VALUE": "number", "INT": "number", "BOOLEAN": "number", "VECTOR": "vector", "RGBA": "color"}


def kind_of_socket(socket: Any) -> str:
    return _KINDS.get(socket.type, "number")


def is_constant(value: Value) -> bool:
    return not isinstance(value, Ref)


def constant_of_socket(socket: Any) -> Value:
    """The value that an unlinked input has; what is not finite is 0."""
    if socket is None or socket.type not in _KINDS:
        return 0.0
    value = socket.default_value
    if _KINDS[socket.type] == "number":
        return float(value) if math.isfinite(value) else 0.0
    parts = tuple(float(x) if math.isfinite(x) else 0.0 for x in value)
    return parts[:3] if socket.type == "VECTOR" else parts


class Graph:
    """Nodes of one file. `context` and `place` answer what nodes ask of the scene and of the object."""

    def __init__(self, context: Any, place: Place, owner: str) -> None:
        self.context, self.place, self.owner = context, place, owner
        self.nodes: list[dict[str, Any]] = []
        self.uses: set[str] = set()  # "object", "generated", "camera", "instance", "mesh"
        self.material_index = 0
        self.grid_value: float | None = None  # what attributes of a volume's grids have, while one is read
        self._values: dict[Any, Value] = {}
        self._shared: dict[str, Ref] = {}

    # Making nodes.

    def add(self, type_: str, output: str, kind: str, inputs: dict[str, Value] | None = None, **parameters: Any) -> Value:
        """The output of a new node, or of an equal one that is there; a constant if all inputs are and it folds."""
        inputs = inputs or {}
        node: dict[str, Any] = {"type": type_, **parameters}
        if inputs and all(is_constant(v) for v in inputs.values()):
            values = fold.folded(node, inputs)
            if values is not None and output in values:
                return values[output]
        if inputs:
            node["inputs"] = {k: v.json() if isinstance(v, Ref) else list(v) if isinstance(v, tuple) else v for k, v in inputs.items()}
        key = json.dumps(node, sort_keys=True)
        if key not in self._shared:
            if len(self.nodes) >= MOST_NODES:
                self.report("nodes", "", f"a texture has more than {MOST_NODES} nodes; the rest is 0")
                return 0.0
            name = f"n{len(self.nodes)}"
            self.nodes.append({"name": name, **node})
            self._shared[key] = Ref(name, output, kind)
        return Ref(self._shared[key].node, output, kind)

    def math(self, operation: str, a: Value, b: Value = 0.0, c: Value | None = None) -> Value:
        inputs = {"Value": a, "Value_001": b}
        if c is not None:
            inputs["Value_002"] = c
        return self.add("MATH", "Value", "number", inputs, operation=operation)

    def vector_math(self, operation: str, a: Value, b: Value) -> Value:
        return self.add("VECT_MATH", "Vector", "vector", {"Vector": a, "Vector_001": b}, operation=operation)

    def product(self, a: Value, b: Value) -> Value:
        """Of colours or numbers, part by part."""
        for x, y in ((a, b), (b, a)):
            if is_constant(x) and fold.as_triple(x) == (1.0, 1.0, 1.0):
                return y
            if is_constant(x) and fold.as_triple(x) == (0.0, 0.0, 0.0):
                return 0.0
        if self.kind(a) == self.kind(b) == "number":
            return self.math("MULTIPLY", a, b)
        return self.vector_math("MULTIPLY", self.triple(a), self.triple(b))

    def sum(self, a: Value, b: Value) -> Value:
        if is_constant(a) and fold.as_triple(a) == (0.0, 0.0, 0.0):
            return b
        if is_constant(b) and fold.as_triple(b) == (0.0, 0.0, 0.0):
            return a
        return self.vector_math("ADD", self.triple(a), self.triple(b))

    def add_numbers(self, a: Value, b: Value) -> Value:
        if is_constant(a) and a == 0:
            return b
        return a if is_constant(b) and b == 0 else self.math("ADD", a, b)

    def clamped(self, a: Value) -> Value:
        if is_constant(a):
            return min(max(fold.as_number(a), 0.0), 1.0)
        return self.add("CLAMP", "Result", "number", {"Value": a})

    def number(self, value: Value) -> Value:
        """As a socket of numbers takes it."""
        if is_constant(value):
            return fold.as_number(value)
        if value.kind == "color":
            return self.add("RGBTOBW", "Val", "number", {"Color": value})
        return self.math("ADD", value, 0.0) if value.kind == "vector" else value

    @staticmethod
    def triple(value: Value) -> Value:
        return fold.as_triple(value) if is_constant(value) else value

    @staticmethod
    def kind(value: Value) -> str:
        if isinstance(value, Ref):
            return value.kind
        return {3: "vector", 4: "color"}[len(value)] if isinstance(value, tuple) else "number"

    def transformed(self, point: Value, matrix: Any, *, translate: bool = True) -> Value:
        """A point (or a direction) times a 4 x 4 matrix."""
        parts = {name: self.row_times(matrix[axis], point, translate) for axis, name in enumerate("XYZ")}
        return self.add("COMBXYZ", "Vector", "vector", parts)

    def row_times(self, row: Any, point: Value, translate: bool = True) -> Value:
        """A row of a 4 x 4 matrix times a point."""
        dot = self.add("VECT_MATH", "Value", "number", {"Vector": self.triple(point), "Vector_001": tuple(row[:3])}, operation="DOT_PRODUCT")
        return self.math("ADD", dot, float(row[3])) if translate and row[3] else dot

    # Following Blender's trees.

    def value(self, socket: Any, scope: Scope) -> Value:
        """What an input socket has."""
        return self.value_of(scope.source(socket))

    def value_of(self, source: Source) -> Value:
        if source.linked:
            from .textures import inputs_of, output_of

            translate_in_order(source, self._values, self._key, lambda s: inputs_of(s.node, s.scope),
                               lambda s: output_of(self, s), self._cut)
        return self._converted(source)

    def is_linked(self, socket: Any, scope: Scope) -> bool:
        return scope.source(socket).linked

    def report(self, kind: str, node: str, text: str, lasting: bool = False) -> None:
        self.context.report.add(kind, self.owner, node, text, lasting)

    @staticmethod
    def _key(source: Source) -> Any:
        return source.node.as_pointer(), id(source.scope), source.socket.identifier

    def _cut(self, source: Source) -> Value:
        self.report("cycle", source.node.name, "the node feeds itself; it is cut here and gives 0")
        return 0.0

    def _converted(self, source: Source) -> Value:
        value = self._values[self._key(source)] if source.linked else constant_of_socket(source.socket)
        for type_ in reversed(source.through):
            if _KINDS.get(type_) == "number" and self.kind(value) != "number":
                value = self.number(value)
        return value

    # The file.

    def document(self, output: Ref) -> str:
        """The JSON text; nodes that the output does not need are left out."""
        wanted, kept = {output.node}, []
        for node in reversed(self.nodes):
            if node["name"] in wanted:
                kept.append(node)
                wanted.update(v[0] for v in node.get("inputs", {}).values() if isinstance(v, list) and len(v) == 2)
        names = {node["name"]: f"n{i}" for i, node in enumerate(reversed(kept))}

        def renamed(v: Any) -> Any:
            return [names[v[0]], v[1]] if isinstance(v, list) and len(v) == 2 else v

        nodes = []
        for node in reversed(kept):
            node = {**node, "name": names[node["name"]]}
            if "inputs" in node:
                node["inputs"] = {k: renamed(v) for k, v in node["inputs"].items()}
            nodes.append(node)
        document: dict[str, Any] = {"texture_graph": 1, "nodes": nodes, "output": [names[output.node], output.output]}
        spaces = self._spaces()
        if spaces:
            document["spaces"] = spaces
        return json.dumps(document, ensure_ascii=False, allow_nan=False)

    def _spaces(self) -> dict[str, list[float]]:
        spaces = {}
        to_object = self.place.matrix_world.inverted_safe()
        if "object" in self.uses:
            spaces["object"] = to_object
        if "generated" in self.uses:
            spaces["generated"] = self.place.generated @ to_object
        if "camera" in self.uses:
            spaces["camera"] = self.context.to_camera()
        return {name: [float(x) for row in matrix for x in row] for name, matrix in spaces.items()}
