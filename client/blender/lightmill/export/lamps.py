"""Blender's lamps, with the units of Cycles.

A lamp's energy P, in watts, times its colour and what its nodes give:

    point, spot  intensity P / (4 pi), W/sr
    sun          irradiance P, W/m2; of a disc of half angle a, P times the mean cosine over a disc of radius tan(a)
    area         radiance P / (4 A), of one side: a lamp of P watts gives pi / 4 of them

Measured with Cycles, and held by tests/blender/export/lamps.py. Cycles' lamps are not seen by the camera and cast no
shadow; the lamp's size grows with its object's scale only where it is an area.
"""
import math

from ..light_groups import parameter
from .camera import from_columns, without_scale
from .pbrt_text import columns, moving, numbers, quoted

ROUND = ("DISK", "ELLIPSE")
SIDES_OF_ROUND = 96  # of a polygon in place of an ellipse
BLACK = 'Material "diffuse_bsdf" "rgb color" [0 0 0]\n'
NEVER = 1024  # Cycles' default for the most bounces of a lamp's light


def lamp_lines(lamp, way, hidden, group, export):
    """Lines of a lamp. `lamp`: evaluated object; `way`: see Motion; `group`: its light group's name."""
    light = lamp.data
    settings = getattr(light, "cycles", None)
    if getattr(settings, "is_portal", False):
        return []  # guides Cycles' sampling and gives no light
    if light.type == "SUN" and export.hides_suns:
        return []  # as in Cycles
    note_unsupported(lamp, settings, export.report)
    if len(way) > 2:  # the reader's lights go straight
        way = (way[0], way[-1])
    power = [light.energy * c for c in light.color]
    radiance = radiance_of(light, power, way) if light.type == "AREA" else None  # of what a texture gives
    given = export.nodes.light(light, export.context, export.nodes.Place.of(lamp, is_lamp=True), tuple(radiance or (0.0, 0.0, 0.0)))
    hidden = tuple(dict.fromkeys(("camera", *hidden)))
    begin = ["AttributeBegin\n", *([f'Attribute "light"{parameter(group)}\n'] if group else ())]
    if given.pictures:
        return [*begin, rigid(way), *(pictured(color, file, hidden) for color, file in given.pictures), "AttributeEnd\n"]
    if given.texture:
        return [*begin, *given.lines, *textured(lamp, given.texture, way, hidden, export.report), "AttributeEnd\n"]
    color = [c * f for c, f in zip(power, given.rgb)]
    if max(map(abs, color)) == 0 or not all(map(math.isfinite, color)):
        return []
    if min(color) < 0:
        export.report.warn("negative lamp", lamp.name, "can't take light away; what is negative of its light is 0")
    color = [max(c, 0.0) for c in color]
    kind = {"POINT": point, "SPOT": spot, "SUN": sun, "AREA": panel if export.has_volumes else area}[light.type]
    return [*begin, *kind(light, color, way, hidden), "AttributeEnd\n"]


def note_unsupported(lamp, settings, report):
    if getattr(settings, "max_bounces", NEVER) < NEVER:
        report.warn("lamp bounces", lamp.name, "its light has no limit of bounces of its own")
    if not getattr(settings, "cast_shadow", True):
        report.warn("shadowless lamp", lamp.name, "its light casts shadows all the same")


def rigid(way):
    """The directives of a lamp that its object's scale does not touch."""
    return moving([columns(without_scale(from_columns(m))) for m in way])


def hidden_parameter(hidden):
    return f' "string hidden" [{" ".join(map(quoted, hidden))}]' if hidden else ""


def point(light, color, way, hidden):
    intensity = [c / (4 * math.pi) for c in color]
    radius = f' "float radius" {light.shadow_soft_size:.9g}' if light.shadow_soft_size > 0 else ""
    return [rigid(way), f'LightSource "point" "rgb I" {numbers(intensity)}{radius}{hidden_parameter(hidden)}\n']


def spot(light, color, way, hidden):
    intensity = [c / (4 * math.pi) for c in color]
    half = math.degrees(light.spot_size) / 2
    radius = f' "float radius" {light.shadow_soft_size:.9g}' if light.shadow_soft_size > 0 else ""
    return [rigid(way), f'LightSource "spot" "rgb I" {numbers(intensity)} "point3 to" [0 0 -1]'
            f' "float coneangle" {half:.9g} "float blend" {light.spot_blend:.9g}{radius}{hidden_parameter(hidden)}\n']


