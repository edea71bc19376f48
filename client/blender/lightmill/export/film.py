"""Film, pixel filter, samples and depth: what the scene's render settings say of the picture."""
from .camera import resolution
from .pbrt_text import numbers, quoted

# Blender's filter of Blackman and Harris (1978) of width 1 is a Gaussian of this deviation, within 1.7 %.
BLACKMAN_HARRIS_SIGMA = 0.143
DEFAULT_DEPTH = 13  # of Cycles, of a scene that has no settings of it


def film_lines(scene, size):
    """Film, PixelFilter, Sampler and Integrator."""
    width, height = size or resolution(scene)
    cycles = getattr(scene, "cycles", None)
    exposure = getattr(cycles, "film_exposure", 1.0)
    film = f'Film "rgb" "integer xresolution" {width} "integer yresolution" {height}'
    film += f' "string filename" {quoted("picture.exr")} "float exposuretime" 1 "float iso" {100 * max(exposure, 1e-6):.9g}'
    render = scene.render
    if render.use_border and size is None:
        # Blender's border is measured from below.
        crop = (render.border_min_x, render.border_max_x, 1 - render.border_max_y, 1 - render.border_min_y)
        if crop[0] < crop[1] and crop[2] < crop[3]:
            film += f' "float cropwindow" {numbers(crop)}'
    lines = [film, pixel_filter(cycles)]
    lines.append(f'Sampler "zsobol" "integer pixelsamples" {max(1, getattr(cycles, "samples", 64))}')
    depth = cycles.max_bounces + 1 if cycles else DEFAULT_DEPTH
    lines.append(f'Integrator "volpath" "integer maxdepth" {max(1, depth)}')
    return "\n".join(lines) + "\n"


def pixel_filter(cycles):
    """The PixelFilter that is nearest to Cycles'. Widths are diameters there, radii here."""
    kind = getattr(cycles, "pixel_filter_type", "BLACKMAN_HARRIS")
    width = getattr(cycles, "filter_width", 1.5)
    if kind == "BOX":
        return 'PixelFilter "box" "float xradius" 0.5 "float yradius" 0.5'
    sigma = width / 12 if kind == "GAUSSIAN" else width * BLACKMAN_HARRIS_SIGMA
    return (f'PixelFilter "gaussian" "float xradius" {width / 2:.9g} "float yradius" {width / 2:.9g}'
            f' "float sigma" {sigma:.9g}')
