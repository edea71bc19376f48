#!/usr/bin/env python3
"""Writes materials.gltf: five balls of glTF's materials on a table under a panel and a lamp.

    scenes/tools/make_materials.py scenes/materials.gltf

One file with its buffer inside: a unit ball with smooth normals, a unit square in the xz plane that faces +y, and
nodes that place them. The output depends on nothing but this file.
"""
import base64
import json
import math
import struct
import sys

RINGS, SEGMENTS = 28, 56


def ball():
    """Returns (positions, normals, indices) of a unit sphere, counter-clockwise from outside."""
    points = []
    for i in range(RINGS + 1):
        polar = math.pi * i / RINGS
        for j in range(SEGMENTS + 1):
            angle = 2 * math.pi * j / SEGMENTS
            points.append((math.sin(polar) * math.cos(angle), math.cos(polar), -math.sin(polar) * math.sin(angle)))
    faces = []
    for i in range(RINGS):
        for j in range(SEGMENTS):
            a, b = i * (SEGMENTS + 1) + j, (i + 1) * (SEGMENTS + 1) + j
            if i > 0:
                faces += [a, b + 1, a + 1]
            if i < RINGS - 1:
                faces += [a, b, b + 1]
    return points, points, faces


def square():
    """The same of a unit square around the origin."""
    points = [(-0.5, 0, 0.5), (0.5, 0, 0.5), (0.5, 0, -0.5), (-0.5, 0, -0.5)]
    return points, [(0, 1, 0)] * 4, [0, 1, 2, 0, 2, 3]


class Document:
    """A glTF document with one buffer."""

    def __init__(self):
        self.binary = b""
        self.json = {"asset": {"version": "2.0", "generator": "scenes/tools/make_materials.py"},
                     "bufferViews": [], "accessors": [], "meshes": [], "materials": [], "nodes": []}

    def accessor(self, data, count, kind, component, extra=None):
        """Appends bytes to the buffer; returns the index of an accessor of them."""
        self.json["bufferViews"].append({"buffer": 0, "byteOffset": len(self.binary), "byteLength": len(data)})
        self.binary += data + b"\0" * (-len(data) % 4)
        entry = {"bufferView": len(self.json["bufferViews"]) - 1, "componentType": component, "count": count,
                 "type": kind}
        self.json["accessors"].append({**entry, **(extra or {})})
        return len(self.json["accessors"]) - 1

    def geometry(self, shape):
        """Returns a primitive without a material."""
        points, normals, faces = shape
        pack = lambda rows: b"".join(struct.pack("<3f", *row) for row in rows)
        bounds = {"min": [min(p[k] for p in points) for k in range(3)],
                  "max": [max(p[k] for p in points) for k in range(3)]}
        return {"attributes": {"POSITION": self.accessor(pack(points), len(points), "VEC3", 5126, bounds),
                               "NORMAL": self.accessor(pack(normals), len(normals), "VEC3", 5126)},
                "indices": self.accessor(struct.pack(f"<{len(faces)}H", *faces), len(faces), "SCALAR", 5123)}

    def place(self, name, primitive, material, **where):
        """Adds a material, a mesh of it and a node."""
        self.json["materials"].append({"name": name, **material})
        mesh = {"primitives": [{**primitive, "material": len(self.json["materials"]) - 1}]}
        self.json["meshes"].append(mesh)
        self.json["nodes"].append({"name": name, "mesh": len(self.json["meshes"]) - 1, **where})


def material(color, metallic=0.0, roughness=0.5, extensions=None):
    """A metallic-roughness material."""
    result = {"pbrMetallicRoughness": {"baseColorFactor": [*color, 1], "metallicFactor": metallic,
                                       "roughnessFactor": roughness}}
    if extensions:
        result["extensions"] = extensions
    return result


def scene():
    """Returns the whole document as text."""
    document = Document()
    round_one, flat = document.geometry(ball()), document.geometry(square())
    balls = [("gold", material((1.0, 0.77, 0.34), 1, 0.25)),
             ("lacquer", material((0.55, 0.02, 0.03), 0, 0.6,
                                  {"KHR_materials_clearcoat": {"clearcoatFactor": 1, "clearcoatRoughnessFactor": 0.1}})),
             ("glass", material((0.92, 1.0, 0.96), 0, 0,
                                {"KHR_materials_transmission": {"transmissionFactor": 1},
                                 "KHR_materials_volume": {"thicknessFactor": 1},
                                 "KHR_materials_ior": {"ior": 1.5}})),
             ("plastic", material((0.06, 0.2, 0.6), 0, 0.35)),
             ("steel", material((0.9, 0.9, 0.9), 1, 0.7))]
    for i, (name, kind) in enumerate(balls):
        angle = math.pi * (i - 2) / 7
        document.place(name, round_one, kind, translation=[4.3 * math.sin(angle), 0.8, 2.2 - 4.3 * math.cos(angle)],
                       scale=[0.8, 0.8, 0.8])
    document.place("table", flat, material((0.45, 0.42, 0.4), 0, 0.4), translation=[0, 0, 0], scale=[24, 1, 24])
    panel = material((0, 0, 0), 0, 1, {"KHR_materials_emissive_strength": {"emissiveStrength": 6}})
    document.place("panel", flat, {**panel, "emissiveFactor": [1, 0.95, 0.85]}, translation=[-1, 5, -1],
                   rotation=[1, 0, 0, 0], scale=[4, 1, 3])
    document.json["extensions"] = {"KHR_lights_punctual": {"lights": [
        {"name": "lamp", "type": "point", "color": [0.6, 0.8, 1], "intensity": 30}]}}
    document.json["nodes"].append({"name": "lamp", "translation": [4, 3, 4],
                                   "extensions": {"KHR_lights_punctual": {"light": 0}}})
    document.json["cameras"] = [{"name": "front", "type": "perspective",
                                 "perspective": {"yfov": 0.52, "aspectRatio": 16 / 9, "znear": 0.1}}]
    tilt = math.radians(-13) / 2
    document.json["nodes"].append({"name": "camera", "camera": 0, "translation": [0, 2.7, 9.2],
                                   "rotation": [math.sin(tilt), 0, 0, math.cos(tilt)]})
    document.json["scenes"] = [{"nodes": list(range(len(document.json["nodes"])))}]
    document.json["scene"] = 0
    document.json["extensionsUsed"] = ["KHR_lights_punctual", "KHR_materials_clearcoat",
                                       "KHR_materials_emissive_strength", "KHR_materials_ior",
                                       "KHR_materials_transmission", "KHR_materials_volume"]
    document.json["buffers"] = [{"byteLength": len(document.binary),
                                 "uri": "data:application/octet-stream;base64," +
                                        base64.b64encode(document.binary).decode()}]
    return json.dumps(document.json, indent=1) + "\n"


if __name__ == "__main__":
    if len(sys.argv) != 2:
        sys.exit(__doc__)
    with open(sys.argv[1], "w", encoding="ascii") as out:
        out.write(scene())
