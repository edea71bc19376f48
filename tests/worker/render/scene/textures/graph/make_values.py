#!/usr/bin/env python3
"""Makes blender_values.json: what Blender's Cycles gives for each node of a texture graph at fixed points.

    blender -b --factory-startup --python-exit-code 1 -P make_values.py -- blender_values.json

Every case is a graph as docs/texture-graph.md has it, built here from Blender's nodes of the same names. It is rendered as the
emission of a row of squares, one for a point: the colour attribute of a square is the point, its texture coordinates are
(w, v). What is negative is rendered by a second row. Needs Blender 3.4.
"""
import itertools
import json
import sys
import tempfile

import bpy

POINTS = [[0.13, 0.41, 0.77, 0.29, 0.6], [-1.37, 2.21, 0.58, 1.71, 0.2], [3.62, -0.83, -2.46, -0.64, 0.9],
          [0.91, 0.07, -0.35, 4.03, 0.4], [-0.28, -1.94, 1.12, -2.57, 0.75], [7.31, 5.57, 9.83, 0.03, 0.11]]
# Unit normals that the squares have.
NORMALS = [[0.48, 0.6, 0.64], [-0.8, 0.36, 0.48], [0.36, -0.48, 0.8], [0.1, 0.1, 0.98994949], [-0.64, -0.6, 0.48], [0.6, 0.64, 0.48]]
P, W = ["p", "Vector"], ["w", "X"]
BASE = [{"name": "p", "type": "ATTRIBUTE", "attribute_name": "P"}, {"name": "uv", "type": "UVMAP", "uv_map": "UVMap"},
        {"name": "w", "type": "SEPXYZ", "inputs": {"Vector": ["uv", "UV"]}}, {"name": "xyz", "type": "SEPXYZ", "inputs": {"Vector": P}},
        # A colour within [0, 1], and another.
        {"name": "white", "type": "TEX_WHITE_NOISE", "inputs": {"Vector": P}},
        {"name": "white2", "type": "TEX_WHITE_NOISE", "noise_dimensions": "1D", "inputs": {"W": W}},
        {"name": "hot", "type": "MATH", "operation": "MULTIPLY", "inputs": {"Value": ["w", "Y"], "Value_001": 14000}},
        {"name": "warm", "type": "MATH", "operation": "MULTIPLY", "inputs": {"Value": ["w", "Y"], "Value_001": 3000}},
        {"name": "sep", "type": "SEPARATE_COLOR", "inputs": {"Color": ["white", "Color"]}}]
C1, C2, T = ["white", "Color"], ["white2", "Color"], ["w", "Y"]


