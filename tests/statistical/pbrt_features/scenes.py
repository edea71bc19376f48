"""Small pbrt-v4 scenes, each about one feature: a ball, or another shape, on a floor before a wall.

`scenes()` gives their texts by name; `write_pictures` makes the pictures that they name.
"""
import numpy as np
import OpenImageIO as oiio

import measured

LOOK = "LookAt 0 1.6 -4.2  0 .75 0  0 1 0\n"
CAMERA = LOOK + 'Camera "perspective" "float fov" 45'
GREY = 'Material "diffuse" "rgb reflectance" [.5 .5 .5]'
PANEL = (
    'Shape "bilinearmesh" "point3 P" [-.8 2.9 -.8  .8 2.9 -.8  -.8 2.9 .8  .8 2.9 .8] "point2 uv" [0 0 1 0 0 1 1 1]'
)
LAMP = (
    'AttributeBegin AreaLightSource "diffuse" "rgb L" [6 6 6] Material "diffuse" "rgb reflectance" [0 0 0]\n'
    + PANEL
    + ' AttributeEnd\nLightSource "infinite" "rgb L" [.2 .2 .2]'
)
WINDOW = "-.8 2.9 -.8  .8 2.9 -.8  .8 2.9 .8  -.8 2.9 .8"
BALL = 'Shape "sphere" "float radius" .7'
ROOM = """Shape "trianglemesh" "point3 P" [-4 0 -4 4 0 -4 4 0 4 -4 0 4] "integer indices" [0 2 1 0 3 2]
  "point2 uv" [0 0 1 0 1 1 0 1]
Shape "trianglemesh" "point3 P" [-4 0 3 4 0 3 4 5 3 -4 5 3] "integer indices" [0 1 2 0 2 3]
  "point2 uv" [0 0 1 0 1 1 0 1]"""


def scene(material=GREY, light=LAMP, camera=CAMERA, film="", pixel_filter="box", shape=BALL, before="", floor=GREY,
          after="", depth=6, integrator="path"):
    return f"""{camera}
Film "rgb" "integer xresolution" 96 "integer yresolution" 72 "string filename" "out.exr" {film}
PixelFilter "{pixel_filter}"
Sampler "independent" "integer pixelsamples" 256
Integrator "{integrator}" "integer maxdepth" {depth}
WorldBegin
{before}
{light}
AttributeBegin {floor}
{ROOM}
AttributeEnd
AttributeBegin {material} Translate 0 .7 0
{shape}
AttributeEnd
{after}
"""


def block(text):
    return f"AttributeBegin {text} AttributeEnd"