def pictured(color, file, hidden):
    """A lamp without size that shines as a picture says."""
    return f'LightSource "goniometric" "string filename" {quoted(file)} "rgb I" {numbers(color)}{hidden_parameter(hidden)}\n'


def sun(light, color, way, hidden):
    tangent = math.tan(min(light.angle / 2, math.radians(89.9)))
    if tangent > 1e-4:
        mean = 2 / (1 + math.sqrt(1 + tangent * tangent))  # = 2 (sqrt(1 + t^2) - 1) / t^2
        color = [c * mean for c in color]
    return [rigid(way), f'LightSource "distant" "rgb L" {numbers(color)} "point3 to" [0 0 -1]'
            f' "float angle" {min(math.degrees(light.angle) / 2, 89.9):.9g}{hidden_parameter(hidden)}\n']


def sides(light):
    return light.size, light.size_y if light.shape in ("RECTANGLE", "ELLIPSE") else light.size


def radiance_of(light, color, way):
    """Of an area lamp, W/(m2 sr); None if it has no area."""
    width, height = sides(light)
    m = from_columns(way[0])
    surface = (m.col[0].xyz * width).cross(m.col[1].xyz * height).length * (math.pi / 4 if light.shape in ROUND else 1)
    return [c / (4 * surface) for c in color] if surface > 0 else None


def panel(light, color, way, hidden):
    """As `area`, in a scene with volumes: there mirrors show shapes, and no lamps. Without a spread, which shapes do not
    have."""
    lines = area(light, color, way, hidden)
    if not lines or getattr(light, "spread", math.pi) < math.pi - 1e-3:
        return lines
    light_lines = [lines[0], BLACK, f'AreaLightSource "diffuse" "rgb L" {numbers(radiance_of(light, color, way))}\n']
    if light.shape in ROUND:
        x, y = (side / 2 for side in sides(light))
        return [*light_lines, f"Scale {x:.9g} {y:.9g} 1\nReverseOrientation\n", f'Shape "disk" "float radius" 1{unseen(hidden)}\n']
    return [*light_lines, face(light, hidden)]


def textured(lamp, texture, way, hidden, report):
    """An area lamp whose nodes give a texture: a shape that shines."""
    light = lamp.data
    if radiance_of(light, (0, 0, 0), way) is None:
        return []
    if getattr(light, "spread", math.pi) < math.pi - 1e-3:
        report.warn("lamp texture", lamp.name, "has a texture and a spread: its light spreads as from a sheet of paper")
    return [moving(way), BLACK, f'AreaLightSource "diffuse" "texture L" "{texture}"\n', face(light, hidden)]


def unseen(hidden):
    return hidden_parameter(tuple(dict.fromkeys((*hidden, "shadow"))))


def face(light, hidden):
    """A flat mesh that looks along -z, with texture coordinates of 0 to 1 over the lamp's sides."""
    width, height = sides(light)
    corners = [(-0.5, -0.5), (-0.5, 0.5), (0.5, 0.5), (0.5, -0.5)]
    if light.shape in ROUND:
        turn = 2 * math.pi / SIDES_OF_ROUND
        radius = 0.5 * math.sqrt(turn / math.sin(turn))  # of the same area as the round one
        corners = [(radius * math.sin(i * turn), radius * math.cos(i * turn)) for i in range(SIDES_OF_ROUND)]
    points = numbers(c for x, y in corners for c in (x * width, y * height, 0))
    coordinates = numbers(c + 0.5 for corner in corners for c in corner)
    triangles = " ".join(f"0 {i} {i + 1}" for i in range(1, len(corners) - 1))
    return (f'Shape "trianglemesh" "point3 P" {points} "point2 uv" {coordinates} "integer indices" [{triangles}]'
            f"{unseen(hidden)}\n")


def area(light, color, way, hidden):
    """A rectangle or an ellipse that shines along its -z."""
    radiance = radiance_of(light, color, way)
    if radiance is None:
        return []
    width, height = sides(light)
    is_round = light.shape in ROUND
    spread = getattr(light, "spread", math.pi)
    return [moving(way), f'LightSource "area" "string shape" "{"ellipse" if is_round else "rectangle"}"'
            f' "float width" {width:.9g} "float height" {height:.9g} "rgb L" {numbers(radiance)}'
            f' "float spread" {math.degrees(spread):.9g}{hidden_parameter(hidden)}\n']
