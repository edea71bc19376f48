"""Values of nodes whose inputs are all constant, with the formulas of docs/texture-graph.md's nodes.

Only what trees use to make constants is here; anything else stays a node, which the renderer folds.
"""
from __future__ import annotations

import colorsys
import math
from typing import Any, Callable

from . import spectrum

# A number is a float, a vector has 3 parts, a colour 4 (whose alpha nobody looks at).
Constant = Any
LUMINANCE = (0.2126729, 0.7151522, 0.0721750)


def as_number(value: Constant) -> float:
    if isinstance(value, tuple):
        if len(value) == 4:
            return sum(c * k for c, k in zip(value, LUMINANCE))
        return sum(value) / 3
    return float(value)


def as_triple(value: Constant) -> tuple[float, float, float]:
    return tuple(value[:3]) if isinstance(value, tuple) else (float(value),) * 3


def _clamp(x: float) -> float:
    return min(max(x, 0.0), 1.0)


def _divide(a: float, b: float) -> float:
    return a / b if b else 0.0


def _power(a: float, b: float) -> float:
    try:
        value = a ** b
        return value if isinstance(value, float) else 0.0
    except (ArithmeticError, ValueError):
        return 0.0


_MATH: dict[str, Callable[[float, float, float], float]] = {
    "ADD": lambda a, b, c: a + b, "SUBTRACT": lambda a, b, c: a - b, "MULTIPLY": lambda a, b, c: a * b,
    "DIVIDE": lambda a, b, c: _divide(a, b), "MULTIPLY_ADD": lambda a, b, c: a * b + c,
    "POWER": lambda a, b, c: _power(a, b), "SQRT": lambda a, b, c: math.sqrt(a) if a > 0 else 0.0,
    "ABSOLUTE": lambda a, b, c: abs(a), "MINIMUM": lambda a, b, c: min(a, b), "MAXIMUM": lambda a, b, c: max(a, b),
    "LESS_THAN": lambda a, b, c: float(a < b), "GREATER_THAN": lambda a, b, c: float(a > b),
    "SIGN": lambda a, b, c: float((a > 0) - (a < 0)), "FLOOR": lambda a, b, c: float(math.floor(a)),
    "CEIL": lambda a, b, c: float(math.ceil(a)), "FRACT": lambda a, b, c: a - math.floor(a),
    "SINE": lambda a, b, c: math.sin(a), "COSINE": lambda a, b, c: math.cos(a),
    "RADIANS": lambda a, b, c: math.radians(a), "DEGREES": lambda a, b, c: math.degrees(a)}

_BLEND: dict[str, Callable[[float, float, float], float]] = {
    "MIX": lambda t, a, b: a + (b - a) * t, "ADD": lambda t, a, b: a + b * t, "MULTIPLY": lambda t, a, b: a + (a * b - a) * t,
    "SUBTRACT": lambda t, a, b: a - b * t, "SCREEN": lambda t, a, b: 1 - ((1 - t) + t * (1 - b)) * (1 - a),
    "DARKEN": lambda t, a, b: a + (min(a, b) - a) * t, "LIGHTEN": lambda t, a, b: a + (max(a, b) - a) * t,
    "DIFFERENCE": lambda t, a, b: a + (abs(a - b) - a) * t, "DIVIDE": lambda t, a, b: (1 - t) * a + t * a / b if b else a}


def _color(rgb: Any) -> Constant:
    return (*(float(c) for c in rgb), 1.0)


def _math(n: dict[str, Any], i: Callable[[str, Any], Constant]) -> dict[str, Constant] | None:
    f = _MATH.get(n.get("operation", "ADD"))
    if f is None:
        return None
    x = f(*(as_number(i(s, 0.5)) for s in ("Value", "Value_001", "Value_002")))
    return {"Value": _clamp(x) if n.get("use_clamp") else x}


def _vector_math(n: dict[str, Any], i: Callable[[str, Any], Constant]) -> dict[str, Constant] | None:
    a, b = as_triple(i("Vector", 0)), as_triple(i("Vector_001", 0))
    operation = n.get("operation", "ADD")
    if operation in ("ADD", "SUBTRACT", "MULTIPLY", "DIVIDE", "MINIMUM", "MAXIMUM"):
        return {"Vector": tuple(_MATH[operation](x, y, 0) for x, y in zip(a, b))}
    if operation == "SCALE":
        scale = as_number(i("Scale", 1))
        return {"Vector": tuple(x * scale for x in a)}
    if operation == "DOT_PRODUCT":
        return {"Value": sum(x * y for x, y in zip(a, b))}
    if operation == "LENGTH":
        return {"Value": math.sqrt(sum(x * x for x in a))}
    if operation == "NORMALIZE":
        length = math.sqrt(sum(x * x for x in a))
        return {"Vector": tuple(_divide(x, length) for x in a)}
    return None


def _mixed(mode: str, t: float, a: Any, b: Any, clamp: bool) -> Constant | None:
    f = _BLEND.get(mode)
    if f is None:
        return None
    rgb = [f(t, x, y) for x, y in zip(a, b)]
    return _color(_clamp(c) for c in rgb) if clamp else _color(rgb)


def _mix_rgb(n: dict[str, Any], i: Callable[[str, Any], Constant]) -> dict[str, Constant] | None:
    c = _mixed(n.get("blend_type", "MIX"), _clamp(as_number(i("Fac", 0.5))), as_triple(i("Color1", 0.5)), as_triple(i("Color2", 0.5)),
               n.get("use_clamp", False))
    return None if c is None else {"Color": c}


