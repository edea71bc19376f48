"""Colours of temperatures and wavelengths, in linear Rec.709."""
from __future__ import annotations

import math

Color = tuple[float, float, float]

# Rational fits to a black body of luminance 1 that Cycles has: from this many kelvin, a / T + b T + c of red and
# of green, and a cubic of blue.
_BLACKBODY = (
    (800, (1.61919106e+03, -2.05010916e-03, 5.02995757e+00), (-4.88999748e+02, 6.04330754e-04, -7.55807526e-02),
     (5.96945309e-11, -4.85742887e-08, -9.70622247e-05, -4.07936148e-03)),
    (965, (2.48845471e+03, -1.11330907e-03, 3.22621544e+00), (-7.55994277e+02, 3.16730098e-04, 4.78306139e-01),
     (2.40430366e-11, 5.55021075e-08, -1.98503712e-04, 2.89312858e-02)),
    (1167, (3.34143193e+03, -4.86551192e-04, 1.76486769e+00), (-1.02363977e+03, 1.20223470e-04, 9.36662319e-01),
     (-1.40949732e-11, 1.89878968e-07, -3.56632824e-04, 9.10767778e-02)),
    (1449, (4.09461742e+03, -1.27446582e-04, 7.25731635e-01), (-1.26571316e+03, 4.87340896e-06, 1.27054498e+00),
     (-3.61460868e-11, 2.84822009e-07, -4.93211319e-04, 1.56723440e-01)),
    (1902, (4.67028036e+03, 2.91258199e-05, 1.26703442e-01), (-1.42529332e+03, -4.01150431e-05, 1.43972784e+00),
     (-1.97075738e-11, 1.75359352e-07, -2.50542825e-04, -2.22783266e-02)),
    (3315, (4.59509185e+03, 2.87495649e-05, 1.50345020e-01), (-1.17554822e+03, -2.16378048e-05, 1.30408023e+00),
     (-1.61997957e-13, -1.64216008e-08, 3.86216271e-04, -7.38077418e-01)),
    (6365, (3.78717450e+03, 9.35907826e-06, 3.99075871e-01), (-5.00799571e+02, -4.59832026e-06, 1.09098763e+00),
     (6.72650283e-13, -2.73078809e-08, 4.24098264e-04, -7.52335691e-01)))


def blackbody(kelvin: float) -> Color:
    """Colour of luminance about 1."""
    if not kelvin >= 800:
        return (5.413294490189271, 0.0, 0.0)
    if kelvin >= 12000:
        return (0.8262954810464208, 0.9945080501520986, 1.566307710274283)
    _, red, green, blue = next(r for r in reversed(_BLACKBODY) if kelvin >= r[0])
    r, g = (k[0] / kelvin + kelvin * k[1] + k[2] for k in (red, green))
    b = ((kelvin * blue[0] + blue[1]) * kelvin + blue[2]) * kelvin + blue[3]
    return (max(r, 0.0), max(g, 0.0), max(b, 0.0))


def _lobe(x: float, middle: float, below: float, above: float) -> float:
    t = (x - middle) * (below if x < middle else above)
    return math.exp(-0.5 * t * t)


def wavelength(nm: float) -> Color:
    """Colour of light of one wavelength, as Cycles scales it. The matching functions are the fits of Wyman,
    Sloan and Shirley, "Simple Analytic Approximations to the CIE XYZ Color Matching Functions" (2013)."""
    if not 380 <= nm <= 780:
        return (0.0, 0.0, 0.0)
    x = (0.362 * _lobe(nm, 442.0, 0.0624, 0.0374) + 1.056 * _lobe(nm, 599.8, 0.0264, 0.0323)
         - 0.065 * _lobe(nm, 501.1, 0.0490, 0.0382))
    y = 0.821 * _lobe(nm, 568.8, 0.0213, 0.0247) + 0.286 * _lobe(nm, 530.9, 0.0613, 0.0322)
    z = 1.217 * _lobe(nm, 437.0, 0.0845, 0.0278) + 0.681 * _lobe(nm, 459.0, 0.0385, 0.0725)
    rgb = (3.2404542 * x - 1.5371385 * y - 0.4985314 * z, -0.9692660 * x + 1.8760108 * y + 0.0415560 * z,
           0.0556434 * x - 0.2040259 * y + 1.0572252 * z)
    return tuple(max(c / 2.52, 0.0) for c in rgb)  # 2.52: the largest component of a pure colour
