"""The camera's clip distances: what is nearer or farther is not seen by its rays, but casts shadows and is lit.

Triangles are cut at the two planes, and the outer parts are hidden from the camera. Panoramas, whose rays are cut at a
distance and not at a plane, are not.
"""
import numpy

from .camera import resolution, window, without_scale
from .mesh_arrays import Triangles, get, part_of

SAFE = 1e-5  # relative: what reaches so little over a plane is not cut


class Clip:
    """`eye`: the evaluated camera object."""

    def __init__(self, eye, scene, size):
        camera = eye.data
        self.to_camera = numpy.array(without_scale(eye.matrix_world).inverted())
        self.start, self.end = max(camera.clip_start, 0.0), camera.clip_end
        w = window(camera, scene, size or resolution(scene))
        self.is_parallel = camera.type == "ORTHO"
        reach = 1 if self.is_parallel else self.start
        self.near_window = numpy.array([w.left, w.bottom, w.right, w.top]) * reach

    def depths(self, points, matrix):
        """(points in camera space, their depths) of points of an object."""
        seen = points.astype("f8") @ (self.to_camera @ matrix)[:3, :3].T + (self.to_camera @ matrix)[:3, 3]
        return seen, -seen[:, 2]

    def cuts(self, low, high, depth):
        """Masks of boxes in camera space (`low`, `high`) of which the near plane, and the far one, hide a part that the
        picture may show. `depth`: (least, greatest) of each."""
        left, bottom, right, top = self.near_window
        shown = (low[:, 0] <= right) & (high[:, 0] >= left) & (low[:, 1] <= top) & (high[:, 1] >= bottom)
        near = shown & (depth[0] < self.start * (1 - SAFE)) & (depth[1] > 0)
        return near, depth[1] > self.end * (1 + SAFE)

    def touches(self, thing, matrix):
        """Whether some of an evaluated mesh object is hidden."""
        seen, depth = self.depths(numpy.array(thing.bound_box), matrix)
        near, far = self.cuts(seen.min(axis=0)[None], seen.max(axis=0)[None], (depth.min()[None], depth.max()[None]))
        if far[0] or not near[0]:
            return bool(far[0])
        thing.data.calc_loop_triangles()
        triangles = get(thing.data.loop_triangles, "vertices", "i4", 3)
        seen, depth = self.depths(get(thing.data.vertices, "co", "f4", 3), matrix)
        return bool(len(triangles)) and bool(self.cut_triangles(seen[triangles], depth[triangles])[0].any())

    def cut_triangles(self, corners, depth):
        """As `cuts`, of triangles by their corners in camera space and the depths of these."""
        near, far = self.cuts(corners.min(axis=1), corners.max(axis=1), (depth.min(axis=1), depth.max(axis=1)))
        some = numpy.flatnonzero(near)
        if len(some):  # a plane beside the pyramid between the eye and the near window hides nothing
            left, bottom, right, top = self.near_window
            window = [(x, y, -self.start) for x in (left, right) for y in (bottom, top)]
            points = numpy.array([*((x, y, 0.0) for x, y, _ in window), *window] if self.is_parallel else [(0.0, 0.0, 0.0), *window])
            a, b, c = corners[some].transpose(1, 0, 2)
            normal = numpy.cross(b - a, c - a)
            sides = numpy.einsum("ij,ikj->ik", normal, points[None] - a[:, None])
            near[some] = (sides.min(axis=1) <= 0) & (sides.max(axis=1) >= 0)
        return near, far

    def split(self, part, matrix):
        """(what the camera may see, what is hidden from it): Triangles, or None where there are none."""
        seen, depth = self.depths(part.positions, matrix)
        near, far = self.cut_triangles(seen[part.triangles], depth[part.triangles])
        hidden = []
        if near.any():
            part, gone = sliced(part, depth - self.start, near)
            hidden.append(gone)
            depth = self.depths(part.positions, matrix)[1]
            far = depth[part.triangles].max(axis=1) > self.end * (1 + SAFE)
        if far.any():
            part, gone = sliced(part, self.end - depth, far)
            hidden.append(gone)
        hidden = [h for h in hidden if len(h.triangles)]
        return (part if len(part.triangles) else None), joined(hidden)


def sliced(part, height, cut):
    """(triangles where `height` >= 0, the rest), both with their own vertices; those that `cut` does not mark are of the
    first."""
    above = height[part.triangles] >= 0
    count = above.sum(axis=1)
    alone = numpy.flatnonzero(cut & (count > 0) & (count < 3))
    # Each is turned so that the corner that is alone on its side comes first.
    lonely = numpy.where(count[alone, None] == 1, above[alone], ~above[alone]).argmax(axis=1)
    turned = part.triangles[alone[:, None], (lonely[:, None] + numpy.arange(3)) % 3]
    a, b, c = turned.T
    more, first = [], len(part.positions)
    for other in (b, c):
        s = height[a] / (height[a] - height[other])
        more.append((a, other, s))
    new = [first + k * len(alone) + numpy.arange(len(alone)) for k in range(2)]
    between = lambda values: numpy.concatenate(  # noqa: E731
        [values, *((values[i] + s[:, None] * (values[j].astype("f8") - values[i])).astype(values.dtype) for i, j, s in more)])
    grown = Triangles(between(part.positions), part.triangles, {key: between(v) for key, v in part.attributes.items()},
                      [(between(p), None if n is None else between(n)) for p, n in part.later])
    tip = numpy.stack([a, new[0], new[1]], axis=1)
    rest = numpy.concatenate([numpy.stack([new[0], b, c], axis=1), numpy.stack([new[0], c, new[1]], axis=1)])
    tip_above = count[alone] == 1
    whole_above = ~cut | (count == 3)
    kept = [part.triangles[whole_above], tip[tip_above], rest[numpy.tile(~tip_above, 2)]]
    gone = [part.triangles[cut & (count == 0)], tip[~tip_above], rest[numpy.tile(tip_above, 2)]]
    return tuple(part_of(grown, numpy.concatenate(t).astype("i4")) for t in (kept, gone))


def joined(parts):
    """One Triangles of several; None of none."""
    if len(parts) < 2:
        return parts[0] if parts else None
    firsts = numpy.cumsum([0, *(len(p.positions) for p in parts[:-1])])
    return Triangles(numpy.concatenate([p.positions for p in parts]),
                     numpy.concatenate([p.triangles + f for p, f in zip(parts, firsts)]).astype("i4"),
                     {key: numpy.concatenate([p.attributes[key] for p in parts]) for key in parts[0].attributes},
                     [(numpy.concatenate([s[0] for s in step]), None if step[0][1] is None else numpy.concatenate([s[1] for s in step]))
                      for step in zip(*(p.later for p in parts))])
