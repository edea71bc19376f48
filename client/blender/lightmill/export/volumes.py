"""OpenVDB objects: the file as it is, in a box without a surface."""
import os
import tempfile

import numpy

from .lamps import hidden_parameter
from .pbrt_text import moving, quoted

AWAY = (0.36, 0.48, 0.8)  # a direction along which few meshes have edges
MOST_CROSSINGS, STEP = 1000, 1e-6
MOST_COMPARED = 200  # volumes that are looked at for overlaps
MARGIN = 1e-3  # of the box, of its size: the grid's outermost voxels lie inside
FACES = "0 2 1 0 3 2 4 5 6 4 6 7 0 1 5 0 5 4 1 2 6 1 6 5 2 3 7 2 7 6 3 0 4 3 4 7"


def is_inside(thing, matrix_columns, point):
    """Whether a point of the world is inside of an evaluated mesh object: a ray from there leaves it once more than it
    comes in."""
    matrix = numpy.array(matrix_columns).reshape(4, 4).T
    at = numpy.linalg.solve(matrix, [*point, 1.0])[:3]
    box = numpy.array(thing.bound_box)
    if (at < box.min(axis=0)).any() or (at > box.max(axis=0)).any():
        return False
    step, crossings = STEP * float(numpy.linalg.norm(box.max(axis=0) - box.min(axis=0))), 0
    while crossings < MOST_CROSSINGS:
        hit, where, _, _ = thing.ray_cast(tuple(at), AWAY)
        if not hit:
            break
        crossings += 1
        at = numpy.array(where) + step * numpy.array(AWAY)
    return crossings % 2 == 1


class Overlaps:
    """Names volumes that share space: there Cycles adds them up, and here the one that was entered last counts."""

    def __init__(self, report):
        self.report, self._boxes = report, []

    def add(self, thing, matrix_columns):
        """`thing`: an evaluated object with a volume inside."""
        matrix = numpy.array(matrix_columns).reshape(4, 4).T
        corners = numpy.array(thing.bound_box) @ matrix[:3, :3].T + matrix[:3, 3]
        low, high = corners.min(axis=0), corners.max(axis=0)
        if len(self._boxes) >= MOST_COMPARED:
            return
        other = next((name for name, a, b in self._boxes if (a < high).all() and (low < b).all()), None)
        if other is not None:
            self.report.warn("volumes that overlap", thing.name, f"its volume shares space with that of {other}, and they are "
                             "not added up: the one that was entered last counts")
        self._boxes.append((thing.name, low, high))


def volume_lines(object, way, hidden, export):
    """Lines of an evaluated VOLUME object; `way`: see Motion."""
    grids = object.data.grids
    name = object.name
    if not grids.load():
        export.report.warn("volume file", name, f"its OpenVDB file can't be read: {grids.error_message or 'none is set'}")
        return []
    slot = next((s.material for s in object.material_slots if s.material), None)
    slot = slot or next((m for m in object.data.materials if m), None)
    if slot is None:
        export.report.warn("volume material", name, "is a volume without material and is left out")
        return []
    try:
        file = volume_file(object, grids, export)
    except (OSError, RuntimeError) as error:
        export.report.warn("volume file", name, f"{grids.frame_filepath or 'its grids'}: {error}")
        return []
    place = export.nodes.Place.of(object)
    place.moving = moving(way) if len(way) > 1 else ""
    medium = export.nodes.volume(slot, export.context, place, grid=export.nodes.Grid(file, tuple(g.name for g in grids)))
    if not medium:
        return []
    export.materials.write(medium.lines)
    low, high = ([f(corner[k] for corner in object.bound_box) for k in range(3)] for f in (min, max))
    room = [MARGIN * (b - a) or MARGIN for a, b in zip(low, high)]
    low, high = [a - r for a, r in zip(low, room)], [b + r for b, r in zip(high, room)]
    corners = [(x, y, z) for z in (low[2], high[2]) for x, y in ((low[0], low[1]), (high[0], low[1]),
                                                                 (high[0], high[1]), (low[0], high[1]))]
    points = " ".join("%.9g %.9g %.9g" % c for c in corners)
    return ["AttributeBegin\n", moving(way), 'Material "interface"\n',
            f"MediumInterface {quoted(medium.name)} {quoted(export.outside)}\n",
            f'Shape "trianglemesh" "point3 P" [{points}] "integer indices" [{FACES}]{hidden_parameter(hidden)}\n',
            "AttributeEnd\n"]


def volume_file(object, grids, export):
    """A copy of the object's OpenVDB file, or of what its modifiers make."""
    if grids.frame_filepath and not object.modifiers:
        return export.folder.copy(grids.frame_filepath, "volumes", "vdb", export.cache)
    handle, path = tempfile.mkstemp(suffix=".vdb", dir=export.folder.path)
    os.close(handle)
    try:
        if not grids.save(filepath=path):
            raise OSError(grids.error_message or "Blender can't save them")
        with open(path, "rb") as source:
            return export.folder.write(source.read(), "volumes", "vdb")
    finally:
        os.unlink(path)
