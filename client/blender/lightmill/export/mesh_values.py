"""Values of a mesh that Cycles makes itself where a material asks for them: attributes of reserved names."""
import numpy

from ..nodes.place import MADE_ATTRIBUTES

NAMES = tuple(MADE_ATTRIBUTES.values())


def corner_values(mesh, name, source):
    """The value at all corners, as `mesh_arrays.corner_colors` has it: grey, alpha 1."""
    edges = numpy.empty(len(mesh.edges) * 2, "i4")
    mesh.edges.foreach_get("vertices", edges)
    edges = edges.reshape(-1, 2)
    if name == MADE_ATTRIBUTES["Pointiness"]:
        values = pointiness(source.positions, vertex_normals(mesh), edges)[source.corner_vertex]
    else:
        values = numpy.repeat(islands(len(source.positions), edges)[source.corner_vertex[source.starts]],
                              numpy.diff(source.starts, append=len(source.corner_vertex)))
    rgba = numpy.ones((len(values), 4), "f4")
    rgba[:, :3] = values[:, None]
    return rgba


def vertex_normals(mesh):
    normals = numpy.empty(len(mesh.vertices) * 3, "f4")
    mesh.vertex_normals.foreach_get("vector", normals)
    return normals.reshape(-1, 3)


def unit(vectors):
    length = numpy.linalg.norm(vectors, axis=1, keepdims=True)
    return numpy.divide(vectors, length, out=numpy.zeros_like(vectors), where=length > 0)


def pointiness(positions, normals, edges):
    """How sharp the mesh is at its vertices: the angle between the normal and the mean of the edges over pi, averaged over
    the neighbours. 0.5 is flat. Vertices at one place count as one."""
    _, first, same = numpy.unique(positions, axis=0, return_index=True, return_inverse=True)
    count = len(first)

    def summed(vertices, values):
        out = numpy.zeros((count, values.shape[1]))
        numpy.add.at(out, vertices, values)
        return out

    normal = unit(summed(same, normals.astype("f8")))
    ends = numpy.unique(numpy.sort(same[edges], axis=1), axis=0)
    way = unit((positions[first[ends[:, 1]]] - positions[first[ends[:, 0]]]).astype("f8"))
    mean = summed(ends[:, 0], way) - summed(ends[:, 1], way)
    number = numpy.bincount(ends.ravel(), minlength=count)
    cosine = (normal * mean).sum(axis=1) / numpy.maximum(number, 1)
    sharp = numpy.where(number > 0, numpy.arccos(numpy.clip(cosine, -1, 1)) / numpy.pi, 0.0)[:, None]
    blurred = sharp + summed(ends[:, 0], sharp[ends[:, 1]]) + summed(ends[:, 1], sharp[ends[:, 0]])
    return (blurred[:, 0] / (number + 1))[same].astype("f4")


def islands(count, edges):
    """A random number for each vertex, the same for all that edges join: Jenkins' hash (lookup3) of the vertex that stands
    for them. Which one that is depends on the order of the edges, as in Cycles: the deeper tree keeps its own."""
    parents, ranks = list(range(count)), [0] * count

    def find(x):
        root = x
        while parents[root] != root:
            root = parents[root]
        while parents[x] != root:
            parents[x], x = root, parents[x]
        return root

    for a, b in edges.tolist():
        x, y = find(a), find(b)
        if x == y:
            continue
        if ranks[x] < ranks[y]:
            x, y = y, x
        parents[y] = x
        ranks[x] += ranks[x] == ranks[y]
    return random_of(numpy.array([find(x) for x in range(count)], "u4"))


def random_of(numbers):
    """Numbers in [0, 1] for unsigned ones."""
    def turned(x, k):
        return x << numpy.uint32(k) | x >> numpy.uint32(32 - k)

    b = numpy.full(len(numbers), (0xDEADBEEF + 4 + 13) & 0xFFFFFFFF, "u4")
    a, c = b + numbers, b.copy()
    for k in (14, 11, 25, 16, 4, 14, 24):
        c = (c ^ b) - turned(b, k)
        a, b, c = b, c, a
    return (b / numpy.float64(0xFFFFFFFF)).astype("f4")
