"""Trees whose colour is compared between Cycles and the exported graph. Runs in Blender.

A case is a name and a function that builds nodes in a tree and returns the socket to look at. `Make` is the builder.
"""
import itertools
import random

import bpy

CASES = []


def case(name):
    def keep(build):
        CASES.append((name, build))
        return build

    return keep


class Make:
    """Adds nodes to a tree, by the names of Blender's types without "ShaderNode"."""

    def __init__(self, tree, thing):
        self.tree, self.thing = tree, thing

    def add(self, kind, links=None, **values):
        """`values` are properties of the node, or values of inputs by identifier (spaces as in Blender); `links` sockets by input."""
        node = self.tree.nodes.new(kind if kind.startswith("NodeReroute") else "ShaderNode" + kind)
        for name, value in values.items():
            if name in node.bl_rna.properties:
                setattr(node, name, value)
        for name, value in values.items():
            if name not in node.bl_rna.properties:
                self.input(node, name).default_value = value
        for name, socket in (links or {}).items():
            self.tree.links.new(socket, self.input(node, name))
        return node

    @staticmethod
    def input(node, name):
        return next(s for s in node.inputs if s.identifier == name)

    @staticmethod
    def output(node, name=None):
        return next(s for s in node.outputs if s.enabled and name in (None, s.identifier))

    def coordinates(self, name="Object"):
        return self.add("TexCoord").outputs[name]


def uses(kind, **enums):
    """All choices of a node, one property varied at a time."""
    first = {k: v[0] for k, v in enums.items()}
    yield first
    for key, values in enums.items():
        for value in values[1:]:
            yield {**first, key: value}



DIMENSIONS = ["3D", "1D", "2D", "4D"]
TEXTURES = {
    "TexNoise": (dict(noise_dimensions=DIMENSIONS), {"Scale": 2.3, "Detail": 2.6, "Roughness": 0.6, "Distortion": 0.4, "W": 0.7}),
    "TexMusgrave": (dict(musgrave_dimensions=DIMENSIONS, musgrave_type=["FBM", "MULTIFRACTAL", "RIDGED_MULTIFRACTAL", "HYBRID_MULTIFRACTAL", "HETERO_TERRAIN"]),
                    {"Scale": 2.1, "Detail": 2.4, "Dimension": 0.9, "Lacunarity": 2.2, "Offset": 0.6, "Gain": 1.2, "W": 0.4}),
    "TexVoronoi": (dict(voronoi_dimensions=DIMENSIONS, feature=["F1", "F2", "SMOOTH_F1", "DISTANCE_TO_EDGE", "N_SPHERE_RADIUS"],
                        distance=["EUCLIDEAN", "MANHATTAN", "CHEBYCHEV", "MINKOWSKI"]),
                   {"Scale": 2.7, "Randomness": 0.8, "Smoothness": 0.6, "Exponent": 1.5, "W": 0.3}),
    "TexWhiteNoise": (dict(noise_dimensions=DIMENSIONS), {"W": 0.7}),
    "TexWave": (dict(wave_type=["BANDS", "RINGS"], bands_direction=["X", "Y", "Z", "DIAGONAL"], rings_direction=["X", "Y", "Z", "SPHERICAL"],
                     wave_profile=["SIN", "SAW", "TRI"]),
                {"Scale": 0.7, "Distortion": 1.1, "Detail": 1.5, "Detail Scale": 1.3, "Detail Roughness": 0.4, "Phase Offset": 0.3}),
    "TexGradient": (dict(gradient_type=["LINEAR", "QUADRATIC", "EASING", "DIAGONAL", "SPHERICAL", "QUADRATIC_SPHERE", "RADIAL"]), {}),
    "TexMagic": (dict(turbulence_depth=[2, 0, 5, 9]), {"Scale": 1.3, "Distortion": 0.8}),
    "TexChecker": ({}, {"Scale": 3.1, "Color1": (0.8, 0.2, 0.1, 1), "Color2": (0.1, 0.3, 0.9, 1)}),
    "TexBrick": (dict(offset=[0.5, 0.2], offset_frequency=[2, 3], squash=[1.0, 0.6], squash_frequency=[2, 3]),
                 {"Scale": 2.4, "Mortar Size": 0.08, "Mortar Smooth": 0.4, "Bias": 0.2, "Color1": (0.8, 0.2, 0.1, 1), "Color2": (0.1, 0.3, 0.9, 1)})}

