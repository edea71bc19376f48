"""Words of a pbrt file: quoted names, numbers, matrices."""
import math

IDENTITY = (1.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 1.0)
MOST_NAME = 120  # characters
GREATEST = 1e30  # of a coordinate
TRANSFORM = "Transform [" + " ".join(["%.9g"] * 16) + "]\n"


def quoted(text):
    """A pbrt string: quotes, backslashes and line breaks escaped."""
    for character, escape in (("\\", "\\\\"), ('"', '\\"'), ("\n", "\\n"), ("\r", "\\r"), ("\t", "\\t")):
        text = text.replace(character, escape)
    return '"' + text.encode("utf-8", "replace").decode("utf-8") + '"'


class Names:
    """Names of any script made fit for a pbrt file, each given once."""

    def __init__(self):
        self._given = set()
        self._next = {}

    def unique(self, name):
        """`name` with letters and digits kept, all else replaced, and a number if it has been given."""
        plain = "".join(c if c.isalnum() or c in "._-" else "_" for c in name[:MOST_NAME]) or "_"
        plain = plain.encode("utf-8", "replace").decode("utf-8")
        candidate = plain
        while candidate in self._given:
            self._next[plain] = self._next.get(plain, 1) + 1
            candidate = f"{plain}.{self._next[plain]}"
        self._given.add(candidate)
        return candidate


def numbers(values):
    """Numbers with the digits of a float, in brackets."""
    return "[" + " ".join("%.9g" % v for v in values) + "]"


def columns(matrix):
    """A 4x4 mathutils matrix as pbrt's 16 numbers, column by column."""
    (a, b, c, d), (e, f, g, h), (i, j, k, l), (m, n, o, p) = matrix
    return (a, e, i, m, b, f, j, n, c, g, k, o, d, h, l, p)


def transform(matrix_columns):
    """The directive that replaces the transform by 16 numbers."""
    return TRANSFORM % tuple(matrix_columns)


def is_usable(m):
    """Whether 16 numbers are finite and an affine transform that does not flatten space."""
    if not (max(m) < GREATEST and min(m) > -GREATEST and sum(m) < math.inf):  # neither is true of NaN
        return False
    a, b, c = m[0:3], m[4:7], m[8:11]
    volume = (a[0] * (b[1] * c[2] - b[2] * c[1]) - a[1] * (b[0] * c[2] - b[2] * c[0])
              + a[2] * (b[0] * c[1] - b[1] * c[0]))
    lengths = math.hypot(*a) * math.hypot(*b) * math.hypot(*c)
    return lengths > 1e-30 and abs(volume) > 1e-12 * lengths and m[3] == m[7] == m[11] == 0


def moving(way):
    """The directives for a way: transforms at even times from the shutter's opening to its closing, or one alone."""
    if len(way) == 1:
        return transform(way[0])
    if len(way) == 2:
        return (f"ActiveTransform StartTime\n{transform(way[0])}ActiveTransform EndTime\n{transform(way[1])}"
                "ActiveTransform All\n")
    return f"TransformSteps {len(way)} {numbers(x for m in way for x in m)}\n"