def materials():
    grey6 = '"rgb reflectance" [.6 .6 .6]'
    listed = {f"coateddiffuse_rough{r}": f'"coateddiffuse" {grey6} "float roughness" {r}' for r in (0, .02, .1, .3, .6)}
    listed |= {
        f"coatedconductor_coat{a}_metal{b}":
            f'"coatedconductor" "rgb reflectance" [.7 .7 .7] "float interface.roughness" {a}'
            f' "float conductor.roughness" {b}'
        for a, b in ((0, .1), (.1, .1), (.3, .3), (0, .5), (.5, 0))
    }
    listed |= {f"dielectric_rough{r}": f'"dielectric" "float roughness" {r} "float eta" 1.5' for r in (0, .05, .3, .8)}
    listed |= {
        "coateddiffuse_thick": f'"coateddiffuse" {grey6} "float roughness" .1 "float thickness" .5',
        "coateddiffuse_eta": '"coateddiffuse" "rgb reflectance" [.9 .9 .9] "float roughness" .2 "float eta" 2',
        "coateddiffuse_dark": '"coateddiffuse" "rgb reflectance" [.05 .05 .05] "float roughness" .3',
        "coateddiffuse_default": '"coateddiffuse"',
        "coateddiffuse_milky": f'"coateddiffuse" {grey6} "float roughness" 0 "float thickness" .5 "float g" .4'
                               ' "rgb albedo" [.9 .6 .3] "integer maxdepth" 100',
        "coateddiffuse_milky_rough": f'"coateddiffuse" {grey6} "float roughness" .1 "float thickness" .5 "float g" .4'
                                     ' "rgb albedo" [.9 .6 .3] "integer maxdepth" 100',
        "coatedconductor_milky": '"coatedconductor" "rgb reflectance" [.9 .9 .9] "float interface.roughness" 0'
                                 ' "float conductor.roughness" .3 "float thickness" .5 "float g" .4'
                                 ' "rgb albedo" [.9 .6 .3] "integer maxdepth" 100',
        "coatedconductor_named": '"coatedconductor" "spectrum conductor.eta" "metal-Al-eta" "spectrum conductor.k"'
                                 ' "metal-Al-k" "float interface.roughness" .2 "float conductor.roughness" .1',
        "coatedconductor_default": '"coatedconductor"',
        "coateddiffuse_brushed": f'"coateddiffuse" {grey6} "float uroughness" .3 "float vroughness" .02',
        "coatedconductor_brushed": '"coatedconductor" "rgb reflectance" [.8 .8 .8] "float interface.roughness" 0'
                                   ' "float conductor.uroughness" .4 "float conductor.vroughness" .05',
        "conductor_aluminium": '"conductor" "spectrum eta" "metal-Al-eta" "spectrum k" "metal-Al-k" "float roughness" .1',
        "conductor_copper": '"conductor" "spectrum eta" "metal-Cu-eta" "spectrum k" "metal-Cu-k" "float roughness" .3',
        "conductor_gold": '"conductor" "spectrum eta" "metal-Au-eta" "spectrum k" "metal-Au-k" "float roughness" 0',
        "conductor_brushed": '"conductor" "rgb reflectance" [.8 .8 .8] "float uroughness" .4 "float vroughness" .05',
        "conductor_rough1": '"conductor" "rgb reflectance" [.9 .9 .9] "float roughness" 1',
        "conductor_alpha": '"conductor" "rgb reflectance" [.9 .9 .9] "float roughness" .3 "bool remaproughness" false',
        "conductor_default": '"conductor"',
        "dielectric_brushed": '"dielectric" "float uroughness" .3 "float vroughness" .02',
        "subsurface_milk": '"subsurface" "float scale" 40',
        "subsurface_marble": '"subsurface" "string name" "Marble" "float scale" 40 "float eta" 1.5',
        "subsurface_skin": '"subsurface" "string name" "Skin1" "float scale" 80',
        "subsurface_forward": '"subsurface" "rgb sigma_a" [.5 1 3] "rgb sigma_s" [400 300 300] "float g" .8',
        "subsurface_reflectance": '"subsurface" "rgb reflectance" [.8 .5 .3] "rgb mfp" [.01 .01 .01]',
        "subsurface_rough": '"subsurface" "rgb reflectance" [.6 .6 .6] "rgb mfp" [.01 .01 .01] "float roughness" .3',
        "thindielectric": '"thindielectric" "float eta" 1.8',
        "diffusetransmission": '"diffusetransmission" "rgb reflectance" [.3 .3 .3] "rgb transmittance" [.4 .4 .4]'
                               ' "float scale" .9',
        "diffusetransmission_default": '"diffusetransmission"',
        "diffuse_default": '"diffuse"',
        "diffuse_spectrum": '"diffuse" "spectrum reflectance" [400 .2 500 .3 600 .7 700 .8]',
    }
    # pbrt's "path" lets nothing out of a subsurface material.
    out = {k: scene(f"Material {v}", depth=12 if k.startswith("dielectric") else 6,
                    integrator="volpath" if k.startswith("subsurface") else "path") for k, v in listed.items()}
    out["mix"] = scene(
        'MakeNamedMaterial "a" "string type" "conductor" "rgb reflectance" [.8 .8 .8] "float roughness" .1\n'
        'MakeNamedMaterial "b" "string type" "diffuse" "rgb reflectance" [.2 .2 .2]\n'
        'Material "mix" "string materials" ["a" "b"] "float amount" .3')
    for name in ("matte", "metal", "brushed", "red"):
        out[f"measured_{name}"] = scene(f'Material "measured" "string filename" "{name}.bsdf"')
    out["colors"] = scene('Material "diffuse" "rgb reflectance" [.7 .3 .15]',
                          floor='Material "diffuse" "rgb reflectance" [.3 .5 .7]')
    mirror = 'Material "conductor" "rgb reflectance" [%s %s %s] "float roughness" 0'
    out["mirrors"] = scene(mirror % (.9, .9, .9), floor=mirror % (.8, .8, .8), depth=10)
    return out


