"""Where a material is used: what nodes may ask of an object or an instance."""
from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

from mathutils import Matrix

from ..light_groups import group_of

# Attributes that the exporter makes where the Geometry node's outputs ask for them.
MADE_ATTRIBUTES = {"Pointiness": ".pointiness", "Random Per Island": ".random_per_island"}


def _generated(data: Any) -> Matrix:
    """From the object's coordinates to generated ones: 0 to 1 over the texture space."""
    if data is None or not hasattr(data, "texspace_location"):
        return Matrix.Identity(4)
    size = [2 * s if abs(s) > 1e-12 else 1.0 for s in data.texspace_size]
    matrix = Matrix.Identity(4)
    for axis in range(3):
        matrix[axis][axis] = 1 / size[axis]
        matrix[axis][3] = 0.5 - data.texspace_location[axis] / size[axis]
    return matrix


def _rotated(x: int, k: int) -> int:
    return (x << k | x >> 32 - k) & 0xFFFFFFFF


def random_of_name(name: str) -> float:
    """What Object Info calls Random of an object that is no instance: Jenkins' hash (lookup3) of a hash of its name."""
    word = 0
    for byte in name.encode("utf-8", "surrogateescape"):
        word = (word * 37 + (byte if byte < 128 else byte - 256)) & 0xFFFFFFFF
    a = b = c = (0xDEADBEEF + (2 << 2) + 13) & 0xFFFFFFFF
    a = (a + word) & 0xFFFFFFFF
    c = ((c ^ b) - _rotated(b, 14)) & 0xFFFFFFFF
    a = ((a ^ c) - _rotated(c, 11)) & 0xFFFFFFFF
    b = ((b ^ a) - _rotated(a, 25)) & 0xFFFFFFFF
    c = ((c ^ b) - _rotated(b, 16)) & 0xFFFFFFFF
    a = ((a ^ c) - _rotated(c, 4)) & 0xFFFFFFFF
    b = ((b ^ a) - _rotated(a, 14)) & 0xFFFFFFFF
    c = ((c ^ b) - _rotated(b, 24)) & 0xFFFFFFFF
    return c / 0xFFFFFFFF


@dataclass
class Place:
    """An object, or one instance of it. Matrices are 4 x 4, of columns, as Blender has them."""

    name: str = ""
    matrix_world: Matrix = field(default_factory=lambda: Matrix.Identity(4))
    generated: Matrix = field(default_factory=lambda: Matrix.Identity(4))  # from object to generated coordinates
    uv_maps: tuple[str, ...] = ()
    attribute: str = ""
    object: Any = None  # whose properties an Attribute node reads
    instancer: Any = None
    color: tuple[float, ...] = (1.0, 1.0, 1.0, 1.0)
    pass_index: int = 0
    random: float = 0.0
    is_strand: bool = False
    moving: str = ""  # directives that place it while it moves; empty: it stands at matrix_world
    box: tuple[tuple[float, ...], tuple[float, ...]] | None = None  # of a mesh, in the object's coordinates
    particle: dict[str, Any] = field(default_factory=dict)  # by the outputs of Particle Info
    light_group: str = ""  # of what shines
    is_lamp: bool = False

    @classmethod
    def of(cls, obj: Any, instance: Any = None, **more: Any) -> "Place":
        """Of an evaluated object, or of a `DepsgraphObjectInstance` of it."""
        place = cls(name=obj.name, matrix_world=(instance or obj).matrix_world.copy(), generated=_generated(obj.data),
                    object=obj, color=tuple(obj.color), pass_index=obj.pass_index, random=random_of_name(obj.name),
                    light_group=group_of(obj, instance.parent if instance is not None else None))
        if instance is not None and instance.is_instance:
            place.random = (instance.random_id & 0xFFFFFFFF) / 0xFFFFFFFF
            place.instancer = instance.parent
        if obj.type == "MESH":
            place.box = tuple(tuple(f(corner[k] for corner in obj.bound_box) for k in range(3)) for f in (min, max))
        for key, value in more.items():
            setattr(place, key, value)
        return place
