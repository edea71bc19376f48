"""Binary PLY files of triangles, as docs/scenes.md says."""
import numpy

FACE = numpy.dtype([("count", "u1"), ("corners", "<i4", 3)])
PROPERTIES = {"normals": ("nx", "ny", "nz"), "uvs": ("u", "v"), "second_uvs": ("u2", "v2"),
              "colors": ("red", "green", "blue", "alpha")}


def ply(positions, triangles, **attributes):
    """The parts of a file. positions: float32 (n, 3); triangles: int32 (m, 3); attributes, each None or
    float32 (n, k): normals, uvs, second_uvs, colors (linear RGB and alpha)."""
    names, values = ["x", "y", "z"], [positions]
    for key, properties in PROPERTIES.items():
        if attributes.get(key) is not None:
            names += properties
            values.append(attributes[key])
    header = ["ply", "format binary_little_endian 1.0", f"element vertex {len(positions)}"]
    header += [f"property float {name}" for name in names]
    header += [f"element face {len(triangles)}", "property list uchar int vertex_indices", "end_header\n"]
    faces = numpy.empty(len(triangles), FACE)
    faces["count"] = 3
    faces["corners"] = triangles
    vertices = numpy.ascontiguousarray(numpy.concatenate(values, axis=1), "<f4") if len(values) > 1 else \
        numpy.ascontiguousarray(positions, "<f4")
    return ["\n".join(header).encode(), memoryview(vertices).cast("B") if vertices.size else b"",
            memoryview(faces.view("u1"))]
