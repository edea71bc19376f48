"""An evaluated mesh of Blender as arrays of triangles.

Read by `foreach_get`, a collection at a time. Corners of one vertex that have the same normal, texture coordinates
and colour share one vertex of the file; the others get vertices of their own.
"""
import zlib
from dataclasses import dataclass, field

import numpy

from . import mesh_values


@dataclass
class Triangles:
    """One mesh of a file: arrays as `ply.ply` takes them."""

    positions: numpy.ndarray
    triangles: numpy.ndarray
    attributes: dict
    later: list = field(default_factory=list)  # (positions, normals or None) at later times


@dataclass
class Repairs:
    """How many triangles were dropped."""

    not_finite: int = 0
    no_area: int = 0


def get(collection, name, kind, width=1):
    """A property of everything in the collection, as an array."""
    values = numpy.empty(len(collection) * width, kind)
    collection.foreach_get(name, values)
    return values.reshape(-1, width) if width > 1 else values


class Source:
    """What a mesh's files are made of, as Blender has it. `uv_names`: up to two maps; `color_name`: an attribute, or
    None; "" is the active one."""

    def __init__(self, mesh, uv_names=(), color_name=None):
        self.mesh = mesh
        self.positions = get(mesh.vertices, "co", "f4", 3)
        self.corner_vertex = get(mesh.loops, "vertex_index", "i4")
        self.starts = get(mesh.polygons, "loop_start", "i4")
        self.smooth = get(mesh.polygons, "use_smooth", "?")
        self.slots = get(mesh.polygons, "material_index", "i4") if len(mesh.polygons) else numpy.empty(0, "i4")
        # What a mesh lacks is 0 in Cycles.
        self.uvs = [or_zeros(uv_map(mesh, name), mesh, 2) for name in uv_names]
        self.color = None if color_name is None else or_zeros(corner_colors(mesh, color_name, self), mesh, 4)
        # Before Blender 4.1 sharp edges count if "auto smooth" is on; from then on always.
        self.splits = getattr(mesh, "use_auto_smooth", True) and bool(self.smooth.any())

    def fingerprint(self):
        """Changes with whatever the mesh's files are made of."""
        parts = [self.positions, self.corner_vertex, self.starts, self.smooth, self.slots, *self.uvs]
        if self.color is not None:
            parts.append(self.color)
        if self.splits:
            parts.append(corner_normals(self.mesh))
        return (self.splits, len(self.uvs)) + tuple(map(digest, parts))


def digest(array):
    """A short number that changes with the array, or None."""
    return None if array is None else (array.size, zlib.crc32(array))


def or_zeros(values, mesh, width):
    return numpy.zeros((len(mesh.loops), width), "f4") if values is None else values


def uv_map(mesh, name):
    """Texture coordinates of all corners; None if there is no such map. `name` "": the active one."""
    layer = mesh.uv_layers.get(name) if name else active_uv_layer(mesh)
    if layer is None or len(layer.data) != len(mesh.loops):
        return None
    return get(layer.data, "uv", "f4", 2)


def active_uv_layer(mesh):
    """The map that Cycles takes where none is named."""
    return next((layer for layer in mesh.uv_layers if layer.active_render),
                mesh.uv_layers[0] if len(mesh.uv_layers) else None)


def active_color(mesh):
    """The name of the colours that a node without a name takes, or None."""
    colors = getattr(mesh, "color_attributes", None)
    if not colors:
        return None
    index = getattr(colors, "render_color_index", 0)
    return colors[index if 0 <= index < len(colors) else 0].name


WIDTHS = {"FLOAT": ("value", "f4", 1), "INT": ("value", "i4", 1), "INT8": ("value", "i4", 1),
          "BOOLEAN": ("value", "?", 1), "FLOAT_VECTOR": ("vector", "f4", 3), "FLOAT2": ("vector", "f4", 2),
          "FLOAT_COLOR": ("color", "f4", 4), "BYTE_COLOR": ("color", "f4", 4)}


def corner_colors(mesh, name, source):
    """An attribute as RGBA at all corners, whatever its type and domain; None if it can't be had. A number is
    grey, a vector is a colour, alpha is 1."""
    if name in mesh_values.NAMES:
        return mesh_values.corner_values(mesh, name, source)
    name = name or active_color(mesh)
    attribute = mesh.attributes.get(name) if name else None
    if attribute is None or attribute.data_type not in WIDTHS:
        return None
    values = get(attribute.data, *WIDTHS[attribute.data_type]).astype("f4").reshape(len(attribute.data), -1)
    rgba = numpy.zeros((len(values), 4), "f4")
    rgba[:, 3] = 1
    if values.shape[1] == 1:
        rgba[:, :3] = values
    else:
        rgba[:, :values.shape[1]] = values
    if attribute.domain == "POINT":
        rgba = rgba[source.corner_vertex] if len(rgba) == len(source.positions) else None
    elif attribute.domain == "FACE":
        counts = numpy.diff(source.starts, append=len(source.corner_vertex))
        rgba = numpy.repeat(rgba, counts, axis=0) if len(rgba) == len(source.starts) else None
    elif attribute.domain != "CORNER":
        return None
    return rgba


def corner_normals(mesh):
    """Unit shading normals of all corners, custom ones included."""
    if hasattr(mesh, "corner_normals"):  # from Blender 4.1 on
        return get(mesh.corner_normals, "vector", "f4", 3)
    mesh.calc_normals_split()
    return get(mesh.loops, "normal", "f4", 3)