def _mix(n: dict[str, Any], i: Callable[[str, Any], Constant]) -> dict[str, Constant] | None:
    t, kind = as_number(i("Factor_Float", 0.5)), n.get("data_type", "FLOAT")
    if n.get("clamp_factor", True):
        t = _clamp(t)
    if kind == "FLOAT":
        a, b = as_number(i("A_Float", 0)), as_number(i("B_Float", 0))
        return {"Result_Float": a + (b - a) * t}
    if kind == "RGBA":
        c = _mixed(n.get("blend_type", "MIX"), t, as_triple(i("A_Color", 0.5)), as_triple(i("B_Color", 0.5)), n.get("clamp_result", False))
        return None if c is None else {"Result_Color": c}
    if n.get("factor_mode", "UNIFORM") != "UNIFORM":
        return None
    return {"Result_Vector": tuple(x + (y - x) * t for x, y in zip(as_triple(i("A_Vector", 0)), as_triple(i("B_Vector", 0))))}


def _map_range(n: dict[str, Any], i: Callable[[str, Any], Constant]) -> dict[str, Constant] | None:
    if n.get("data_type", "FLOAT") != "FLOAT" or n.get("interpolation_type", "LINEAR") != "LINEAR":
        return None
    v, a, b, c, d = (as_number(i(s, x)) for s, x in (("Value", 1), ("From Min", 0), ("From Max", 1), ("To Min", 0), ("To Max", 1)))
    x = c + (v - a) / (b - a) * (d - c) if a != b else 0.0
    return {"Result": min(max(x, min(c, d)), max(c, d)) if n.get("clamp", True) else x}


def _clamp_node(n: dict[str, Any], i: Callable[[str, Any], Constant]) -> dict[str, Constant]:
    x, low, high = (as_number(i(s, d)) for s, d in (("Value", 1), ("Min", 0), ("Max", 1)))
    if n.get("clamp_type", "MINMAX") == "RANGE":
        low, high = min(low, high), max(low, high)
    return {"Result": min(max(x, low), high)}


def _hue_saturation(n: dict[str, Any], i: Callable[[str, Any], Constant]) -> dict[str, Constant]:
    c = as_triple(i("Color", 0.8))
    h, s, v = colorsys.rgb_to_hsv(*c)
    h = (h + as_number(i("Hue", 0.5)) + 0.5) % 1
    turned = colorsys.hsv_to_rgb(h, _clamp(s * as_number(i("Saturation", 1))), v * as_number(i("Value", 1)))
    t = as_number(i("Fac", 1))
    return {"Color": _color(max(a + (b - a) * t, 0.0) for a, b in zip(c, turned))}


def _separate(n: dict[str, Any], i: Callable[[str, Any], Constant]) -> dict[str, Constant] | None:
    c, mode = as_triple(i("Color", 0.8)), n.get("mode", "RGB")
    if mode == "HSL":
        return None
    return dict(zip(("Red", "Green", "Blue"), c if mode == "RGB" else colorsys.rgb_to_hsv(*c)))


def _combine(n: dict[str, Any], i: Callable[[str, Any], Constant]) -> dict[str, Constant] | None:
    c, mode = [as_number(i(s, 0)) for s in ("Red", "Green", "Blue")], n.get("mode", "RGB")
    if mode == "HSL":
        return None
    return {"Color": _color(c if mode == "RGB" else colorsys.hsv_to_rgb(*c))}


def _bright_contrast(n: dict[str, Any], i: Callable[[str, Any], Constant]) -> dict[str, Constant]:
    bright, contrast = as_number(i("Bright", 0)), as_number(i("Contrast", 0))
    return {"Color": _color(max(x * (contrast + 1) + bright - contrast * 0.5, 0.0) for x in as_triple(i("Color", 1)))}


def _gamma(n: dict[str, Any], i: Callable[[str, Any], Constant]) -> dict[str, Constant]:
    g = as_number(i("Gamma", 1))
    return {"Color": _color(_power(x, g) if x > 0 else x for x in as_triple(i("Color", 1))) if g else _color((1, 1, 1))}


def _invert(n: dict[str, Any], i: Callable[[str, Any], Constant]) -> dict[str, Constant]:
    t = as_number(i("Fac", 1))
    return {"Color": _color(x + (1 - 2 * x) * t for x in as_triple(i("Color", 0)))}


_NODES: dict[str, Callable[..., dict[str, Constant] | None]] = {
    "MATH": _math, "VECT_MATH": _vector_math, "MIX_RGB": _mix_rgb, "MIX": _mix, "MAP_RANGE": _map_range, "CLAMP": _clamp_node,
    "HUE_SAT": _hue_saturation, "SEPARATE_COLOR": _separate, "COMBINE_COLOR": _combine, "BRIGHTCONTRAST": _bright_contrast,
    "GAMMA": _gamma, "INVERT": _invert,
    "BLACKBODY": lambda n, i: {"Color": _color(spectrum.blackbody(as_number(i("Temperature", 1500))))},
    "RGBTOBW": lambda n, i: {"Val": as_number(_color(as_triple(i("Color", 0.5))))},
    "SEPXYZ": lambda n, i: dict(zip("XYZ", as_triple(i("Vector", 0)))),
    "COMBXYZ": lambda n, i: {"Vector": tuple(as_number(i(s, 0)) for s in "XYZ")},
    "SEPRGB": lambda n, i: dict(zip("RGB", as_triple(i("Image", 0.8)))),
    "COMBRGB": lambda n, i: {"Image": _color(as_number(i(s, 0)) for s in "RGB")}}


def folded(node: dict[str, Any], inputs: dict[str, Constant]) -> dict[str, Constant] | None:
    """Outputs of a node by identifier, or None if it is not folded here. `inputs` are all constant."""
    f = _NODES.get(node["type"])
    if f is None:
        return None
    try:
        return f(node, lambda socket, fallback: inputs.get(socket, fallback))
    except (ArithmeticError, ValueError):
        return None