for kind, (enums, values) in TEXTURES.items():
    for choice in uses(kind, **enums):
        if kind == "TexWhiteNoise" and choice["noise_dimensions"] != "1D":
            continue  # its value differs at every point: no two renderers agree on the last bit

        def build(m, kind=kind, choice=choice, values=values):
            node = m.add(kind, **choice)
            for name, value in values.items():
                socket = next((s for s in node.inputs if s.identifier == name), None)
                if socket is not None:
                    socket.default_value = value
            if m.input(node, "Vector").enabled:
                m.tree.links.new(m.coordinates(), m.input(node, "Vector"))
            return next((s for s in node.outputs if s.enabled and s.type == "RGBA"), None) or m.output(node)

        CASES.append((f"{kind} {choice}", build))
    if kind != "TexWhiteNoise":
        CASES.append((f"{kind} without a vector", lambda m, kind=kind: m.output(m.add(kind))))

for name in ("Generated", "Object", "UV", "Normal", "Camera", "Window"):
    CASES.append((f"coordinates {name}", lambda m, name=name: m.coordinates(name)))


@case("coordinates of another object")
def _(m):
    node = m.add("TexCoord")
    node.object = bpy.data.objects["other"]
    return node.outputs["Object"]


for name in ("Position", "Normal", "True Normal"):
    CASES.append((f"geometry {name}", lambda m, name=name: m.add("NewGeometry").outputs[name]))
for name in ("View Vector", "View Z Depth", "View Distance"):
    CASES.append((f"camera data {name}", lambda m, name=name: m.add("CameraData").outputs[name]))
for name in ("Location", "Color", "Alpha", "Object Index", "Material Index", "Random"):
    CASES.append((f"object info {name}", lambda m, name=name: m.add("ObjectInfo").outputs[name]))
for uv_map in ("UVMap", "Second", ""):
    CASES.append((f"uv map {uv_map!r}", lambda m, uv_map=uv_map: m.add("UVMap", uv_map=uv_map).outputs[0]))
for kind, name in itertools.product(("OBJECT", "GEOMETRY", "VIEW_LAYER"), ("Color", "Vector", "Fac", "Alpha")):
    where = {"OBJECT": "tint", "GEOMETRY": "Second", "VIEW_LAYER": "scene_tint"}[kind]
    CASES.append((f"attribute {kind} {name}", lambda m, kind=kind, name=name, where=where:
                  m.add("Attribute", attribute_type=kind, attribute_name=where).outputs[name]))
for kind, (convert_from, convert_to) in itertools.product(("POINT", "VECTOR", "NORMAL"), (("WORLD", "OBJECT"), ("OBJECT", "WORLD"), ("WORLD", "CAMERA"), ("CAMERA", "OBJECT"))):
    def build(m, kind=kind, a=convert_from, b=convert_to):
        node = m.add("VectorTransform", {"Vector": m.coordinates()}, vector_type=kind, convert_from=a, convert_to=b)
        return node.outputs[0]

    CASES.append((f"vector transform {kind} {convert_from} {convert_to}", build))

for operation in bpy.types.ShaderNodeMath.bl_rna.properties["operation"].enum_items.keys():
    def build(m, operation=operation):
        xyz = m.add("SeparateXYZ", {"Vector": m.coordinates("Generated")})
        return m.add("Math", {"Value": xyz.outputs[0], "Value_001": xyz.outputs[1]}, operation=operation, Value_002=0.3).outputs[0]

    CASES.append((f"math {operation}", build))
for operation in bpy.types.ShaderNodeVectorMath.bl_rna.properties["operation"].enum_items.keys():
    def build(m, operation=operation):
        node = m.add("VectorMath", {"Vector": m.coordinates()}, operation=operation)
        for name, value in (("Vector_001", (0.7, -0.4, 0.9)), ("Vector_002", (0.2, 0.5, 0.3))):
            m.input(node, name).default_value = value
        m.input(node, "Scale").default_value = 0.6
        return m.output(node)

    CASES.append((f"vector math {operation}", build))
