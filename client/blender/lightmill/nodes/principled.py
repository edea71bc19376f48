"""The Principled shader of Blender 3.4. Sockets of Blender 4 are taken by name; that is untested."""
from __future__ import annotations

from typing import Any

from . import normals, tangents
from .fold import as_number, as_triple
from .graph import Graph, Value, is_constant
from .shaders import SHADERS, Builder, Closure, Inner, Term, walkable
from .tree import Scope

# (names of the socket, parameter, kind, Blender's default), by the weight without which they don't count.
_SOCKETS: tuple[tuple[str | None, tuple[tuple[tuple[str, ...], str, str, Any], ...]], ...] = (
    (None, ((("Base Color",), "base_color", "spectrum", None), (("Metallic",), "metallic", "float", 0.0), (("Specular", "Specular IOR Level"), "specular", "float", 0.5),
            (("Specular Tint",), "specular_tint", "float", 0.0), (("Roughness",), "roughness", "float", 0.5), (("Anisotropic",), "anisotropic", "float", 0.0),
            (("Anisotropic Rotation",), "anisotropic_rotation", "float", 0.0), (("IOR",), "ior", "float", 1.45))),
    ("subsurface", ((("Subsurface", "Subsurface Weight"), "subsurface", "float", 0.0), (("Subsurface Radius",), "subsurface_radius", "spectrum", None),
                    (("Subsurface Color",), "subsurface_color", "spectrum", None), (("Subsurface IOR",), "subsurface_ior", "float", 1.4),
                    (("Subsurface Anisotropy",), "subsurface_anisotropy", "float", 0.0))),
    ("sheen", ((("Sheen", "Sheen Weight"), "sheen", "float", 0.0), (("Sheen Tint",), "sheen_tint", "float", 0.5))),
    ("clearcoat", ((("Clearcoat", "Coat Weight"), "clearcoat", "float", 0.0), (("Clearcoat Roughness", "Coat Roughness"), "clearcoat_roughness", "float", 0.03))),
    ("transmission", ((("Transmission", "Transmission Weight"), "transmission", "float", 0.0), (("Transmission Roughness",), "transmission_roughness", "float", 0.0))))
_COLORS = {"base_color", "subsurface_color"}


def _socket(inputs: dict[str, Any], names: tuple[str, ...]) -> Any:
    return next((inputs[n] for n in names if n in inputs), None)


def _parameters(b: Builder, node: Any, scope: Scope) -> list[str]:
    parameters = []
    inputs = {s.identifier: s for s in node.inputs}
    flat = b.is_flat(inputs["Subsurface Radius"], scope)
    for weight, rows in _SOCKETS:
        if weight == "subsurface" and flat:
            continue
        for names, name, kind, default in rows:
            socket = _socket(inputs, names)
            if socket is None or not socket.enabled:
                continue
            if kind == "float" and socket.type == "RGBA":  # a tint that is a colour in Blender 4
                if b.value(socket, scope)[1][:3] != (1.0, 1.0, 1.0):
                    b.report(f"input {socket.name}", node, f"{socket.name} as a colour is not supported; it is left out")
                continue
            graph, value = b.value(socket, scope)
            if name == "base_color" and flat:
                value = _color_of_flat_body(graph, value, inputs, scope)
                b.took(graph)
            if name == "subsurface_radius" and is_constant(value):
                value = walkable(value)
            if name == weight and is_constant(value) and as_number(value) <= 0:
                break  # what follows does not count
            if name == "subsurface_radius" and "Subsurface Scale" in node.inputs:
                value = graph.product(value, graph.value(node.inputs["Subsurface Scale"], scope))
            if is_constant(value) and default is not None and abs(as_number(value) - default) < 1e-7:
                continue
            if is_constant(value) and name in _COLORS:
                value = tuple(min(max(c, 0.0), 1.0) for c in as_triple(value))
            if kind == "float":
                value = graph.number(value)
            parameters.append(b.context.parameter(name, kind, graph, value, b.lines))
    return parameters


def _color_of_flat_body(graph: Graph, base: Value, inputs: dict[str, Any], scope: Scope) -> Value:
    """The colour of a body that light does not get into."""
    weight, color = _socket(inputs, ("Subsurface", "Subsurface Weight")), inputs.get("Subsurface Color")
    if weight is None or color is None:
        return base
    share = graph.clamped(graph.number(graph.value(weight, scope)))
    return graph.add("MIX_RGB", "Color", "color", {"Fac": share, "Color1": base, "Color2": graph.value(color, scope)}, blend_type="MIX")


def _principled(b: Builder, node: Any, scope: Scope, inner: Inner) -> Closure:
    parameters = _parameters(b, node, scope) if b.scatters else []
    distribution = getattr(node, "distribution", "GGX").lower()
    if distribution != "ggx":
        parameters.append(f'"string distribution" "{distribution}"')
    if getattr(node, "subsurface_method", "") == "BURLEY" and any(p.split()[1].startswith("subsurface") for p in parameters):
        b.report("subsurface", node, "Christensen-Burley subsurface scattering is drawn as random walk")
    if any(p.split()[1] == 'anisotropic"' for p in parameters):
        parameters += tangents.tangent_parameters(b, node.inputs["Tangent"], scope)
    for name in ("Clearcoat Normal", "Coat Normal"):
        if name in node.inputs and scope.source(node.inputs[name]).linked:
            b.report(f"input {name}", node, f"the input {name} is not looked at")
    if "Coat Tint" in node.inputs and b.constant(node, scope, "Thin Film Thickness") not in (None, 0.0):
        b.report("thin film", node, "thin films are not supported")
    parameters += normals.normal_parameters(b, node.inputs.get("Normal"), scope)
    closure = Closure(b.material("principled", parameters), _emitted(b, node, scope))
    alpha = node.inputs.get("Alpha")
    graph, value = b.value(alpha, scope)
    if is_constant(value) and as_number(value) >= 1:
        return closure
    clear = Closure(b.material("transparent_bsdf", ['"rgb color" [1 1 1]']))
    return Closure(b.mixed(graph, value, clear, closure), b.weighted(closure.terms, alpha, scope, False))


def _emitted(b: Builder, node: Any, scope: Scope) -> tuple[Term, ...]:
    color, strength = _socket({s.identifier: s for s in node.inputs}, ("Emission", "Emission Color")), node.inputs.get("Emission Strength")
    if color is None:
        return ()
    for socket in (color, strength):
        value = b.value(socket, scope)[1]
        if is_constant(value) and not any(as_triple(value)):
            return ()
    return (Term((color, scope), (strength, scope)),)


SHADERS["BSDF_PRINCIPLED"] = _principled
