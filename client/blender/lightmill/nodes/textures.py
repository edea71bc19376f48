"""Texture nodes of Blender as nodes of a texture graph."""
from __future__ import annotations

from typing import Any, Callable

from .graph import Graph, Value, constant_of_socket, kind_of_socket
from .tree import Scope, Source

# Nodes that the graph has by the same names: their properties, and the inputs that the graph's node knows.
PLAIN: dict[str, tuple[tuple[str, ...], tuple[str, ...]]] = {
    "TEX_NOISE": (("noise_dimensions",), ("Vector", "W", "Scale", "Detail", "Roughness", "Distortion")),
    "TEX_MUSGRAVE": (("musgrave_dimensions", "musgrave_type"),
                     ("Vector", "W", "Scale", "Detail", "Dimension", "Lacunarity", "Offset", "Gain")),
    "TEX_VORONOI": (("voronoi_dimensions", "feature", "distance"), ("Vector", "W", "Scale", "Smoothness", "Exponent", "Randomness")),
    "TEX_WHITE_NOISE": (("noise_dimensions",), ("Vector", "W")),
    "TEX_WAVE": (("wave_type", "bands_direction", "rings_direction", "wave_profile"),
                 ("Vector", "Scale", "Distortion", "Detail", "Detail Scale", "Detail Roughness", "Phase Offset")),
    "TEX_GRADIENT": (("gradient_type",), ("Vector",)),
    "TEX_MAGIC": (("turbulence_depth",), ("Vector", "Scale", "Distortion")),
    "TEX_CHECKER": ((), ("Vector", "Color1", "Color2", "Scale")),
    "TEX_BRICK": (("offset", "offset_frequency", "squash", "squash_frequency"),
                  ("Vector", "Color1", "Color2", "Mortar", "Scale", "Mortar Size", "Mortar Smooth", "Bias", "Brick Width", "Row Height")),
    "MIX_RGB": (("blend_type", "use_clamp"), ("Fac", "Color1", "Color2")),
    "MIX": (("data_type", "factor_mode", "blend_type", "clamp_factor", "clamp_result"),
            ("Factor_Float", "Factor_Vector", "A_Float", "B_Float", "A_Vector", "B_Vector", "A_Color", "B_Color")),
    "HUE_SAT": ((), ("Hue", "Saturation", "Value", "Fac", "Color")),
    "BRIGHTCONTRAST": ((), ("Color", "Bright", "Contrast")),
    "GAMMA": ((), ("Color", "Gamma")),
    "INVERT": ((), ("Fac", "Color")),
    "MAPPING": (("vector_type",), ("Vector", "Location", "Rotation", "Scale")),
    "VECTOR_ROTATE": (("rotation_type", "invert"), ("Vector", "Center", "Axis", "Angle", "Rotation")),
    "VECT_MATH": (("operation",), ("Vector", "Vector_001", "Vector_002", "Scale")),
    "MATH": (("operation", "use_clamp"), ("Value", "Value_001", "Value_002")),
    "MAP_RANGE": (("data_type", "interpolation_type", "clamp"),
                  ("Value", "From Min", "From Max", "To Min", "To Max", "Steps", "Vector", "From_Min_FLOAT3", "From_Max_FLOAT3",
                   "To_Min_FLOAT3", "To_Max_FLOAT3", "Steps_FLOAT3")),
    "CLAMP": (("clamp_type",), ("Value", "Min", "Max")),
    "SEPARATE_COLOR": (("mode",), ("Color",)), "COMBINE_COLOR": (("mode",), ("Red", "Green", "Blue")),
    "SEPXYZ": ((), ("Vector",)), "COMBXYZ": ((), ("X", "Y", "Z")), "SEPRGB": ((), ("Image",)), "COMBRGB": ((), ("R", "G", "B")),
    "SEPHSV": ((), ("Color",)), "COMBHSV": ((), ("H", "S", "V")), "RGBTOBW": ((), ("Color",)),
    "BLACKBODY": ((), ("Temperature",)), "FRESNEL": ((), ("IOR", "Normal")), "LAYER_WEIGHT": ((), ("Blend", "Normal"))}

# Without an input these take coordinates of the point: the graph's own default, so nothing is written.
GENERATED = {"TEX_NOISE", "TEX_MUSGRAVE", "TEX_VORONOI", "TEX_WHITE_NOISE", "TEX_WAVE", "TEX_GRADIENT", "TEX_MAGIC", "TEX_CHECKER",
             "TEX_BRICK"}
# What newer versions of Blender name in another way.
_INPUT_NAMES = {("VECT_MATH", "Vector_003"): "Vector_002"}


def inputs_of(node: Any, scope: Scope) -> list[Source]:
    """What a node must wait for."""
    if node.type == "BUMP":
        return []  # here it is only its base (normals.py)
    sources = []
    for socket in node.inputs:
        if socket.enabled and socket.type not in ("SHADER", "STRING"):
            source = scope.source(socket)
            if source.linked:
                sources.append(source)
    return sources


def plain_inputs(graph: Graph, node: Any, scope: Scope, known: tuple[str, ...]) -> dict[str, Value]:
    inputs: dict[str, Value] = {}
    for socket in node.inputs:
        if not socket.enabled:
            continue
        name = _INPUT_NAMES.get((node.type, socket.identifier), socket.identifier)
        linked = graph.is_linked(socket, scope)
        if name not in known:
            if linked or socket.type in ("VALUE", "VECTOR", "RGBA"):
                graph.report(f"input {node.type} {name}", node.name, f"the input {socket.name} is of a newer Blender and not looked at")
            continue
        if not linked and name == "Normal":
            continue  # the surface's own
        if not linked and name == "Vector" and node.type in GENERATED:
            graph.uses.add("generated")
            continue
        value = graph.value(socket, scope)
        # Colours keep their kind, vectors have three parts.
        inputs[name] = value
    return inputs


def _plain(graph: Graph, source: Source) -> Value:
    node = source.node
    properties, known = PLAIN[node.type]
    parameters = {}
    for name in properties:
        value = getattr(node, name, None)
        if value is not None:
            parameters[name] = value
    return graph.add(node.type, source.socket.identifier, kind_of_socket(source.socket), plain_inputs(graph, node, source.scope, known),
                     **parameters)


Translator = Callable[[Graph, Source], Value]
TRANSLATORS: dict[str, Translator] = {type_: _plain for type_ in PLAIN}


def _translators() -> dict[str, Translator]:
    if "TEX_COORD" not in TRANSLATORS:
        from . import curves, image_nodes, inputs, normals, object_inputs, tangents

        for module in (curves, image_nodes, inputs, normals, object_inputs, tangents):
            TRANSLATORS.update(module.TRANSLATORS)
    return TRANSLATORS


def output_of(graph: Graph, source: Source) -> Value:
    """The value of a node's output; its inputs are there already."""
    translate = _translators().get(source.node.type)
    if translate is None:
        graph.report(f"node {source.node.type}", source.node.name,
                     f"{source.node.bl_rna.name} is not supported; its output {source.socket.name} has the value that the socket shows")
        return constant_of_socket(source.socket)
    return translate(graph, source)