def lights():
    def at(text, place="Translate 1 2.5 -1"):
        return block(f"{place} LightSource {text}")

    def area(text, shape=PANEL):
        return block(f'AreaLightSource "diffuse" {text} Material "diffuse" "rgb reflectance" [.3 .3 .3]\n{shape}')

    spot = '"spot" "rgb I" [9 9 9] "point3 from" [1.5 3 -1.5] "point3 to" [0 .5 0]'
    disk = 'Translate 1 1.5 0 Rotate 40 0 0 1 Shape "disk" "float radius" .5'
    projector = "Translate 0 2.2 -3 Rotate 20 1 0 0"
    listed = {
        "point": at('"point" "rgb I" [4 4 4] "float scale" 2'),
        "point_power": at('"point" "rgb I" [4 1 1] "float power" 60'),
        "point_from": 'LightSource "point" "point3 from" [1 2 -1] "blackbody I" 4000 "float scale" 5',
        "point_default": at('"point"'),
        "spot": f'LightSource {spot} "float coneangle" 35 "float conedeltaangle" 12',
        "spot_power": f'LightSource {spot} "float power" 40',
        "distant": 'LightSource "distant" "rgb L" [2 2 2] "point3 from" [2 3 -2] "point3 to" [0 0 0]',
        "distant_illuminance": 'LightSource "distant" "rgb L" [2 1 1] "point3 from" [2 3 -2] "float illuminance" 5',
        "infinite_illuminance": 'LightSource "infinite" "rgb L" [1 2 1] "float illuminance" 3',
        "infinite_blackbody": 'LightSource "infinite" "blackbody L" 5000 "float scale" .5',
        "infinite_portal": f'LightSource "infinite" "rgb L" [3 2 1] "point3 portal" [{WINDOW}]',
        "infinite_image_portal": at(f'"infinite" "string filename" "sky.exr" "point3 portal" [{WINDOW}]',
                                    "Rotate 30 0 1 0 Rotate -90 1 0 0"),
        "infinite_image": at('"infinite" "string filename" "sky.exr" "float scale" .7', "Rotate 30 0 1 0 Rotate -90 1 0 0"),
        "infinite_image_illuminance": at('"infinite" "string filename" "sky.exr" "float illuminance" 4', ""),
        "goniometric": at('"goniometric" "rgb I" [6 6 6] "string filename" "gonio.exr"', "Translate 0 2.5 -1 Rotate 90 1 0 0"),
        "goniometric_power": at('"goniometric" "rgb I" [6 6 6] "string filename" "gonio.exr" "float power" 50',
                                "Translate 0 2.5 -1 Rotate 20 1 0 1"),
        "projection": at('"projection" "string filename" "stripes.png" "float fov" 50 "float scale" 20', projector),
        "projection_power": at('"projection" "string filename" "stripes.png" "float fov" 50 "float power" 30', projector),
        "area_power": area('"rgb L" [1 2 1] "float power" 60'),
        "area_twosided": area('"rgb L" [4 4 4] "bool twosided" true', disk),
        "area_twosided_power": area('"rgb L" [4 4 4] "bool twosided" true "float power" 30', disk),
        "area_image": area('"string filename" "stripes.png" "float scale" 8'),
        "area_image_power": area('"string filename" "stripes.png" "float power" 60'),
        "area_sphere": area('"rgb L" [9 9 9]', 'Translate 1 2.4 -.5 Shape "sphere" "float radius" .25'),
        "area_cylinder": area('"rgb L" [9 9 9]', 'Translate 1 2.4 -.5 Rotate 90 0 1 0 Shape "cylinder"'
                              ' "float radius" .2 "float zmin" -.6 "float zmax" .4'),
        "area_reverse": block('ReverseOrientation AreaLightSource "diffuse" "rgb L" [8 8 8] Translate 1 2.4 -.5'
                              ' Rotate 90 1 0 0 Shape "disk" "float radius" .4'),
        "area_alpha": area('"rgb L" [8 8 8]', PANEL + ' "float alpha" .5'),
        "area_default": area(""),
        "area_blackbody": area('"blackbody L" 3000 "float scale" 4'),
        "area_illuminant": area('"spectrum L" "stdillum-A" "float scale" 3'),
        "area_spectrum": area('"spectrum L" [400 2 700 8]'),
        "area_rgb": area('"rgb L" [8 5 2]'),
    }
    return {"light_" + k: scene(light=v) for k, v in listed.items()}


