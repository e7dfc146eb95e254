"""A declared grid of parameters and the function that is run at each of its points."""

from __future__ import annotations

import hashlib
import inspect
import itertools
import json
import math
from collections.abc import Callable, Iterator, Mapping, Sequence, Set
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from ..base import validate
from ..base.errors import OptionError, unknown
from .case_script import WORDS, resolve, scalar


@dataclass(frozen=True)
class Sweep:
    """A case function and what it is run at: every combination of the grid's values.

    Cases are numbered from 0 in the order of ``itertools.product``: the last axis runs fastest.

    Parameters
    ----------
    case : the function, as ``"package.module:function"`` or itself (then it must be importable by
        name: defined in a module, not in a notebook, a script or another function). It takes the
        parameters as keywords and returns a mapping of names to numbers, texts, truth values or
        None; ``"status"``, ``"verdict"`` and ``"message"`` in it are words about the case.
    grid : for each varied parameter the sequence of its values: numbers, texts, truth values, None,
        or lists and dicts of them.
    fixed : parameters that are the same in every case.

    Raises
    ------
    OptionError : a function that cannot be found, a parameter it does not take or lacks, an empty
        grid, a value that cannot be written to a file or occurs twice.

    >>> sweep = Sweep("math:ldexp", grid={})
    Traceback (most recent call last):
    pcmc.base.errors.OptionError: the grid is empty; give at least one parameter a list of values
    >>> sweep = Sweep("fractions:Fraction", {"numerator": [1, 2], "denominator": [3, 5]})
    >>> len(sweep), list(sweep)[1]
    (4, {'numerator': 1, 'denominator': 5})
    """

    case: str
    grid: Mapping[str, Sequence[Any]]
    fixed: Mapping[str, Any] = field(default_factory=dict)

    def __init__(
        self,
        case: str | Callable[..., Any],
        grid: Mapping[str, Sequence[Any]],
        fixed: Mapping[str, Any] | None = None,
    ) -> None:
        for what, values in (("grid", grid), ("fixed", fixed or {})):
            if not isinstance(values, Mapping) or not all(isinstance(name, str) for name in values):
                validate.refuse(what, values, "a dict by parameter names")
        axes = {name: _axis(name, grid[name]) for name in grid}
        plain = {name: _plain(value, name) for name, value in (fixed or {}).items()}
        vars(self).update(case=case if isinstance(case, str) else _path(case), grid=axes, fixed=plain)
        if not self.grid:
            raise OptionError("the grid is empty; give at least one parameter a list of values", what="grid")
        for name in self.grid.keys() & plain.keys():
            text = f"{name!r} is in the grid and among the fixed; keep one"
            raise OptionError(text, what="fixed", where=name)
        self._check_parameters()

    def _check_parameters(self) -> None:
        """Refuse a function that cannot be found, and parameters that it does not take."""
        names, case = [*self.grid, *self.fixed], self.case
        try:
            function = resolve(case)
        except (ImportError, AttributeError, ValueError) as error:
            text = f"the case {case!r} cannot be found ({error}); expected 'package.module:function'"
            raise OptionError(text, what="case", found=case) from error
        if not callable(function):
            text = f"the case {case!r} is not a function but {function!r:.60}"
            raise OptionError(text, what="case", found=case)
        for name in names:
            if name in ("case", *WORDS):
                text = f"a parameter may not be called {name!r}: a column has that name"
                raise OptionError(text, what=name)
        try:
            taken = inspect.signature(function).parameters
        except (TypeError, ValueError):
            text = f"{case!r} has no signature, so its parameters are unknown; wrap it in a function"
            raise OptionError(text, what="case", found=case) from None
        named = (inspect.Parameter.POSITIONAL_OR_KEYWORD, inspect.Parameter.KEYWORD_ONLY)
        keywords = [name for name, p in taken.items() if p.kind in named]
        takes_all = any(p.kind == inspect.Parameter.VAR_KEYWORD for p in taken.values())
        for name in names:
            if name not in keywords and not takes_all:
                text = f"{unknown('parameter', name, keywords)} (of {case})"
                raise OptionError(text, what=name, found=name, expected=tuple(keywords))
        for name in keywords:
            if taken[name].default is inspect.Parameter.empty and name not in names:
                raise OptionError(f"{case} needs the parameter {name!r}, which has no value", what=name)
        if (check := getattr(function, "check", None)) is not None:
            for parameters in self:
                check(**parameters)

    def __len__(self) -> int:
        return math.prod(len(values) for values in self.grid.values())

    def __iter__(self) -> Iterator[dict[str, Any]]:
        """The parameters of each case, in order."""
        for values in itertools.product(*self.grid.values()):
            yield dict(zip(self.grid, values, strict=True)) | dict(self.fixed)

    @property
    def fingerprint(self) -> str:
        """SHA-256 of the case's name, the grid with its order, and the fixed parameters."""
        parts = [self.case, list(self.grid.items()), sorted(self.fixed.items())]
        return hashlib.sha256(json.dumps(parts, sort_keys=True).encode()).hexdigest()


