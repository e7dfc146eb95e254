"""The case most sweeps want: build a surface, solve it, certify it."""

from __future__ import annotations

import inspect
import numbers
from collections.abc import Callable, Iterator, Mapping
from dataclasses import fields, is_dataclass
from enum import Enum
from importlib import import_module
from typing import Any

import pcmc

from ..energy import gradient
from ..errors import OptionError, unknown
from ..solvers import METHODS, solve
from .child import resolve
from .grid import checked

Parts = tuple[Callable[..., Any], dict[str, Any], dict[str, Any]]


def _split(generator: str, method: str, arguments: Mapping[str, Any]) -> Parts:
    """The generator, and which arguments are its own and which the solver's."""
    try:
        build = resolve(generator)
        own = inspect.signature(build).parameters
    except (ImportError, AttributeError, ValueError, TypeError) as error:
        raise OptionError(
            f"the generator {generator!r} cannot be found ({error}); expected 'generators:two_caps'"
            " or 'package.module:function'"
        ) from error
    if method not in METHODS:
        raise OptionError(unknown("method", method, METHODS))
    options = getattr(import_module(f"pcmc.solvers.{method}"), METHODS[method])
    known = [f.name for f in fields(options)]
    for name in arguments:
        if name not in own and name not in known:
            of = f"{generator} or of method {method!r}"
            raise OptionError(unknown(f"parameter of {of}:", name, [*own, *known]))
    shape = {name: value for name, value in arguments.items() if name in own}
    solver = {name: value for name, value in arguments.items() if name not in own}
    options(**solver)  # refuses bad values
    return build, shape, solver


@checked(lambda generator, method="newton", **arguments: _split(generator, method, arguments))
def solve_case(generator: str, method: str = "newton", **arguments: Any) -> dict[str, Any]:
    """Build a surface with a generator, solve it, certify it; every number of the certificate.

    Parameters
    ----------
    generator : a function that returns a Surface: ``"generators:two_caps"``.
    method : as of ``pcmc.solve``.
    arguments : parameters of the generator and options of the method. A name that both have is the
        generator's.

    Returns
    -------
    dict : ``status`` (the solver's, in small letters), ``verdict`` of the certificate, ``message``,
        then ``energy``, ``gradient_squared`` (‖∇E‖², the paper's squared sum),
        ``iterations_taken``, ``evaluations_made``, ``triangles``, and the certificate's numbers;
        those in mappings and nested values as ``name.key``, arrays left out.

    Raises
    ------
    OptionError : an unknown generator, method or parameter name. A sweep raises it before any case
        is run.
    """
    build, shape, solver = _split(generator, method, arguments)
    result = solve(build(**shape), method, **solver)
    told = {
        "status": result.status.name.lower().replace("_", " "),
        "verdict": "",
        "message": result.message,
        "energy": result.energy,
        "gradient_squared": float((gradient(result.surface) ** 2).sum()),
        "iterations_taken": result.iterations,
        "evaluations_made": result.evaluations,
        "triangles": result.surface.m,
    }
    certify = getattr(pcmc, "certify", None)
    certificate = dict(numbers_of(certify(result.surface))) if certify else {}
    return told | {name: value for name, value in certificate.items() if name not in arguments}


def numbers_of(value: object, prefix: str = "") -> Iterator[tuple[str, Any]]:
    """Names and values of all numbers, words and truth values in a dataclass or mapping.

    >>> dict(numbers_of({"index": 1, "error": {"large": 0.5, "small": None}, "modes": [1, 2]}))
    {'index': 1, 'error.large': 0.5, 'error.small': None}
    """
    if is_dataclass(value):
        items = [(f.name, getattr(value, f.name)) for f in fields(value)]
    elif isinstance(value, Mapping):
        items = [(str(key), item) for key, item in value.items()]
    else:
        items = []
    for name, item in items:
        if isinstance(item, Enum):
            yield prefix + name, item.name.lower().replace("_", " ")
        elif item is None or isinstance(item, str | bool | numbers.Number):
            yield prefix + name, item
        elif getattr(item, "shape", None) == ():
            yield prefix + name, item.item()
        else:
            yield from numbers_of(item, f"{prefix}{name}.")