def cases():
    def case(name, output, **node):
        yield name, BASE + [{"name": "node", **node}], ["node", output]

    for d in ("1D", "2D", "3D", "4D"):
        t = {"type": "TEX_NOISE", "noise_dimensions": d}
        yield from case(f"noise {d}", "Color", **t, inputs={"Vector": P, "W": W, "Scale": 1.7, "Detail": 2.4, "Roughness": 0.6})
        yield from case(f"noise {d} distorted", "Fac", **t, inputs={"Vector": P, "W": W, "Detail": 1, "Distortion": 0.8})
        yield from case(f"white noise {d}", "Color", type="TEX_WHITE_NOISE", noise_dimensions=d, inputs={"Vector": P, "W": W})
        for kind, detail in itertools.product(("MULTIFRACTAL", "FBM", "HYBRID_MULTIFRACTAL", "RIDGED_MULTIFRACTAL", "HETERO_TERRAIN"), (3.3, 0.5)):
            if detail == 0.5 and d != "3D":
                continue
            yield from case(f"musgrave {kind} {d} {detail}", "Fac", type="TEX_MUSGRAVE", musgrave_dimensions=d, musgrave_type=kind,
                            inputs={"Vector": P, "W": W, "Scale": 0.9, "Detail": detail, "Dimension": 0.8, "Lacunarity": 2.1, "Offset": 0.7, "Gain": 1.3})
        for feature, metric in itertools.product(("F1", "F2", "SMOOTH_F1"), ("EUCLIDEAN", "MANHATTAN", "CHEBYCHEV", "MINKOWSKI")):
            if metric != "EUCLIDEAN" and (d == "1D" or feature == "SMOOTH_F1" and d != "2D"):
                continue
            t = {"type": "TEX_VORONOI", "voronoi_dimensions": d, "feature": feature, "distance": metric,
                 "inputs": {"Vector": P, "W": W, "Scale": 1.3, "Randomness": 0.9}}
            if feature == "SMOOTH_F1":
                t["inputs"]["Smoothness"] = 0.7
            if metric == "MINKOWSKI":
                t["inputs"]["Exponent"] = 1.6
            outputs = ["Distance", "Color"] if metric == "EUCLIDEAN" else ["Distance"]
            if metric == "EUCLIDEAN" and d != "1D":
                outputs.append("Position")
            if metric == "EUCLIDEAN" and d in ("1D", "4D"):
                outputs.append("W")
            for output in outputs:
                yield from case(f"voronoi {feature} {metric} {d} {output}", output, **t)
        for feature, output in (("DISTANCE_TO_EDGE", "Distance"), ("N_SPHERE_RADIUS", "Radius")):
            yield from case(f"voronoi {feature} {d}", output, type="TEX_VORONOI", voronoi_dimensions=d, feature=feature,
                            inputs={"Vector": P, "W": W, "Scale": 1.3, "Randomness": 0.9})
    for kind, way, profile in itertools.product(("BANDS", "RINGS"), ("X", "Y", "Z", "DIAGONAL"), ("SIN", "SAW", "TRI")):
        if profile != "SIN" and way != "Y":
            continue
        ring = "SPHERICAL" if way == "DIAGONAL" else way
        yield from case(f"wave {kind} {way} {profile}", "Fac", type="TEX_WAVE", wave_type=kind, bands_direction=way, rings_direction=ring,
                        wave_profile=profile, inputs={"Vector": P, "Scale": 0.3, "Distortion": 1.5 if way == "Y" else 0, "Detail": 1.5,
                                                      "Detail Scale": 1.2, "Detail Roughness": 0.4, "Phase Offset": 0.3})
    for kind in ("LINEAR", "QUADRATIC", "EASING", "DIAGONAL", "SPHERICAL", "QUADRATIC_SPHERE", "RADIAL"):
        yield from case(f"gradient {kind}", "Fac", type="TEX_GRADIENT", gradient_type=kind, inputs={"Vector": P})
    for depth in range(11):
        yield from case(f"magic {depth}", "Color", type="TEX_MAGIC", turbulence_depth=depth, inputs={"Vector": P, "Scale": 0.7, "Distortion": 1.4})
    yield from case("checker", "Color", type="TEX_CHECKER", inputs={"Vector": P, "Color1": C1, "Color2": C2, "Scale": 1.7})
    yield from case("checker Fac", "Fac", type="TEX_CHECKER", inputs={"Vector": P, "Scale": 0.8})
    for k, (offset, squash) in enumerate((((0.5, 2), (1, 2)), ((0.3, 3), (0.7, 2)))):
        t = {"type": "TEX_BRICK", "offset": offset[0], "offset_frequency": offset[1], "squash": squash[0], "squash_frequency": squash[1],
             "inputs": {"Vector": P, "Scale": 2.3, "Color1": C1, "Color2": C2, "Mortar Size": 0.12, "Mortar Smooth": 0.6, "Bias": 0.1}}
        yield from case(f"brick {k}", "Color", **t)
        yield from case(f"brick {k} Fac", "Fac", **t)

    for projection, extension, blend in (("FLAT", "REPEAT", 0), ("FLAT", "EXTEND", 0), ("SPHERE", "REPEAT", 0), ("TUBE", "EXTEND", 0),
                                         ("BOX", "REPEAT", 0), ("BOX", "REPEAT", 0.3), ("BOX", "REPEAT", 1)):
        for interpolation in ("Linear", "Closest"):
            yield from case(f"image {projection} {extension} {blend} {interpolation}", "Color", type="TEX_IMAGE", image="image.exr", colorspace="Non-Color",
                            projection=projection, extension=extension, projection_blend=blend, interpolation=interpolation, inputs={"Vector": P})
    yield from case("environment", "Color", type="TEX_ENVIRONMENT", image="image.exr", colorspace="Non-Color", inputs={"Vector": P})
    yield from case("geometry Normal", "Normal", type="NEW_GEOMETRY")
    yield from case("coordinates Normal", "Normal", type="TEX_COORD")

    a, b, c = ["xyz", "X"], ["xyz", "Y"], ["xyz", "Z"]
    for operation in bpy.types.ShaderNodeMath.bl_rna.properties["operation"].enum_items.keys():
        yield from case(f"math {operation}", "Value", type="MATH", operation=operation, inputs={"Value": a, "Value_001": b, "Value_002": c})
    yield from case("math clamped", "Value", type="MATH", operation="MULTIPLY", use_clamp=True, inputs={"Value": a, "Value_001": b})
    v2, v3 = [0.7, -1.3, 0.4], ["white", "Color"]
    for operation in bpy.types.ShaderNodeVectorMath.bl_rna.properties["operation"].enum_items.keys():
        output = "Value" if operation in ("DOT_PRODUCT", "LENGTH", "DISTANCE") else "Vector"
        yield from case(f"vector math {operation}", output, type="VECT_MATH", operation=operation,
                        inputs={"Vector": P, "Vector_001": v2, "Vector_002": v3, "Scale": 0.8})
    for kind in ("POINT", "TEXTURE", "VECTOR", "NORMAL"):
        yield from case(f"mapping {kind}", "Vector", type="MAPPING", vector_type=kind,
                        inputs={"Vector": P, "Location": [0.3, -0.2, 0.9], "Rotation": [0.4, -1.1, 2.3], "Scale": [1.5, 0.6, -0.8]})
    for kind, invert in itertools.product(("AXIS_ANGLE", "X_AXIS", "Y_AXIS", "Z_AXIS", "EULER_XYZ"), (False, True)):
        inputs = {"Vector": P, "Center": [0.1, 0.2, 0.3]}
        inputs.update({"Rotation": [0.4, -1.1, 2.3]} if kind == "EULER_XYZ" else {"Angle": 0.7})
        if kind == "AXIS_ANGLE":
            inputs["Axis"] = [1, 2, -0.5]
        yield from case(f"vector rotate {kind} {invert}", "Vector", type="VECTOR_ROTATE", rotation_type=kind, invert=invert, inputs=inputs)
    for kind, clamp in itertools.product(("LINEAR", "STEPPED", "SMOOTHSTEP", "SMOOTHERSTEP"), (False, True)):
        inputs = {"From Min": 0.2, "From Max": 2.5, "To Min": 3, "To Max": -1, "Value": a}
        vectors = {"Vector": P, "From_Min_FLOAT3": [0, 1, -1], "From_Max_FLOAT3": [2, 1, -3], "To_Min_FLOAT3": [1, 2, 3], "To_Max_FLOAT3": [4, 0, 7]}
        if kind == "STEPPED":
            inputs["Steps"], vectors["Steps_FLOAT3"] = 3, [2, 4, 5]
        yield from case(f"map range {kind} {clamp}", "Result", type="MAP_RANGE", interpolation_type=kind, clamp=clamp, inputs=inputs)
        yield from case(f"map range vector {kind} {clamp}", "Vector", type="MAP_RANGE", data_type="FLOAT_VECTOR", interpolation_type=kind, clamp=clamp, inputs=vectors)
    for kind in ("MINMAX", "RANGE"):
        yield from case(f"clamp {kind}", "Result", type="CLAMP", clamp_type=kind, inputs={"Value": a, "Min": 2, "Max": 0.5})
    for mode in bpy.types.ShaderNodeMixRGB.bl_rna.properties["blend_type"].enum_items.keys():
        yield from case(f"mix rgb {mode}", "Color", type="MIX_RGB", blend_type=mode, inputs={"Fac": T, "Color1": C1, "Color2": C2})
        yield from case(f"mix wild {mode}", "Result_Color", type="MIX", data_type="RGBA", blend_type=mode, clamp_factor=False, clamp_result=mode == "ADD",
                        inputs={"Factor_Float": T, "A_Color": C1, "B_Color": [1.3, 0.4, 0.0, 1]})
    yield from case("mix float", "Result_Float", type="MIX", data_type="FLOAT", clamp_factor=False, inputs={"Factor_Float": a, "A_Float": b, "B_Float": c})
    yield from case("mix vector", "Result_Vector", type="MIX", data_type="VECTOR", factor_mode="NON_UNIFORM", inputs={"Factor_Vector": P, "A_Vector": v2, "B_Vector": v3})
    yield from case("hue saturation", "Color", type="HUE_SAT", inputs={"Hue": 0.7, "Saturation": 1.3, "Value": 0.8, "Fac": 0.9, "Color": C1})
    yield from case("bright contrast", "Color", type="BRIGHTCONTRAST", inputs={"Bright": 0.1, "Contrast": 0.6, "Color": C1})
    yield from case("gamma", "Color", type="GAMMA", inputs={"Gamma": 1.7, "Color": P})
    yield from case("invert", "Color", type="INVERT", inputs={"Fac": 0.7, "Color": P})
    yield from case("grey of a colour", "Val", type="RGBTOBW", inputs={"Color": C1})
    yield from case("number of a vector", "Value", type="MATH", operation="ADD", inputs={"Value": P, "Value_001": 0})
    yield from case("number of a colour", "Value", type="MATH", operation="ADD", inputs={"Value": C1, "Value_001": 0})
    for mode in ("RGB", "HSV", "HSL"):
        yield from case(f"combine {mode}", "Color", type="COMBINE_COLOR", mode=mode, inputs={"Red": ["sep", "Red"], "Green": 0.4, "Blue": T})
        for output in ("Red", "Green", "Blue"):
            yield from case(f"separate {mode} {output}", output, type="SEPARATE_COLOR", mode=mode, inputs={"Color": C1})
    for name in ("hot", "warm"):
        yield from case(f"blackbody {name}", "Color", type="BLACKBODY", inputs={"Temperature": [name, "Value"]})
    yield from case("normal", "Dot", type="NORMAL", normal=[1, 2, -0.5], inputs={"Normal": P})
    stops = [{"position": 0.15, "color": [0.9, 0.1, 0.2, 1]}, {"position": 0.45, "color": [0.1, 0.8, 0.3, 0.5]}, {"position": 0.8, "color": [0.2, 0.1, 0.7, 1]}]
    for kind in ("LINEAR", "EASE", "CONSTANT", "CARDINAL", "B_SPLINE"):
        yield from case(f"ramp {kind}", "Color", type="VALTORGB", interpolation=kind, elements=stops, inputs={"Fac": T})
    for mode, hue in itertools.product(("HSV", "HSL"), ("NEAR", "FAR", "CW", "CCW")):
        yield from case(f"ramp {mode} {hue}", "Color", type="VALTORGB", color_mode=mode, hue_interpolation=hue, elements=stops, inputs={"Fac": T})