BEND = '"point3 P" [-1 -.5 0  -.3 1 0  .3 -1 -.5  1 .5 0]'
# A landscape lens: radius, thickness, index, diameter in mm.
LENSES = """52 6 1.62 28
-52 3 1 28
0 4 0 20
-90 2 1.7 24
90 3 1 24
"""


def tuft(kind=""):
    """Curves that stand on the floor around the middle, bent at random."""
    random = np.random.default_rng(3)
    out = ""
    for _ in range(120):
        x, z = random.uniform(-.6, .6, 2)
        bend, height = random.normal(0, .15, (2, 2)), random.uniform(.7, 1.2)
        points = [x, -.7, z, x + bend[0, 0] * .5, -.7 + height * .3, z + bend[0, 1] * .5,
                  x + bend[0, 0], -.7 + height * .7, z + bend[0, 1],
                  x + bend[0, 0] + bend[1, 0], -.7 + height, z + bend[0, 1] + bend[1, 1]]
        out += f'Shape "curve" {kind} "point3 P" [{" ".join(f"{v:.3f}" for v in points)}] "float width" .02\n'
    return out


def hair():
    listed = {
        "default": ("", tuft()),
        "blond": ('"float eumelanin" .2 "float pheomelanin" .3 "float beta_m" .15 "float beta_n" .2', tuft()),
        "white": ('"rgb reflectance" [.9 .9 .9] "float beta_n" .4 "float alpha" 0', tuft()),
        "cylinders": ('"rgb color" [.6 .3 .1]', tuft('"string type" "cylinder"')),
        "thick": ('"rgb sigma_a" [.3 .3 .3] "float beta_n" .5', f'Shape "curve" {BEND} "float width" .3'),
    }
    return {"hair_" + k: scene(f'Material "hair" {material}', shape=shape, depth=12)
            for k, (material, shape) in listed.items()}


def cameras_and_films():
    perspective = LOOK + 'Camera "perspective" "float fov" 45 '
    spherical = 'LookAt 0 1 -2 0 .75 0 0 1 0 Camera "spherical" "string mapping" '
    out = {
        "camera_lens": scene(camera=perspective + '"float lensradius" .15 "float focaldistance" 4'),
        "camera_window": scene(camera=perspective + '"float screenwindow" [-1.2 .8 -.6 .9]'),
        "camera_aspect": scene(camera=perspective + '"float frameaspectratio" 2'),
        "camera_orthographic": scene(camera='LookAt 0 1.6 -3.9 0 .75 0 0 1 0 Camera "orthographic"'
                                            ' "float screenwindow" [-2 2 -1.5 1.5]'),
        "camera_equalarea": scene(camera=spherical + '"equalarea"'),
        "camera_equirectangular": scene(camera=spherical + '"equirectangular"'),
        "camera_mirrored": scene(camera="Scale -1 1 1 " + perspective),
        "film_cropwindow": scene(film='"float cropwindow" [.2 .7 .1 .8]'),
        "film_pixelbounds": scene(film='"integer pixelbounds" [10 60 20 70]'),
        "film_iso": scene(film='"float iso" 200'),
        "film_sensor": scene('Material "diffuse" "rgb reflectance" [.7 .3 .15]', film='"string sensor" "nikon_d850"'),
        "film_whitebalance": scene(film='"float whitebalance" 4500'),
        "filter_mitchell": scene(pixel_filter="mitchell"),
        "filter_sinc": scene(pixel_filter="sinc"),
        "filter_gaussian": scene(pixel_filter="gaussian"),
        "filter_triangle": scene(pixel_filter="triangle"),
    }
    lenses = LOOK + ('Camera "realistic" "string lensfile" "lenses.dat" "float aperturediameter" 14'
                     ' "float focusdistance" 4.2 ')
    out["camera_realistic"] = scene(camera=lenses, film='"float iso" 3000')
    out["camera_realistic_star"] = scene(camera=lenses + '"string aperture" "star"',
                                         film='"float iso" 3000 "float diagonal" 28')
    wide = 'PixelFilter "box" "float xradius" 1.5 "float yradius" 2.5'
    out["filter_box"] = scene().replace('PixelFilter "box"', wide)
    return out