for mode in bpy.types.ShaderNodeMixRGB.bl_rna.properties["blend_type"].enum_items.keys():
    def build(m, mode=mode):
        return m.add("MixRGB", {"Color1": m.coordinates("Generated")}, blend_type=mode, Fac=0.7, Color2=(0.3, 0.6, 0.2, 1)).outputs[0]

    def build_mix(m, mode=mode):
        node = m.add("Mix", data_type="RGBA", blend_type=mode, clamp_result=True)
        node.inputs["Factor"].default_value = 0.6
        m.tree.links.new(m.coordinates("Generated"), m.input(node, "A_Color"))
        m.input(node, "B_Color").default_value = (0.2, 0.7, 0.4, 1)
        return m.output(node)

    CASES += [(f"mix rgb {mode}", build), (f"mix {mode}", build_mix)]


@case("mix floats")
def _(m):
    node = m.add("Mix", data_type="FLOAT", A_Float=0.2, B_Float=0.9)
    m.tree.links.new(m.add("SeparateXYZ", {"Vector": m.coordinates("Generated")}).outputs[0], m.input(node, "Factor_Float"))
    return m.output(node)


@case("mix vectors with a factor each")
def _(m):
    node = m.add("Mix", data_type="VECTOR", factor_mode="NON_UNIFORM", A_Vector=(0.2, 0.1, 0.8), B_Vector=(0.9, 0.3, 0.1))
    m.tree.links.new(m.coordinates("Generated"), m.input(node, "Factor_Vector"))
    return m.output(node)


for kind in ("POINT", "TEXTURE", "VECTOR", "NORMAL"):
    CASES.append((f"mapping {kind}", lambda m, kind=kind: m.add("Mapping", {"Vector": m.coordinates()}, vector_type=kind, Rotation=(0.4, -1.1, 2.3),
                                                                 Scale=(1.5, 0.6, -0.8)).outputs[0]))
for kind, invert in itertools.product(("AXIS_ANGLE", "X_AXIS", "Y_AXIS", "Z_AXIS", "EULER_XYZ"), (False, True)):
    CASES.append((f"vector rotate {kind} {invert}", lambda m, kind=kind, invert=invert:
                  m.add("VectorRotate", {"Vector": m.coordinates()}, rotation_type=kind, invert=invert).outputs[0]))
for kind, clamp in itertools.product(("LINEAR", "STEPPED", "SMOOTHSTEP", "SMOOTHERSTEP"), (False, True)):
    def build(m, kind=kind, clamp=clamp):
        value = m.add("SeparateXYZ", {"Vector": m.coordinates("Generated")}).outputs[0]
        return m.output(m.add("MapRange", {"Value": value}, interpolation_type=kind, clamp=clamp, **{"From Min": 0.1, "From Max": 0.8, "To Min": 0.9, "To Max": 0.2}))

    def build_vector(m, kind=kind, clamp=clamp):
        return m.output(m.add("MapRange", {"Vector": m.coordinates("Generated")}, data_type="FLOAT_VECTOR", interpolation_type=kind, clamp=clamp,
                              From_Max_FLOAT3=(0.7, 0.9, 1.2)))

    CASES += [(f"map range {kind} {clamp}", build), (f"map range vector {kind} {clamp}", build_vector)]
for kind in ("MINMAX", "RANGE"):
    CASES.append((f"clamp {kind}", lambda m, kind=kind: m.add("Clamp", {"Value": m.coordinates("Generated")}, clamp_type=kind, Min=0.7, Max=0.3).outputs[0]))
for mode in ("RGB", "HSV", "HSL"):
    def build(m, mode=mode):
        apart = m.add("SeparateColor", {"Color": m.coordinates("Generated")}, mode=mode)
        return m.add("CombineColor", {"Red": apart.outputs[1], "Green": apart.outputs[2], "Blue": apart.outputs[0]}, mode=mode).outputs[0]

    CASES.append((f"separate and combine {mode}", build))
for name, kind, values in (("hue saturation", "HueSaturation", {"Hue": 0.7, "Saturation": 1.3, "Value": 0.8, "Fac": 0.9}),
                           ("bright contrast", "BrightContrast", {"Bright": 0.1, "Contrast": 0.4}), ("gamma", "Gamma", {"Gamma": 1.7}),
                           ("invert", "Invert", {"Fac": 0.7}), ("grey", "RGBToBW", {})):
    CASES.append((name, lambda m, kind=kind, values=values: m.add(kind, {"Color": m.coordinates("Generated")}, **values).outputs[0]))


@case("blackbody")
def _(m):
    x = m.add("SeparateXYZ", {"Vector": m.coordinates("Generated")}).outputs[0]
    return m.add("Blackbody", {"Temperature": m.add("Math", {"Value": x}, operation="MULTIPLY", Value_001=9000).outputs[0]}).outputs[0]


