"""What a picture shows."""

import numpy as np


def near(image, color, tolerance=0.12):
    """(h,w) pixels close to an RGB colour."""
    return (np.abs(image / 255.0 - color) < tolerance).all(axis=2)
