"""Hair of particle systems and Curves objects as pbrt's curves, in files of their own that the scene includes.

Both go through their points by Catmull and Rom's splines, as in Cycles, which are Bezier curves as they are.
"""
import zlib

import numpy

from . import mesh_arrays

MOST_POINTS = 50_000_000  # of one system
SAME_WIDTH = 1e-3  # of a curve's, within which widths that are not linear along it count as such
DEFAULT_RADIUS = 0.005  # of a curve that has none


def bezier(points):
    """Catmull-Rom points (n >= 2, 3) as control points (3 n - 2, 3) of cubic Bezier curves that share their ends."""
    before = numpy.concatenate([points[:1], points[:-1]])
    after = numpy.concatenate([points[1:], points[-1:]])
    tangent = (after - before) / 6
    out = numpy.empty((3 * len(points) - 2, 3))
    out[0::3] = points
    out[1::3] = points[:-1] + tangent[:-1]
    out[2::3] = points[1:] - tangent[1:]
    return out


def shape(control, width0, width1):
    """A round curve of Bezier control points (n, 3); widths are diameters at its ends."""
    text = " ".join(["%.7g"] * control.size) % tuple(control.ravel().tolist())
    return (f'Shape "curve" "string type" "cylinder" "point3 P" [{text}] "float width0" {width0:.6g}'
            f' "float width1" {width1:.6g}\n')


def curves_text(strands):
    """Shapes of (points (n, 3), diameters (n)) of each strand. Strands that are not finite, have no length or no
    width are left out; the second result says how many were not finite."""
    lines, bad = [], 0
    for points, widths in strands:
        if len(points) < 2:
            continue
        if not (numpy.isfinite(points).all() and numpy.isfinite(widths).all()):
            bad += 1
            continue
        if (points == points[0]).all() or widths.max() <= 0:
            continue
        control = bezier(points)
        even = numpy.linspace(widths[0], widths[-1], len(widths))
        if numpy.abs(widths - even).max() <= SAME_WIDTH * widths.max():
            lines.append(shape(control, widths[0], widths[-1]))
            continue
        lines += [shape(control[3 * i:3 * i + 4], widths[i], widths[i + 1])  # each segment with its own widths
                  for i in range(len(points) - 1) if max(widths[i], widths[i + 1]) > 0]
    return lines, bad


def particle_strands(object, system, for_viewport):
    """Strands of a hair system in the space of its evaluated object."""
    settings = system.settings
    steps = 2 ** (settings.display_step if for_viewport else settings.render_step) + 1
    if settings.kink == "SPIRAL":
        steps += settings.kink_extra_steps
    parents, children = len(system.particles), len(system.child_particles)
    first = 0 if children == 0 or settings.use_parent_particles else parents
    last = parents + children
    if (last - first) * steps > MOST_POINTS:
        last = first + MOST_POINTS // steps
    root, tip = settings.root_radius * settings.radius_scale, settings.tip_radius * settings.radius_scale
    along = numpy.linspace(0, 1, steps)
    widths = root + (tip - root) * taper(settings.shape, along)
    if settings.use_close_tip:
        widths[-1] = 0
    to_object = numpy.array(object.matrix_world.inverted_safe())
    turn, move = to_object[:3, :3].T, to_object[:3, 3]
    co_hair = system.co_hair
    for number in range(first, last):
        points = numpy.array([co_hair(object, particle_no=number, step=k) for k in range(steps)])
        ends = numpy.flatnonzero((points == 0).all(axis=1))  # a strand that is cut ends with zeros
        if len(ends) and ends[0] > 0:
            points = points[:ends[0]]
        yield points @ turn + move, widths[:len(points)]


def taper(strand_shape, along):
    """How far from root to tip the width has gone, of Blender's "strand shape" from -1 to 1."""
    if strand_shape == 0:
        return along
    rest = 1 - along
    power = 1 + strand_shape if strand_shape < 0 else 1 / max(1 - strand_shape, 1e-4)
    return 1 - numpy.power(rest, power)


def object_strands(curves):
    """Strands of a Curves datablock."""
    points = mesh_arrays.get(curves.position_data, "vector", "f4", 3).astype("f8")
    radius = curves.attributes.get("radius")
    if radius is not None and radius.domain == "POINT" and radius.data_type == "FLOAT":
        widths = 2 * mesh_arrays.get(radius.data, "value", "f4").astype("f8")
    else:
        widths = numpy.full(len(points), 2 * DEFAULT_RADIUS)
    for first, count in zip(mesh_arrays.get(curves.curves, "first_point_index", "i4"),
                            mesh_arrays.get(curves.curves, "points_length", "i4")):
        yield points[first:first + count], widths[first:first + count]


def hair_file(key, strands, owner, export):
    """The file of the strands, relative to the scene file; None if there are none. Unchanged ones are not
    written again."""
    strands = list(strands)
    fingerprint = (len(strands),)
    for k in range(2):
        digest = 0
        for strand in strands:
            digest = zlib.crc32(numpy.ascontiguousarray(strand[k]), digest)
        fingerprint += (digest,)
    made = export.cache.find(key, fingerprint, export.folder)
    if made is None:
        lines, bad = curves_text(strands)
        if bad:
            export.report.warn("hair that is not finite", owner, f"{bad} strands have no finite place; they are left out")
        made = export.folder.write("".join(lines).encode(), "curves", "pbrt") if lines else ""
        export.cache.store(key, fingerprint, made, [made] if made else [])
    return made or None


def hair_of(object, for_viewport):
    """(slot, key, strands) of everything hairy of an object, which is evaluated for rendering or the viewport."""
    if object.type == "CURVES":
        yield 0, "curves", object_strands(object.data)
        return
    modifiers = [m for m in object.modifiers if m.type == "PARTICLE_SYSTEM"]
    for modifier in modifiers:
        system = modifier.particle_system
        settings = system.settings
        shown = modifier.show_viewport if for_viewport else modifier.show_render
        if settings.type == "HAIR" and settings.render_type == "PATH" and shown:
            yield max(settings.material - 1, 0), system.name, particle_strands(object, system, for_viewport)
