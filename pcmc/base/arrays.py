"""Names for the arrays that travel through pcmc."""

from __future__ import annotations

from collections.abc import Callable
from functools import cached_property, wraps
from typing import Any, TypeVar

import numpy as np
import numpy.typing as npt

Floats = npt.NDArray[np.float64]
Ints = npt.NDArray[np.integer[Any]]
Bools = npt.NDArray[np.bool_]
Vector = tuple[float, float, float]

Array = TypeVar("Array", bound=npt.NDArray[Any])
Result = TypeVar("Result")


def read_only(array: Array) -> Array:
    """The same array, which can no longer be written to.

    >>> read_only(np.ones(2)).flags.writeable
    False
    """
    array.setflags(write=False)
    return array


def kept_with_owner(compute: Callable[[Any], Result]) -> Callable[[Any], Result]:
    """A function of one object that is computed once: the object keeps the value like a cached property."""
    name = compute.__name__

    @wraps(compute)
    def kept(owner: Any) -> Result:
        values: dict[str, Result] = vars(owner)
        if name not in values:
            values[name] = compute(owner)
        return values[name]

    return kept


def cached_array(method: Callable[[Any], Array]) -> cached_property[Array]:
    """``cached_property`` for an array, which can then no longer be written to."""

    @wraps(method)
    def computed(owner: Any) -> Array:
        return read_only(method(owner))

    return cached_property(computed)