def usable_triangles(positions, triangles, repairs):
    """A mask of those that are finite and have an area."""
    a, b, c = (positions[triangles[:, k]] for k in range(3))
    with numpy.errstate(invalid="ignore", over="ignore"):
        normals = numpy.cross(b - a, c - a)
        good = (normals != 0).any(axis=1)  # as well where it is not finite
        finite = numpy.isfinite(normals).all(axis=1)
    if good.all() and finite.all():
        return numpy.ones(len(triangles), bool)
    # Seldom: in double, in which slivers keep their area and large numbers are finite.
    odd = numpy.flatnonzero(~good | ~finite)
    a, b, c = a[odd].astype("f8"), b[odd].astype("f8"), c[odd].astype("f8")
    with numpy.errstate(invalid="ignore"):
        normals = numpy.cross(b - a, c - a)
    bad_number = ~numpy.isfinite(normals).all(axis=1)
    flat = ~bad_number & (normals == 0).all(axis=1)
    repairs.not_finite += int(bad_number.sum())
    repairs.no_area += int(flat.sum())
    mask = numpy.ones(len(triangles), bool)
    mask[odd[bad_number | flat]] = False
    return mask


def shading_normals(source):
    """(per vertex, per corner), of which at most one is an array; both None for flat faces."""
    if not source.smooth.any():
        return None, None
    if source.smooth.all() and not source.splits:
        return get(source.mesh.vertex_normals, "vector", "f4", 3), None
    return None, corner_normals(source.mesh)


def share_vertices(positions, corner_vertex, corner_values):
    """(positions, values, vertex of each corner) such that each vertex has one row of values."""
    count = len(positions)
    values = numpy.zeros((count, corner_values.shape[1]), "f4")
    values[corner_vertex] = corner_values
    extra = numpy.flatnonzero((values[corner_vertex] != corner_values).any(axis=1))
    if not len(extra):
        return positions, values, corner_vertex
    vertex = corner_vertex.copy()
    vertex[extra] = numpy.arange(count, count + len(extra), dtype="i4")
    return (numpy.concatenate([positions, positions[corner_vertex[extra]]]),
            numpy.concatenate([values, corner_values[extra]]), vertex)


def triangles_by_slot(source, slots, repairs, bends=None):
    """Triangles of each material slot that has any: {slot: Triangles}. Faces of a slot beyond `slots` take the last
    one, as in Blender. `bends`: (positions, corner normals or None) at even times, the first of which counts for the
    mesh itself."""
    mesh = source.mesh
    mesh.calc_loop_triangles()
    corners = get(mesh.loop_triangles, "loops", "i4", 3)
    if not len(corners):
        return {}
    if bends:
        positions, vertex, attributes = each_corner(source, bends[0])
    else:
        positions, vertex, attributes = shared_corners(source)
    for key, value in attributes.items():
        attributes[key] = numpy.nan_to_num(value, copy=False, nan=0, posinf=0, neginf=0)
    triangles = vertex[corners]
    mask = usable_triangles(positions, triangles, repairs)
    whole = Triangles(numpy.nan_to_num(positions, nan=0, posinf=0, neginf=0),  # bad ones are of no triangle
                      triangles if mask.all() else triangles[mask], attributes)
    whole.later = [(numpy.nan_to_num(p[source.corner_vertex]), None if n is None else numpy.nan_to_num(n))
                   for p, n in (bends or ())[1:]]
    slot = numpy.minimum(source.slots, max(slots - 1, 0))
    if slot.min() == slot.max():
        return {int(slot[0]): whole} if len(whole.triangles) else {}
    of_triangle = slot[get(mesh.loop_triangles, "polygon_index", "i4")][mask]
    return {int(s): part_of(whole, whole.triangles[of_triangle == s]) for s in numpy.unique(of_triangle)}


def each_corner(source, shape):
    """(positions, vertex of each corner, attributes) with a vertex for each corner, so that all times have the same
    vertices."""
    positions, normals = shape
    present = {"normals": normals, "colors": source.color, **dict(zip(("uvs", "second_uvs"), source.uvs))}
    return (positions[source.corner_vertex], numpy.arange(len(source.corner_vertex), dtype="i4"),
            {key: value for key, value in present.items() if value is not None})


def shared_corners(source):
    """(positions, vertex of each corner, attributes) with as few vertices as can be."""
    vertex_normals, normals = shading_normals(source)
    present = {"normals": normals, "colors": source.color, **dict(zip(("uvs", "second_uvs"), source.uvs))}
    present = {key: value for key, value in present.items() if value is not None}
    if not present:
        return source.positions, source.corner_vertex, {} if vertex_normals is None else {"normals": vertex_normals}
    if vertex_normals is not None:
        present["normals"] = vertex_normals[source.corner_vertex]
    positions, values, vertex = share_vertices(source.positions, source.corner_vertex,
                                               numpy.concatenate(list(present.values()), axis=1))
    ends = numpy.cumsum([value.shape[1] for value in present.values()])
    return positions, vertex, dict(zip(present, numpy.split(values, ends[:-1], axis=1)))


def part_of(whole, triangles):
    """The triangles with the vertices that they use alone."""
    used = numpy.zeros(len(whole.positions), bool)
    used[triangles.ravel()] = True
    number = numpy.cumsum(used, dtype="i4") - 1
    return Triangles(whole.positions[used], number[triangles],
                     {key: value[used] for key, value in whole.attributes.items()},
                     [(p[used], None if n is None else n[used]) for p, n in whole.later])
