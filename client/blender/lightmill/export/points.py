"""Point clouds: a sphere at each point, as Cycles draws them."""
import numpy

from .mesh_arrays import get

MOST_POINTS = 1_000_000
SPHERE = 'Shape "sphere" "float radius" 1\n'


def spheres(thing, way, report):
    """The way of each point's sphere, of radius 1 in its own space. `way`: that of the cloud; see Motion."""
    points = thing.data.points
    if len(points) > MOST_POINTS:
        report.warn("points", thing.name, f"has {len(points)} points; the first {MOST_POINTS} are drawn")
    centres = get(points, "co", "f4", 3)[:MOST_POINTS]
    radii = get(points, "radius", "f4")[:MOST_POINTS]
    seen = numpy.isfinite(centres).all(axis=1) & numpy.isfinite(radii) & (radii > 0)
    local = numpy.zeros((int(seen.sum()), 4, 4))
    for axis in range(3):
        local[:, axis, axis] = radii[seen]
    local[:, :3, 3], local[:, 3, 3] = centres[seen], 1
    steps = []
    for columns in way:
        outer = numpy.array(columns).reshape(4, 4).T
        steps.append((outer @ local).transpose(0, 2, 1).reshape(-1, 16).tolist())
    return [tuple(map(tuple, step)) for step in zip(*steps)]
