"""Names for the arrays that travel through pcmc, and values in the terms of JSON and TOML."""

from __future__ import annotations

import json
import math
import re
from collections.abc import Callable, Mapping
from enum import Enum
from functools import cached_property, wraps
from typing import TYPE_CHECKING, Any, TypeVar

import numpy as np
import numpy.typing as npt

if TYPE_CHECKING:
    from scipy.sparse import csr_array

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


def hand_over(owner: Any, other: Any, *names: str) -> None:
    """Give ``other`` the values of these names that ``owner`` keeps."""
    vars(other).update({name: vars(owner)[name] for name in names if name in vars(owner)})


class cached_array(cached_property[Array]):
    """``cached_property`` for an array, which can then no longer be written to."""

    def __init__(self, method: Callable[[Any], Array]) -> None:
        @wraps(method)
        def computed(owner: Any) -> Array:
            return read_only(method(owner))

        super().__init__(computed)


def block_rows(blocks: Floats, corners: Ints, count: int) -> csr_array:
    """The matrix of blocks (r,k,c,d): c rows for each r, d columns for each of ``count`` vertices; the blocks
    of row r stand in the columns of the corners (r,k).

    >>> block_rows(np.array([[[[5.0]], [[7.0]]]]), np.array([[2, 0]]), 3).toarray().tolist()
    [[7.0, 0.0, 5.0]]
    """
    from scipy.sparse import bsr_array  # here, as much of pcmc never asks

    r, k, c, d = blocks.shape
    entries = blocks.reshape(-1, c, d), corners.ravel(), k * np.arange(r + 1)
    return bsr_array(entries, shape=(c * r, d * count)).tocsr()


def distinct(numbers: Ints, count: int) -> Ints:
    """The numbers 0 to count - 1 that occur, ascending: ``numpy.unique`` in linear time.

    >>> distinct(np.array([[4, 1], [1, 4]]), 5).tolist()
    [1, 4]
    """
    return np.flatnonzero(mask_of(numbers, count))


def mask_of(numbers: Ints | list[int], count: int) -> Bools:
    """(count,) whether each number from 0 to count - 1 is among these.

    >>> mask_of(np.array([[3, 1], [1, 3]]), 5).tolist()
    [False, True, False, True, False]
    """
    mask = np.zeros(count, dtype=bool)
    mask[numbers] = True
    return mask


def format_rows(template: str, *columns: npt.NDArray[Any]) -> str:
    """The template filled with each row of the columns; ``%r`` writes a float exactly.

    >>> format_rows("v %r %d\\n", np.array([0.1, 2.0]), np.array([3, 4]))
    'v 0.1 3\\nv 2.0 4\\n'
    """
    return "".join(template % row for row in zip(*(column.tolist() for column in columns), strict=True))


def plain(value: Any) -> Any:
    """The value in terms of JSON: tables as lists of rows, members of an Enum as words, None for numbers that
    are not finite.

    >>> plain({"a": np.array([1.5, np.nan]), "b": (np.int64(2), "text")})
    {'a': [1.5, None], 'b': [2, 'text']}
    """
    if isinstance(value, float):
        return value if math.isfinite(value) else None
    if value is None or isinstance(value, str | int):
        return value
    if isinstance(value, Mapping):
        return {str(key): plain(item) for key, item in value.items()}
    if hasattr(value, "to_dict"):  # a table; pandas takes long to import
        return [plain(row) for row in value.to_dict(orient="records")]
    if isinstance(value, list | tuple):
        return [plain(item) for item in value]
    if isinstance(value, np.ndarray | np.generic):
        return plain(value.tolist())
    return value.name.lower() if isinstance(value, Enum) else value


def toml(value: Any) -> str:
    """Plain data in TOML, in one line.

    >>> toml({"at": [1.0, 2.0], "süd": True})
    '{at = [1.0, 2.0], "süd" = true}'
    >>> toml(chr(127)).isascii(), chr(127) in toml(chr(127))
    (True, False)
    """
    if isinstance(value, Mapping):
        return f"{{{', '.join(f'{toml_key(key)} = {toml(item)}' for key, item in value.items())}}}"
    if isinstance(value, list | tuple):
        return f"[{', '.join(map(toml, value))}]"
    return json.dumps(value, ensure_ascii=False).replace("\x7f", "\\u007f")  # JSON may leave it


def toml_key(name: str) -> str:
    """A key of TOML, in quotes where it needs them."""
    return name if re.fullmatch(r"[A-Za-z0-9_-]+", name) else toml(name)