def picture():
    """8 x 4 texels; the tests make the same."""
    image = bpy.data.images.new("image", 8, 4, float_buffer=True, alpha=False)
    image.colorspace_settings.name = "Non-Color"
    image.pixels = [v for y in range(4) for x in range(8) for v in ((x * 3 + y * 5) % 7 / 8, (x + 2 * y) % 5 / 8, x / 8, 1)]
    image.pack()
    return image


def needed(nodes, output):
    """The nodes that the output needs, in order."""
    wanted, kept = {output[0]}, []
    for n in reversed(nodes):
        if n["name"] in wanted:
            kept.append(n)
            wanted |= {v[0] for v in n.get("inputs", {}).values() if isinstance(v, list) and isinstance(v[0], str)}
    return kept[::-1]


def build(tree, types, nodes, output, sign):
    made = {}
    for n in nodes:
        node = made[n["name"]] = tree.nodes.new(types[n["type"]])
        for key, value in n.items():
            if key == "elements":
                ramp = node.color_ramp
                ramp.elements.new(0.5)
                for e, v in zip(ramp.elements, value):
                    e.position, e.color = v["position"], v["color"]
            elif key in ("color_mode", "hue_interpolation") or key == "interpolation" and n["type"] == "VALTORGB":
                setattr(node.color_ramp, key, value)
            elif key == "image":
                node.image = bpy.data.images.get("image") or picture()
            elif key == "colorspace":
                pass  # the picture's own
            elif key == "normal":
                made[n["name"]].outputs["Normal"].default_value = value
            elif key == "inputs":
                for name, v in value.items():
                    socket = next(s for s in node.inputs if s.identifier == name)
                    if isinstance(v, list) and isinstance(v[0], str):
                        tree.links.new(next(s for s in made[v[0]].outputs if s.identifier == v[1] or s.name == v[1]), socket)
                    else:
                        socket.default_value = v
            elif key not in ("name", "type"):
                setattr(node, key, value)
    scale, most = tree.nodes.new("ShaderNodeVectorMath"), tree.nodes.new("ShaderNodeVectorMath")
    scale.operation, most.operation = "MULTIPLY", "MAXIMUM"
    scale.inputs[1].default_value, most.inputs[1].default_value = (sign,) * 3, (0, 0, 0)
    out = next(s for s in made[output[0]].outputs if s.identifier == output[1] and s.enabled)
    tree.links.new(out, scale.inputs[0])
    tree.links.new(scale.outputs[0], most.inputs[0])
    emission, end = tree.nodes.new("ShaderNodeEmission"), tree.nodes.new("ShaderNodeOutputMaterial")
    tree.links.new(most.outputs[0], emission.inputs["Color"])
    tree.links.new(emission.outputs[0], end.inputs[0])


