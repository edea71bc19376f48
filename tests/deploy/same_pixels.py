"""same_pixels.py A B: exits with 0 if both images hold the same float bytes, all finite and not all zero."""
import sys

import numpy as np
import OpenImageIO as oiio


def load(path):
    image = oiio.ImageBuf(path)
    if image.has_error:
        sys.exit(f"{path}: {image.geterror()}")
    pixels = np.asarray(image.get_pixels(oiio.FLOAT), np.float32)
    if not np.isfinite(pixels).all():
        sys.exit(f"{path}: {np.count_nonzero(~np.isfinite(pixels))} values are not finite")
    if not pixels.any():
        sys.exit(f"{path}: all values are zero")
    return pixels


a, b = load(sys.argv[1]), load(sys.argv[2])
if a.shape != b.shape:
    sys.exit(f"{sys.argv[1]} is {a.shape} and {sys.argv[2]} {b.shape}")
if a.tobytes() != b.tobytes():
    sys.exit(f"{np.count_nonzero((a != b).any(-1))} of {a.shape[0] * a.shape[1]} pixels differ")
