"""What the viewport shows: its size, and its camera as lines of pbrt."""
import dataclasses

CAMERA_MARK = "# camera of the viewport\n"  # where the exporter would write the scene's camera


@dataclasses.dataclass(frozen=True)
class View:
    """`width`, `height`: pixels that are rendered. The matrices are rows of four floats."""
    width: int
    height: int
    view: tuple    # world to view: x right, y up, looking along -z
    window: tuple  # view to clip space, as OpenGL has it

    def camera(self):
        """The lines for CAMERA_MARK. The part of the plane at distance 1 that is seen follows from the window matrix."""
        m = self.window
        perspective = m[3][2] != 0
        # A point's clip x is m00 x + m02 z + m03, over -z if it is in perspective; likewise y.
        shift = [-m[i][2] if perspective else m[i][3] for i in (0, 1)]
        (left, right), (bottom, top) = (((edge - shift[i]) / m[i][i] for edge in (-1, 1)) for i in (0, 1))
        # pbrt's cameras look along +z: the view's third row is turned. It lists matrices column by column.
        rows = [self.view[0], self.view[1], [-x for x in self.view[2]], self.view[3]]
        matrix = " ".join(f"{rows[row][column]:.9g}" for column in range(4) for row in range(4))
        kind = '"perspective" "float fov" 90' if perspective else '"orthographic"'
        return (f"Transform [{matrix}]\nCamera {kind} "
                f'"float screenwindow" [{left:.9g} {right:.9g} {bottom:.9g} {top:.9g}]\n')


def view_of(context):
    """The View of a 3D viewport."""
    region, view = context.region, context.region_data
    step = {"1": 1, "2": 2, "4": 4, "8": 8}.get(context.scene.render.preview_pixel_size, 1)
    return View(max(1, region.width // step), max(1, region.height // step), _rows(view.view_matrix), _rows(view.window_matrix))


def _rows(matrix):
    return tuple(tuple(row) for row in matrix)