def render(rows):
    """The picture of rows of squares, each with a tree that build() makes."""
    bpy.ops.wm.read_factory_settings(use_empty=True)
    types = {}
    probe = bpy.data.node_groups.new("probe", "ShaderNodeTree")
    for name in dir(bpy.types):
        if name.startswith("ShaderNode"):
            try:
                types.setdefault(probe.nodes.new(name).type, name)
            except RuntimeError:
                pass
    scene = bpy.context.scene
    for y, (nodes, output, sign) in enumerate(rows):
        vertices = [(x + i, y + k, 0) for x in range(len(POINTS)) for i, k in ((0, 0), (1, 0), (1, 1), (0, 1))]
        mesh = bpy.data.meshes.new("row")
        mesh.from_pydata(vertices, [], [tuple(range(4 * x, 4 * x + 4)) for x in range(len(POINTS))])
        uvs, points = mesh.uv_layers.new(name="UVMap"), mesh.attributes.new("P", "FLOAT_VECTOR", "CORNER")
        for i in range(4 * len(POINTS)):
            p = POINTS[i // 4]
            uvs.data[i].uv, points.data[i].vector = p[3:], p[:3]
        mesh.use_auto_smooth = True
        mesh.normals_split_custom_set([NORMALS[i // 4] for i in range(4 * len(POINTS))])
        material = bpy.data.materials.new("m")
        material.use_nodes = True
        material.node_tree.nodes.clear()
        build(material.node_tree, types, nodes, output, sign)
        mesh.materials.append(material)
        scene.collection.objects.link(bpy.data.objects.new("row", mesh))
    camera = bpy.data.cameras.new("c")
    camera.type, camera.ortho_scale = "ORTHO", max(len(POINTS), len(rows))
    eye = bpy.data.objects.new("c", camera)
    eye.location = (len(POINTS) / 2, len(rows) / 2, 5)
    scene.collection.objects.link(eye)
    scene.camera = eye
    scene.render.engine = "CYCLES"
    c = scene.cycles
    c.samples, c.use_denoising, c.use_adaptive_sampling, c.filter_width, c.sample_clamp_indirect = 1, False, False, 0.01, 0
    scene.render.resolution_x, scene.render.resolution_y, scene.render.resolution_percentage = len(POINTS), len(rows), 100
    scene.render.image_settings.file_format, scene.render.image_settings.color_depth = "OPEN_EXR", "32"
    with tempfile.TemporaryDirectory() as folder:
        scene.render.filepath = folder + "/out.exr"
        bpy.ops.render.render(write_still=True)
        image = bpy.data.images.load(folder + "/out.exr")
        image.colorspace_settings.name = "Non-Color"
        pixels = list(image.pixels)
    n = len(POINTS)
    return [[pixels[4 * (y * n + x):4 * (y * n + x) + 3] for x in range(n)] for y in range(len(rows))]


def main():
    out = sys.argv[sys.argv.index("--") + 1]
    todo = [(name, needed(nodes, output), output) for name, nodes, output in cases()]
    picture = render([(nodes, output, sign) for _, nodes, output in todo for sign in (1, -1)])
    lines = []
    for k, (name, nodes, output) in enumerate(todo):
        up, down = picture[2 * k], picture[2 * k + 1]
        values = [[float(f"{a - b:.7g}") for a, b in zip(p, q)] for p, q in zip(up, down)]
        lines.append(json.dumps({"name": name, "node": nodes[-1], "output": output, "values": values}))
    with open(out, "w") as f:
        f.write('{"blender": "%s",\n"points": %s,\n"normals": %s,\n"base": %s,\n"cases": [\n%s\n]}\n' % (bpy.app.version_string, json.dumps(POINTS), json.dumps(NORMALS), json.dumps(BASE), ",\n".join(lines)))
    print(len(lines), "cases")


main()
