"""What is rendered of a picture: its size, and the part that the border leaves."""
import dataclasses

import numpy


@dataclasses.dataclass(frozen=True)
class Frame:
    """Pixels. `x`, `y`: the lower left corner of the part; `right` and `top` are the first pixels outside."""
    width: int
    height: int
    x: int
    y: int
    right: int
    top: int

    @property
    def size(self):
        """(width, height) of the part."""
        return self.right - self.x, self.top - self.y

    def crop(self):
        """The part as the farm wants it: x0, x1, y0, y1 in 0..1, y from above. None: all."""
        if (self.x, self.y, self.right, self.top) == (0, 0, self.width, self.height):
            return None
        return (self.x / self.width, self.right / self.width,
                (self.height - self.top) / self.height, (self.height - self.y) / self.height)


def frame_of(render, width, height):
    """`render`: scene.render. `width`, `height`: of the whole picture, with the percentage. The border's edges are cut as
    Blender cuts them for its render result."""
    if not render.use_border:
        return Frame(width, height, 0, 0, width, height)
    x, right, y, top = (int(numpy.float32(edge) * numpy.float32(side)) for edge, side in (
        (render.border_min_x, width), (render.border_max_x, width),
        (render.border_min_y, height), (render.border_max_y, height)))
    return Frame(width, height, x, y, right, top)