@case("blackbody constant")
def _(m):
    return m.add("Blackbody", Temperature=4300).outputs[0]


for nm in (450, 520, 580, 640):
    CASES.append((f"wavelength {nm}", lambda m, nm=nm: m.add("Wavelength", Wavelength=nm).outputs[0]))


@case("wavelength that varies")
def _(m):
    x = m.add("SeparateXYZ", {"Vector": m.coordinates("Generated")}).outputs[0]
    return m.add("Wavelength", {"Wavelength": m.add("MapRange", {"Value": x}, **{"To Min": 370, "To Max": 790}).outputs[0]}).outputs[0]


@case("normal")
def _(m):
    node = m.add("Normal", {"Normal": m.coordinates()})
    node.outputs[0].default_value = (0.4, 0.6, 0.3)
    return node.outputs["Dot"]


def ramp(m, **settings):
    node = m.add("ValToRGB", {"Fac": m.add("SeparateXYZ", {"Vector": m.coordinates("Generated")}).outputs[0]})
    r = node.color_ramp
    r.elements.new(0.5)
    for e, (position, color) in zip(r.elements, ((0.15, (0.9, 0.1, 0.2, 1)), (0.45, (0.1, 0.8, 0.3, 0.5)), (0.8, (0.2, 0.1, 0.7, 1)))):
        e.position, e.color = position, color
    for name, value in settings.items():
        setattr(r, name, value)
    return node.outputs["Color"]


for kind in ("LINEAR", "EASE", "CONSTANT", "CARDINAL", "B_SPLINE"):
    CASES.append((f"ramp {kind}", lambda m, kind=kind: ramp(m, interpolation=kind)))
for mode, hue in itertools.product(("HSV", "HSL"), ("NEAR", "FAR", "CW", "CCW")):
    CASES.append((f"ramp {mode} {hue}", lambda m, mode=mode, hue=hue: ramp(m, color_mode=mode, hue_interpolation=hue)))


def bend(mapping):
    for i, curve in enumerate(mapping.curves):
        curve.points.new(0.3 + 0.1 * i, 0.6 - 0.1 * i)
        curve.points.new(0.7, 0.4 + 0.1 * i)
    mapping.update()


for kind, name, extend in itertools.product(("RGBCurve", "VectorCurve", "FloatCurve"), ("Generated", "Object"), ("EXTRAPOLATED", "HORIZONTAL")):
    def build(m, kind=kind, name=name, extend=extend):
        node = m.add(kind)
        bend(node.mapping)
        node.mapping.extend = extend
        node.mapping.update()
        m.tree.links.new(m.coordinates(name), node.inputs[1])
        return node.outputs[0]

    CASES.append((f"{kind} of {name} {extend}", build))


# Images.

def picture(kind):
    """A small picture, made once."""
    if kind in bpy.data.images:
        return bpy.data.images[kind]
    generator = random.Random(1)
    image = bpy.data.images.new(kind, 16, 8, float_buffer=kind.startswith("float"), alpha="alpha" in kind)
    if "data" in kind:
        image.colorspace_settings.name = "Non-Color"
    pixels = [generator.random() for _ in range(16 * 8 * 4)]
    for i in range(3, len(pixels), 4):
        pixels[i] = pixels[i] if "alpha" in kind else 1.0
        if "alpha" in kind and kind.startswith("float"):
            pixels[i - 3:i] = [c * pixels[i] for c in pixels[i - 3:i]]
    image.pixels = pixels
    image.update()
    if "packed" in kind:
        image.pack()
    return image


for kind in ("bytes", "bytes data", "bytes packed", "bytes alpha", "bytes alpha packed", "bytes alpha data", "float", "float packed", "float alpha"):
    for output in ("Color", "Alpha"):
        CASES.append((f"image {kind} {output}", lambda m, kind=kind, output=output:
                      m.add("TexImage", {"Vector": m.coordinates("UV")}, image=picture(kind), interpolation="Closest").outputs[output]))