def shapes():
    listed = {
        "sphere_partial": 'Rotate 30 1 1 0 Shape "sphere" "float radius" .7 "float zmin" -.3 "float zmax" .5 "float phimax" 270',
        "sphere_scaled": 'Scale 1 .5 .8 Rotate 30 0 0 1 Shape "sphere" "float radius" .9',
        "cylinder": 'Rotate 60 1 1 0 Shape "cylinder" "float radius" .5 "float zmin" -.6 "float zmax" .6 "float phimax" 200',
        "disk": 'Rotate 60 1 1 0 Shape "disk" "float height" .2 "float radius" .7 "float innerradius" .3 "float phimax" 300',
        "bilinearmesh": 'Shape "bilinearmesh" "point3 P" [-.7 -.6 -.7 .7 .6 -.7 -.7 .6 .7 .7 -.6 .7]',
        "loopsubdiv": 'Shape "loopsubdiv" "integer levels" 3 "point3 P" [-.9 -.7 -.9 .9 -.7 -.9 .9 -.7 .9 -.9 -.7 .9 0 1 0]'
                      ' "integer indices" [0 1 4 1 2 4 2 3 4 3 0 4 0 2 1 0 3 2]',
        "curve_ribbon": f'Shape "curve" "string type" "ribbon" "normal N" [0 0 -1 .5 .2 -1] {BEND} "float width" .3',
        "curve_flat": f'Shape "curve" {BEND} "float width" .3',
        "curve_grass": tuft(),
        "curve_cylinder": f'Shape "curve" "string type" "cylinder" {BEND} "float width" .3',
    }
    out = {"shape_" + k: scene(shape=v) for k, v in listed.items()}
    # Glass shows which side of a surface is its inside.
    mirrored = (block('Translate -1.1 0 0 ReverseOrientation Scale 1 1 -1 Shape "sphere" "float radius" .6'),
                block('Translate 1.1 0 0 Scale 1 1 -1 Shape "sphere" "float radius" .6'),
                block('Translate 0 .2 .6 Scale 1 .7 -1 Shape "sphere" "float radius" .5'),
                block('Translate 0 -.3 -.6 Scale 1 1 -1 Shape "cylinder" "float radius" .25 "float zmin" -.4 "float zmax" .4'
                      ' Shape "disk" "float radius" .25 "float height" .4'
                      ' ReverseOrientation Shape "disk" "float radius" .25 "float height" -.4'))
    out["shape_mirrored_quadrics"] = scene('Material "dielectric" "float eta" 1.5', shape="\n".join(mirrored), depth=12)
    ball = 'ObjectBegin "o" Material "diffuse" "rgb reflectance" [.7 .7 .7] Shape "sphere" "float radius" .4 ObjectEnd\n'
    out["instances"] = scene(
        shape="", after=ball + block('Translate -1 .5 0 Scale 1 .6 1 ObjectInstance "o"') + "\n" +
        block('Translate .6 .5 -.5 ObjectInstance "o"'))
    return out


