"""Noise of renders with several seeds: the error of pixels and of box means."""
import numpy as np

TRIMMED = 0.001


def read_pfm(path):
    """Rows from the bottom, as PFM has them: height x width x 3."""
    with open(path, "rb") as file:
        assert file.readline().strip() == b"PF"
        width, height = map(int, file.readline().split())
        order = "<" if float(file.readline()) < 0 else ">"
        return np.frombuffer(file.read(), dtype=f"{order}f4").reshape(height, width, 3).astype(np.float64)


def box_means(image, side):
    """Means of the whole boxes of side x side pixels."""
    rows, columns = image.shape[0] // side * side, image.shape[1] // side * side
    boxes = image[:rows, :columns].reshape(rows // side, side, columns // side, side, -1)
    return boxes.mean(axis=(1, 3))


def error_at(images, side):
    """relMSE of the box means of an image of one seed, times the pixels of a box; None if no box fits. The error of an image
    is its deviation from the mean of all seeds, unbiased when multiplied by n/(n-1). The 0.1 % of boxes with the largest
    error are left out."""
    boxes = [box_means(image, side) for image in images]
    if boxes[0].size == 0:
        return None
    mean = sum(boxes) / len(boxes)
    weight = 1 / (mean**2 + 1e-2)
    squares = sum(((b - mean) ** 2 * weight).mean(axis=2) for b in boxes).ravel() / (len(boxes) - 1)
    kept = np.sort(squares)[: squares.size - int(squares.size * TRIMMED)]
    return float(kept.mean()) * side * side
