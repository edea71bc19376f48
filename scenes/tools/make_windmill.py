#!/usr/bin/env python3
"""Writes scenes/windmill.gltf: a windmill and its pennant in two winds, animated by nodes, a skin and a morph target.

    make_windmill.py OUTPUT.gltf
"""
import base64
import json
import math
import struct
import sys

JOINTS, PARTS, TURNS_S = 8, 32, 4
FLOAT, SHORT, BYTE = 5126, 5123, 5121


class File:
    def __init__(self):
        self.bytes, self.views, self.accessors, self.meshes = b"", [], [], []

    def add(self, kind, values, components, component_type=FLOAT, bounds=False):
        """Index of an accessor of `values`, a flat list."""
        code = {FLOAT: "f", SHORT: "H", BYTE: "B"}[component_type]
        data = struct.pack(f"<{len(values)}{code}", *values)
        self.views.append({"buffer": 0, "byteOffset": len(self.bytes), "byteLength": len(data)})
        self.bytes += data + b"\0" * (-len(data) % 4)
        accessor = {"bufferView": len(self.views) - 1, "componentType": component_type,
                    "count": len(values) // components, "type": kind}
        if bounds:
            accessor["min"] = [min(values[c::components]) for c in range(components)]
            accessor["max"] = [max(values[c::components]) for c in range(components)]
        self.accessors.append(accessor)
        return len(self.accessors) - 1

    def mesh(self, points, triangles, material, **more):
        attributes = {"POSITION": self.add("VEC3", sum(map(list, points), []), 3, bounds=True)}
        primitive = {"attributes": attributes, "material": material,
                     "indices": self.add("SCALAR", sum(map(list, triangles), []), 1, SHORT), **more}
        self.meshes.append({"primitives": [primitive]})
        return len(self.meshes) - 1


def box(low, high):
    points = [[(high if i >> c & 1 else low)[c] for c in range(3)] for i in range(8)]
    quads = [(0, 4, 6, 2), (1, 3, 7, 5), (0, 1, 5, 4), (2, 6, 7, 3), (0, 2, 3, 1), (4, 5, 7, 6)]
    return points, [t for a, b, c, d in quads for t in ((a, b, c), (a, c, d))]


def tower(low_radius, high_radius, height, sides=12):
    ring = [(math.cos(2 * math.pi * i / sides), -math.sin(2 * math.pi * i / sides)) for i in range(sides)]
    points = [[r * x, y, r * z] for r, y in ((low_radius, 0), (high_radius, height)) for x, z in ring]
    points.append([0, height + 0.5, 0])
    triangles = []
    for i in range(sides):
        j = (i + 1) % sides
        triangles += [(i, j, sides + j), (i, sides + j, sides + i), (sides + i, sides + j, 2 * sides)]
    return points, triangles


def about(axis, degrees):
    half = math.radians(degrees) / 2
    return [math.sin(half) * a for a in axis] + [math.cos(half)]


def pennant(file):
    """A strip of 3 by 0.6 along x, that JOINTS joints carry."""
    points, joints, weights = [], [], []
    for i in range(PARTS + 1):
        along = i / PARTS * (JOINTS - 1)
        first = min(int(along), JOINTS - 2)
        for side in (-1, 1):
            points.append([3 * i / PARTS, side * 0.3 * (1 - 0.7 * i / PARTS), 0])
            joints += [first, first + 1, 0, 0]
            weights += [1 - (along - first), along - first, 0, 0]
    triangles = [t for i in range(PARTS) for a in (2 * i,) for t in ((a, a + 2, a + 3), (a, a + 3, a + 1))]
    mesh = file.mesh(points, triangles, 2)
    file.meshes[mesh]["primitives"][0]["attributes"].update(
        JOINTS_0=file.add("VEC4", joints, 4, BYTE), WEIGHTS_0=file.add("VEC4", weights, 4))
    return mesh


def hill(file):
    """A round of grass; its morph target is the ripple that the wind makes."""
    points, lifts, triangles, rings, sides = [[0, 0, 0]], [0, 0, 0], [], 12, 24
    for r in range(1, rings + 1):
        for s in range(sides):
            angle = 2 * math.pi * s / sides
            points.append([r * math.sin(angle), -0.02 * r * r, r * math.cos(angle)])
            lifts += [0, 0.12 * math.sin(1.3 * points[-1][0]), 0]
    for s in range(sides):
        triangles.append((0, 1 + s, 1 + (s + 1) % sides))
    for r in range(rings - 1):
        for s in range(sides):
            a, b = 1 + r * sides + s, 1 + r * sides + (s + 1) % sides
            triangles += [(a, a + sides, b + sides), (a, b + sides, b)]
    return file.mesh(points, triangles, 0, targets=[{"POSITION": file.add("VEC3", lifts, 3, bounds=True)}])


def animation(file, name, turns, swing, waves, nodes):
    """`turns` of the sails in TURNS_S, a pennant whose joints swing by so many degrees, `waves` times."""
    channels, samplers = [], []

    def channel(node, path, times, values, kind, components):
        samplers.append({"input": file.add("SCALAR", times, 1, bounds=True),
                         "output": file.add(kind, values, components), "interpolation": "LINEAR"})
        channels.append({"sampler": len(samplers) - 1, "target": {"node": node, "path": path}})

    count = 4 * turns
    times = [TURNS_S * i / count for i in range(count + 1)]
    channel(nodes["sails"], "rotation", times, sum((about((0, 0, 1), -90 * i) for i in range(count + 1)), []), "VEC4", 4)
    count = 12 * waves
    times = [TURNS_S * i / count for i in range(count + 1)]
    for j in range(JOINTS):
        angles = [swing * math.sin(2 * math.pi * (waves * t / TURNS_S - 1.5 * j / JOINTS)) for t in times]
        channel(nodes["joints"] + j, "rotation", times, sum((about((0, 1, 0), a) for a in angles), []), "VEC4", 4)
    channel(nodes["hill"], "weights", times, [math.sin(2 * math.pi * waves * t / TURNS_S) for t in times], "SCALAR", 1)
    return {"name": name, "channels": channels, "samplers": samplers}


def main():
    file = File()
    grass, body, sail = hill(file), file.mesh(*tower(1.1, 0.7, 4), 1), file.mesh(*box([-0.35, 0.4, 0], [0.05, 3, 0.05]), 3)
    flag = pennant(file)
    joints, inverse_binds = [], []
    first_joint = 12
    for j in range(JOINTS):
        step = 3 / (JOINTS - 1)
        node = {"translation": [step if j else 0, 0, 0]}
        if j + 1 < JOINTS:
            node["children"] = [first_joint + j + 1]
        joints.append(node)
        inverse_binds += [1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, -j * step, 0, 0, 1]
    nodes = [{"name": "hill", "mesh": grass, "weights": [0]}, {"name": "tower", "mesh": body},
             {"name": "sails", "translation": [0, 3.8, 1.1], "children": [3, 4, 5, 6]}]
    nodes += [{"mesh": sail, "rotation": about((0, 0, 1), 90 * i + 20)} for i in range(4)]
    nodes += [{"name": "pennant", "mesh": flag, "skin": 0},
              {"name": "camera", "camera": 0, "translation": [3.2, 3.1, 14.5], "rotation": about((0, 1, 0), 12)},
              {"name": "sun", "rotation": about((0.8, 0.6, 0), -50), "extensions": {"KHR_lights_punctual": {"light": 0}}},
              {"name": "sky", "rotation": about((0, 1, 0), 40), "extensions": {"KHR_lights_punctual": {"light": 1}}},
              {"name": "mast", "translation": [0, 5.2, 0], "children": [first_joint]}]
    nodes += joints
    parts = {"sails": 2, "hill": 0, "joints": first_joint}
    skin = {"joints": list(range(first_joint, first_joint + JOINTS)), "inverseBindMatrices": file.add("MAT4", inverse_binds, 16)}
    animations = [animation(file, "Breeze", 1, 14, 2, parts), animation(file, "Storm", 6, 22, 8, parts)]

    def paint(red, green, blue, double_sided=False):
        return {"doubleSided": double_sided,
                "pbrMetallicRoughness": {"baseColorFactor": [red, green, blue, 1], "metallicFactor": 0, "roughnessFactor": 0.8}}

    document = {
        "asset": {"version": "2.0", "generator": "scenes/tools/make_windmill.py"},
        "extensionsUsed": ["KHR_lights_punctual"],
        "extensions": {"KHR_lights_punctual": {"lights": [{"type": "directional", "color": [1, 0.93, 0.8], "intensity": 3},
            {"type": "directional", "color": [0.5, 0.7, 1], "intensity": 0.7}]}},
        "scene": 0, "scenes": [{"nodes": [0, 1, 2, 7, 8, 9, 10, 11]}], "nodes": nodes, "skins": [skin],
        "cameras": [{"type": "perspective", "perspective": {"yfov": 0.65, "aspectRatio": 1.5, "znear": 0.1}}],
        "materials": [paint(0.25, 0.45, 0.12), paint(0.8, 0.76, 0.7), paint(0.8, 0.1, 0.08, True), paint(0.35, 0.2, 0.1)],
        "meshes": file.meshes, "animations": animations, "accessors": file.accessors, "bufferViews": file.views,
        "buffers": [{"byteLength": len(file.bytes),
                     "uri": "data:application/octet-stream;base64," + base64.b64encode(file.bytes).decode()}]}
    with open(sys.argv[1], "w", encoding="utf-8") as out:
        json.dump(document, out, separators=(",", ":"))
        out.write("\n")


if __name__ == "__main__":
    main()
