"""Orders of convergence."""

import numpy as np


def orders(errors):
    """Those of errors, or of other differences, where a step is halved each time."""
    errors = np.abs(errors)
    return np.log2(errors[:-1] / errors[1:])
