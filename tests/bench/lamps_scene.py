"""A scene of many lamps."""
import random

LAMPS = 10000


def lamps_scene(lights):
    """A diffuse plain of 20 x 20 under LAMPS triangles, of which `lights` shine; every tenth light is a point; same total
    flux. The rays meet the same geometry whatever shines."""
    place = random.Random(1)
    side = 0.5 / LAMPS**0.5
    level = 2000 / lights
    lines = ['Film "rgb" "integer xresolution" [256] "integer yresolution" [256]', 'LookAt 0 6 -14  0 0 -2  0 1 0',
             'Camera "perspective" "float fov" [50]', 'WorldBegin', 'Material "diffuse" "rgb reflectance" [0.6 0.6 0.6]',
             'Shape "bilinearmesh" "point3 P" [-10 0 -10  10 0 -10  -10 0 10  10 0 10]']
    meshes = {True: ([], []), False: ([], [])}
    every = LAMPS // lights
    for i in range(LAMPS):
        x, y, z = place.uniform(-10, 10), place.uniform(0.3, 1), place.uniform(-10, 10)
        shines = i % every == 0
        if shines and i // every % 10 == 9:
            lines.append(f'LightSource "point" "rgb I" [{level} {level} {level}] "float scale" 0.04 "point3 from" [{x} {y} {z}]')
            shines = False
        indices, points = meshes[shines]
        indices += [len(points) + k for k in range(3)]
        points += [(x, y, z), (x + side, y, z), (x, y, z + side)]
    for shines in (False, True):
        indices, points = meshes[shines]
        if not indices:
            continue
        if shines:
            lines.append(f'AreaLightSource "diffuse" "rgb L" [{80 * every} {80 * every} {80 * every}]')
        lines.append(f'Shape "trianglemesh" "integer indices" {indices} "point3 P" {[c for p in points for c in p]}'
                     .replace(",", ""))
    return "\n".join(lines) + "\n"
