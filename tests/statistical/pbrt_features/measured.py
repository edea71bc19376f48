"""Files of measured BSDFs, made of BSDFs that are known (Dupuy & Jakob 2018)."""
import struct

import numpy as np


def ggx(wo, wi, ax, ay):
    """f of GGX facets that reflect everything, with height-correlated masking."""
    m = wo + wi
    m = m / np.linalg.norm(m, axis=-1, keepdims=True)

    def slopes(w):
        return (np.sqrt(1 + ((ax * w[..., 0])**2 + (ay * w[..., 1])**2) / w[..., 2]**2) - 1) / 2

    d = 1 / (np.pi * ax * ay * ((m[..., 0] / ax)**2 + (m[..., 1] / ay)**2 + m[..., 2]**2)**2)
    return d / (1 + slopes(wo) + slopes(wi)) / (4 * wo[..., 2] * np.maximum(wi[..., 2], 1e-9))


def directions(theta, phi):
    return np.stack([np.sin(theta) * np.cos(phi), np.sin(theta) * np.sin(phi), np.cos(theta) + 0 * phi], -1)


def facets(x, y):
    return directions(x * x * np.pi / 2, 2 * np.pi * (y - .5))


def running(values):
    """Trapezoids summed along the last axis, from 0."""
    pieces = (values[..., 1:] + values[..., :-1]) / 2
    return np.concatenate([np.zeros_like(pieces[..., :1]), np.cumsum(pieces, -1)], -1) / (values.shape[-1] - 1)


def warp(values, u, v):
    """Where the bilinear density over a grid takes (u, v): rows by their sums, then along the row; on a fine grid."""
    nodes, fine = values.shape[0], 2049
    at = np.linspace(0, 1, fine)
    rows = np.array([np.interp(at, np.linspace(0, 1, nodes), column) for column in values.T]).T
    sums = running(np.interp(at, np.linspace(0, 1, nodes), np.trapezoid(values, axis=1)
                             if hasattr(np, "trapezoid") else np.trapz(values, axis=1)))
    y = np.interp(v, sums / sums[-1], at)
    x = np.empty_like(u)
    for i, (a, b) in enumerate(zip(u.flat, y.flat)):
        row = rows[int(round(b * (fine - 1)))]
        along = running(np.interp(at, np.linspace(0, 1, nodes), row))
        x.flat[i] = np.interp(a, along / along[-1], at)
    return x, y


def tensor_file(fields):
    at = 18 + sum(13 + len(name) + 8 * np.ndim(values) for name, values in fields.items())
    head, data = b"tensor_file\0\1\0" + struct.pack("<I", len(fields)), b""
    for name, values in fields.items():
        kind = 1 if values.dtype == np.uint8 else 10
        head += struct.pack("<H", len(name)) + name.encode() + struct.pack("<HBQ", values.ndim, kind, at + len(data))
        head += struct.pack(f"<{values.ndim}Q", *values.shape)
        data += values.tobytes()
    return head + data


def bsdf(f, alpha=1.0, azimuths=1, zeniths=9, nodes=32, spectrum=((360, 1), (830, 1))):
    """The file of a BSDF f(wo, wi), tabulated as if of GGX facets of roughness alpha."""
    phi = np.array([0.]) if azimuths == 1 else np.linspace(-np.pi, np.pi, azimuths)
    theta = np.radians(np.linspace(0, 88, zeniths))
    flat = np.linspace(0, 1, 128)
    polar = flat * flat * np.pi / 2

    def d(m):
        return 1 / (np.pi * alpha**2 * ((m[..., 0]**2 + m[..., 1]**2) / alpha**2 + m[..., 2]**2)**2)

    def sigma(angle):
        return (np.cos(angle) + np.sqrt(np.cos(angle)**2 + (alpha * np.sin(angle))**2)) / 2

    grid = np.linspace(0, 1, nodes)
    y, x = np.meshgrid(grid, grid, indexing="ij")
    visible, luminance = [], []
    for p in phi:
        for t in theta:
            wo = directions(np.array(t), np.array(p))
            m = facets(x, y)
            seen = d(m) * np.maximum(m @ wo, 0) / sigma(t) * 2 * np.pi**2 * x * np.sin(x * x * np.pi / 2)
            visible.append(seen)
            m = facets(*warp(seen, x, y))
            c = (m @ wo)[..., None]
            wi = 2 * c * m - wo
            above = (wi[..., 2] > 1e-6) & (c[..., 0] > 0)
            up = np.where(above[..., None], wi, [0, 0, 1])
            luminance.append(np.where(above, f(wo, up) * up[..., 2] * 4 * sigma(t) / d(m), 0))
    views = (len(phi), len(theta))
    luminance = np.array(luminance).reshape(*views, nodes, nodes)
    wavelengths, factors = np.array(spectrum, float).T
    fields = {"description": np.frombuffer(b"known", np.uint8), "phi_i": phi, "theta_i": theta,
              "ndf": np.tile(d(facets(flat, 0 * flat)), (2, 1)), "sigma": np.tile(sigma(polar), (2, 1)),
              "vndf": np.array(visible).reshape(*views, nodes, nodes), "luminance": luminance,
              "wavelengths": wavelengths,
              "spectra": luminance[:, :, None] * factors[None, None, :, None, None],
              "jacobian": np.ones(1, np.uint8)}
    return tensor_file({k: v if v.dtype == np.uint8 else v.astype(np.float32) for k, v in fields.items()})


def write(folder):
    (folder / "matte.bsdf").write_bytes(bsdf(lambda wo, wi: .6 / np.pi + 0 * wi[..., 2]))
    (folder / "metal.bsdf").write_bytes(bsdf(lambda wo, wi: .8 * ggx(wo, wi, .3, .3), alpha=.3))
    (folder / "brushed.bsdf").write_bytes(
        bsdf(lambda wo, wi: .8 * ggx(wo, wi, .5, .2), alpha=.4, azimuths=17, zeniths=7, nodes=16))
    (folder / "red.bsdf").write_bytes(
        bsdf(lambda wo, wi: ggx(wo, wi, .4, .4), alpha=.4, spectrum=((400, .3), (540, .4), (620, .7), (700, .8))))