for projection, extension, interpolation in itertools.product(("FLAT", "BOX", "SPHERE", "TUBE"), ("REPEAT", "EXTEND", "CLIP"), ("Linear", "Closest")):
    if projection == "BOX" and extension != "REPEAT":
        continue
    CASES.append((f"image {projection} {extension} {interpolation}", lambda m, p=projection, e=extension, i=interpolation:
                  m.add("TexImage", {"Vector": m.coordinates()}, image=picture("float"), projection=p, extension=e, interpolation=i, projection_blend=0.3).outputs[0]))
CASES.append(("image without a vector", lambda m: m.add("TexImage", image=picture("bytes"), interpolation="Closest").outputs[0]))
CASES.append(("image that is not there", lambda m: m.add("TexImage").outputs[0]))
CASES.append(("environment", lambda m: m.add("TexEnvironment", {"Vector": m.coordinates()}, image=picture("bytes"), interpolation="Closest").outputs[0]))


# Structure.

def group(build):
    """A node group with a colour, a number and a vector going in and one colour out."""
    tree = bpy.data.node_groups.new("group", "ShaderNodeTree")
    for kind, name in (("Color", "color"), ("Float", "number"), ("Vector", "vector")):
        tree.inputs.new("NodeSocket" + kind, name)
    tree.outputs.new("NodeSocketColor", "out")
    tree.inputs["number"].default_value = 0.4
    inside, outside = tree.nodes.new("NodeGroupInput"), tree.nodes.new("NodeGroupOutput")
    tree.links.new(build(Make(tree, None), inside.outputs), outside.inputs[0])
    return tree


def mixed_inside(m, given):
    return m.add("MixRGB", {"Fac": given["number"], "Color1": given["color"], "Color2": given["vector"]}).outputs[0]


@case("group")
def _(m):
    node = m.add("Group", node_tree=group(mixed_inside))
    m.tree.links.new(m.coordinates("Generated"), node.inputs["vector"])
    node.inputs["color"].default_value = (0.9, 0.2, 0.4, 1)
    return node.outputs[0]


@case("group with a colour for a number")
def _(m):
    node = m.add("Group", {}, node_tree=group(lambda g, given: g.add("CombineXYZ", {"X": given["number"], "Y": given["number"]}, Z=0.2).outputs[0]))
    m.tree.links.new(m.add("TexChecker", {"Vector": m.coordinates()}, Scale=4, Color1=(0.9, 0.1, 0.2, 1)).outputs[0], node.inputs["number"])
    return node.outputs[0]


@case("group in a group")
def _(m):
    inner = group(mixed_inside)

    def build(g, given):
        node = g.add("Group", node_tree=inner)
        g.tree.links.new(given["vector"], node.inputs["vector"])
        g.tree.links.new(given["color"], node.inputs["color"])
        return node.outputs[0]

    node = m.add("Group", node_tree=group(build))
    m.tree.links.new(m.coordinates("Generated"), node.inputs["color"])
    node.inputs["vector"].default_value = (0.1, 0.2, 0.3)
    return node.outputs[0]


@case("reroutes")
def _(m):
    socket = m.coordinates("Generated")
    for _ in range(3):
        node = m.add("NodeReroute")
        m.tree.links.new(socket, node.inputs[0])
        socket = node.outputs[0]
    return socket


@case("muted node")
def _(m):
    node = m.add("Invert", {"Color": m.coordinates("Generated")})
    node.mute = True
    return node.outputs[0]


@case("muted link")
def _(m):
    node = m.add("Gamma", Color=(0.2, 0.5, 0.7, 1), Gamma=1)
    m.tree.links.new(m.coordinates("Generated"), node.inputs["Color"]).is_muted = True
    return node.outputs[0]


@case("muted group")
def _(m):
    node = m.add("Group", node_tree=group(mixed_inside))
    m.tree.links.new(m.coordinates("Generated"), node.inputs["color"])
    node.mute = True
    return node.outputs[0]


@case("constants")
def _(m):
    value = m.add("Value")
    value.outputs[0].default_value = 0.35
    rgb = m.add("RGB")
    rgb.outputs[0].default_value = (0.3, 0.6, 0.9, 1)
    return m.add("MixRGB", {"Fac": value.outputs[0], "Color1": rgb.outputs[0]}, blend_type="MULTIPLY", Color2=(0.5, 0.6, 0.7, 1)).outputs[0]


@case("long chain")
def _(m):
    socket = m.coordinates("Generated")
    for _ in range(400):
        socket = m.add("VectorMath", {"Vector": socket}, operation="ADD", Vector_001=(0.001, 0, -0.0005)).outputs[0]
    return socket
