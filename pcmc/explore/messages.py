"""Messages to the page: a JSON header and the arrays it names, in one run of bytes.

4 bytes     length of the header, little-endian
header      JSON, padded with spaces to a multiple of 4 bytes; "arrays" lists [name, type, count]
arrays      one after another, little-endian, 4 bytes a number: "f" float32, "u" uint32
"""

from __future__ import annotations

import json
from collections.abc import Mapping
from typing import Any

import numpy as np
import numpy.typing as npt

from ..base.arrays import plain

KINDS = {"f": "<f4", "u": "<u4"}


def pack(header: Mapping[str, Any], arrays: Mapping[str, npt.NDArray[Any]]) -> bytes:
    """One message; float arrays become float32, integers uint32.

    >>> packed = pack({"a": float("nan")}, {"x": np.array([1.5])})
    >>> unpack(packed)
    ({'a': None}, {'x': array([1.5], dtype=float32)})
    """
    listed, blocks = [], []
    for name, array in arrays.items():
        kind = "f" if array.dtype.kind == "f" else "u"
        listed.append([name, kind, int(array.size)])
        blocks.append(np.ascontiguousarray(array, dtype=KINDS[kind]).tobytes())
    text = json.dumps(plain({**header, "arrays": listed}), allow_nan=False).encode()
    text += b" " * (-len(text) % 4)
    return b"".join([len(text).to_bytes(4, "little"), text, *blocks])


def unpack(message: bytes) -> tuple[dict[str, Any], dict[str, npt.NDArray[Any]]]:
    """Header and flat arrays of a message: the inverse of ``pack``."""
    start = 4 + int.from_bytes(message[:4], "little")
    header = json.loads(message[4:start])
    arrays = {}
    for name, kind, count in header.pop("arrays"):
        arrays[name] = np.frombuffer(message, KINDS[kind], count, start)
        start += 4 * count
    return header, arrays