def textures():
    def on_floor(text, kind="spectrum"):
        return scene(before=f'Texture "t" "{kind}" {text}', floor='Material "diffuse" "texture reflectance" "t"')

    def on_ball(before, material='Material "diffuse" "texture reflectance" "t"'):
        return scene(before=before, material=material)

    light_dark = '"rgb tex1" [.8 .8 .8] "rgb tex2" [.1 .1 .1]'
    image = '"imagemap" "string filename" "stripes.png"'
    out = {
        "checkerboard": on_floor(f'"checkerboard" "float uscale" 6 "float vscale" 4 {light_dark}'),
        "checkerboard_solid": scene(before=f'Translate .3 .3 .3 Texture "t" "spectrum" "checkerboard" "integer dimension" 3'
                                           f" {light_dark} Identity", floor='Material "diffuse" "texture reflectance" "t"'),
        "imagemap": on_floor(image + ' "float uscale" 2 "float vscale" 3 "float udelta" .2'),
        "imagemap_clamp": on_floor(image + ' "string wrap" "clamp" "float uscale" 2 "float udelta" -.5'),
        "imagemap_black": on_floor(image + ' "string wrap" "black" "float uscale" 2 "float udelta" -.5'),
        "imagemap_point": on_floor(image + ' "string filter" "point" "float uscale" .2'),
        "imagemap_linear": on_floor(image + ' "string encoding" "linear" "bool invert" true'),
        "imagemap_gamma": on_floor(image + ' "string encoding" "gamma 1.8" "float scale" .5'),
        "mapping_planar": on_floor(image + ' "string mapping" "planar" "vector3 v1" [.5 0 0] "vector3 v2" [0 .3 .3]'),
        "mapping_spherical": on_ball(f'Texture "t" "spectrum" {image} "string mapping" "spherical"'),
        "mapping_cylindrical": on_ball(f'Texture "t" "spectrum" {image} "string mapping" "cylindrical"'),
        "mapping_uv": on_ball(f'Texture "t" "spectrum" {image}'),
        "dots": on_floor('"dots" "float uscale" 8 "float vscale" 8 "rgb inside" [.8 .8 .8] "rgb outside" [.1 .1 .1]'),
        "marble": on_floor('"marble" "float scale" 3'),
        "bilerp": on_floor('"bilerp" "rgb v00" [.1 .1 .1] "rgb v01" [.3 .3 .3] "rgb v10" [.5 .5 .5] "rgb v11" [.9 .9 .9]'),
        "scale": on_floor('"scale" "texture tex" "a" "float scale" .6').replace(
            'Texture "t"', 'Texture "a" "spectrum" "checkerboard" "float uscale" 5 "float vscale" 5'
                           ' "rgb tex1" [.8 .8 .8] "rgb tex2" [.3 .3 .3]\nTexture "t"'),
        "directionmix": on_ball(f'Rotate 40 1 0 1 Texture "t" "spectrum" "directionmix" {light_dark}'
                                ' "vector3 dir" [.3 1 0] Identity'),
        "roughness": scene(before='Texture "t" "float" "checkerboard" "float uscale" 6 "float vscale" 6 "float tex1" .05'
                                  ' "float tex2" .6',
                           floor='Material "conductor" "rgb reflectance" [.8 .8 .8] "texture roughness" "t"'),
        "alpha": scene(before='Texture "t" "float" "checkerboard" "float uscale" 4 "float vscale" 4 "float tex1" 1'
                              ' "float tex2" 0', shape=BALL + ' "texture alpha" "t"'),
        "bump": on_ball('Texture "w" "float" "wrinkled"\nTexture "t" "float" "scale" "texture tex" "w" "float scale" .05',
                        'Material "diffuse" "rgb reflectance" [.7 .7 .7] "texture displacement" "t"'),
    }
    for kind in ("fbm", "windy", "wrinkled"):
        mixed = scene(before=f'Texture "f" "float" "{kind}"\nTexture "t" "spectrum" "mix" {light_dark} "texture amount" "f"',
                      floor='Material "diffuse" "texture reflectance" "t"')
        out[kind] = mixed
    return {"texture_" + k: v for k, v in out.items()}


def scenes():
    return materials() | hair() | lights() | cameras_and_films() | shapes() | textures()


def write_pictures(folder):
    (folder / "lenses.dat").write_text(LENSES)
    measured.write(folder)

    def write(name, pixels, kind):
        out = oiio.ImageOutput.create(f"{folder}/{name}")
        out.open(f"{folder}/{name}", oiio.ImageSpec(pixels.shape[1], pixels.shape[0], 3, kind))
        out.write_image(np.ascontiguousarray(pixels.astype(np.float32)))
        out.close()

    def grey(x):
        return x[..., None] * np.ones(3)

    y, x = np.mgrid[0:64, 0:64] / 64
    write("sky.exr", grey(.2 + np.exp(-((x - .7)**2 + (y - .3)**2) * 80) * 12 + .5 * y), "half")
    write("gonio.exr", grey(.1 + x * y), "half")
    write("stripes.png", grey(np.clip(.1 + .8 * ((x * 5).astype(int) % 2) * y + .1 * x, 0, 1)), "uint8")