def checked(check: Callable[..., object]) -> Callable[[Callable[..., Any]], Callable[..., Any]]:
    """Decorator of a function with ``**arguments``: ``check`` refuses a bad case before any case is run.

    >>> def known(arguments):
    ...     if "wall" not in arguments:
    ...         raise ValueError("a wall is needed")
    >>> @checked(known)
    ... def case(**arguments):
    ...     return {"rise": 1.0 / arguments["wall"]}
    >>> case(wall=2.0)
    {'rise': 0.5}
    """

    def mark(function: Callable[..., Any]) -> Callable[..., Any]:
        function.__dict__["check"] = check
        return function

    return mark


def _path(function: Callable[..., Any]) -> str:
    module = getattr(function, "__module__", None)
    name = getattr(function, "__qualname__", "<unnamed>")
    if module in (None, "__main__") or "<" in name:
        text = f"the case function {name!r} cannot be imported by a worker; put it at the top level of"
        text += " a module (a file of its own) and import it from there"
        raise OptionError(text, what="case", found=name)
    return f"{module}:{name}"


def _axis(name: str, values: object) -> list[Any]:
    if isinstance(values, str | bytes | Mapping | Set) or not np.iterable(values):
        text = f"grid[{name!r}] must be a list of values, found {values!r:.60}"
        raise OptionError(f"{text}; a single value belongs to fixed", what="grid", where=name, found=values)
    axis = [_plain(value, f"{name}[{i}]") for i, value in enumerate(values)]
    if not axis:
        raise OptionError(f"grid[{name!r}] is empty; give it at least one value", what="grid", where=name)
    seen: dict[str, int] = {}
    for i, value in enumerate(axis):
        first = seen.setdefault(json.dumps(value, sort_keys=True), i)
        if first != i:
            text = f"grid[{name!r}] has the value {value!r} twice, at {first} and {i}"
            raise OptionError(text, what="grid", where=(name, i), found=value)
    return axis


def _plain(value: object, where: str) -> Any:
    """The value as plain lists, dicts and scalars, which a file gives back unchanged."""
    if isinstance(value, Mapping):
        if not all(isinstance(key, str) for key in value):
            text = f"parameter {where}: keys must be texts, found {list(value)!r:.60}"
            raise OptionError(text, what=where, found=value)
        return {key: _plain(item, f"{where}[{key!r}]") for key, item in value.items()}
    if isinstance(value, list | tuple) or (isinstance(value, np.ndarray) and value.ndim):
        return [_plain(item, f"{where}[{i}]") for i, item in enumerate(value)]
    try:
        return scalar(value)
    except TypeError as error:
        raise OptionError(f"parameter {where}: {error}", what=where, found=value) from None
