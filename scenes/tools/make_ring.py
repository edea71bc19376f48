#!/usr/bin/env python3
"""Writes ring.ply: the ring of ring-caustic.pbrt.

    scenes/tools/make_ring.py scenes/ring.ply

An open cylinder of finite thickness that stands on the plane y = 0: inner wall, outer wall and top. There is no
bottom, for it would lie in the floor. The walls carry smooth normals, so that a ring of SEGMENTS flat pieces
reflects like a round one. Binary little-endian PLY; the output depends on nothing but this file.
"""
import math
import struct
import sys

INNER_RADIUS = 1.0
OUTER_RADIUS = 1.06
HEIGHT = 0.3
SEGMENTS = 720


def ring():
    """Returns (vertices, faces): (x, y, z, nx, ny, nz) and counter-clockwise index triples seen from outside."""
    vertices, faces = [], []

    def band(lower, upper):
        """Joins two closed loops of vertices, given as functions of the angle, by quads of two triangles."""
        first = len(vertices)
        for i in range(SEGMENTS):
            angle = 2 * math.pi * i / SEGMENTS
            c, s = math.cos(angle), math.sin(angle)
            vertices.append(lower(c, s))
            vertices.append(upper(c, s))
        for i in range(SEGMENTS):
            a, b = first + 2 * i, first + 2 * ((i + 1) % SEGMENTS)
            faces.append((a, a + 1, b + 1))
            faces.append((a, b + 1, b))

    r, big, h = INNER_RADIUS, OUTER_RADIUS, HEIGHT
    band(lambda c, s: (big * c, 0, big * s, c, 0, s), lambda c, s: (big * c, h, big * s, c, 0, s))
    band(lambda c, s: (r * c, h, r * s, -c, 0, -s), lambda c, s: (r * c, 0, r * s, -c, 0, -s))
    band(lambda c, s: (big * c, h, big * s, 0, 1, 0), lambda c, s: (r * c, h, r * s, 0, 1, 0))
    return vertices, faces


def main():
    if len(sys.argv) != 2:
        sys.exit("usage: make_ring.py OUT.ply")
    vertices, faces = ring()
    header = ["ply", "format binary_little_endian 1.0", "comment written by scenes/tools/make_ring.py",
              f"element vertex {len(vertices)}"]
    header += [f"property float {name}" for name in ("x", "y", "z", "nx", "ny", "nz")]
    header += [f"element face {len(faces)}", "property list uchar int vertex_indices", "end_header", ""]
    with open(sys.argv[1], "wb") as out:
        out.write("\n".join(header).encode())
        for vertex in vertices:
            out.write(struct.pack("<6f", *vertex))
        for face in faces:
            out.write(struct.pack("<B3i", 3, *face))


if __name__ == "__main__":
    main()
