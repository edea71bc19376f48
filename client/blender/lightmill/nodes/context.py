"""What an export has in common: the folder, the scene, and what was written already."""
from __future__ import annotations

import hashlib
import pathlib
from typing import Any

from mathutils import Matrix

from .graph import Graph, Ref, Value, is_constant
from .fold import as_number, as_triple
from .images import ImageFiles
from .report import Report


def number_text(x: float) -> str:
    return f"{x:.9g}"


def digest(text: str) -> str:
    return hashlib.sha256(text.encode("utf-8", "surrogatepass")).hexdigest()


class Context:
    """One export. Not for several threads."""

    def __init__(self, folder: pathlib.Path, scene: Any, depsgraph: Any = None, *, view_layer: Any = None, report: Report | None = None,
                 memory: dict[Any, Any] | None = None) -> None:
        """`memory` lives on between exports: digests of files by path, size and time."""
        self.folder, self.scene, self.depsgraph, self.view_layer = pathlib.Path(folder), scene, depsgraph, view_layer
        self.report = report or Report()
        self.files: set[str] = set()  # names relative to the folder
        self.images = ImageFiles(self.folder, self.files, self.report, memory)
        self.surfaces: dict[Any, Any] = {}  # of surfaces.py, by material and what it uses
        # What Light Path gives where the kind of the ray is known (a world's picture), else None.
        self.light_path: dict[str, float] | None = None
        self.fog: Any = None  # coefficients of the world's volume (media.py), which is inside of volumes, too
        self._to_camera: Matrix | None = None

    @property
    def frame(self) -> int:
        return int(self.scene.frame_current)

    def camera(self) -> Any:
        camera = self.scene.camera
        return camera.evaluated_get(self.depsgraph) if camera and self.depsgraph else camera

    def to_camera(self) -> Matrix:
        """From the world to the camera's coordinates, whose z is the depth."""
        if self._to_camera is None:
            camera = self.camera()
            matrix = camera.matrix_world.normalized().inverted_safe() if camera else Matrix.Identity(4)
            self._to_camera = Matrix.Diagonal((1.0, 1.0, -1.0, 1.0)) @ matrix
        return self._to_camera

    def write(self, folder: str, extension: str, text: str) -> str:
        """Writes a text by its content; gives its name relative to the folder."""
        name = f"{folder}/{digest(text)[:40]}.{extension}"
        path = self.folder / name
        if name not in self.files and not path.exists():
            path.parent.mkdir(parents=True, exist_ok=True)
            path.write_text(text, encoding="utf-8", errors="surrogateescape")
        self.files.add(name)
        return name

    def texture(self, graph: Graph, output: Ref, kind: str, lines: list[str]) -> str:
        """Writes a graph as a texture of `kind` "float" or "spectrum"; gives its name."""
        file = self.write("graphs", "json", graph.document(output))
        name = f"{kind[0]}_{pathlib.PurePosixPath(file).stem}"
        lines.append(f'Texture "{name}" "{kind}" "graph" "string filename" "{file}"')
        return name

    def parameter(self, name: str, kind: str, graph: Graph, value: Value, lines: list[str]) -> str:
        """A pbrt parameter of a constant or of a graph's output."""
        if is_constant(value):
            if kind == "float":
                return f'"float {name}" {number_text(as_number(value))}'
            return f'"rgb {name}" [{" ".join(number_text(x) for x in as_triple(value))}]'
        return f'"texture {name}" "{self.texture(graph, value, kind, lines)}"'
