"""The methods by name, each with the class of its options, and ``solve_once`` for all."""

from __future__ import annotations

from collections.abc import Callable
from importlib import import_module
from typing import TYPE_CHECKING, Any, NamedTuple

from ..base import validate
from ..base.errors import OptionError, SurfaceError
from ..surface import Surface, expect_surface

if TYPE_CHECKING:
    from .result import Callback, Result


class Method(NamedTuple):
    """A solver, called with a surface, its options and a callback; and the class of its options."""

    solve: Callable[..., Result]
    options: type[Any]


METHODS = ("newton", "nesterov", "lbfgs")


def find_method(name: str) -> Method:
    """The solver of this name and the class of its options; OptionError names the nearest one.

    >>> find_method("lbfgs").options().memory
    10
    """
    module = import_module(f".{validate.choice('method', name, METHODS)}", __package__)  # scipy's take long
    return Method(getattr(module, name), getattr(module, f"{name.capitalize()}Options"))


def solve_once(
    surface: Surface, method: str = "newton", callback: Callback | None = None, **options: Any
) -> Result:
    """Find an equilibrium, starting from the given surface.

    Arguments, result and errors are those of ``pcmc.solve``, which tries further starts if this one fails.

    >>> from pcmc import Patch, Surface
    >>> corners = [[1, 1, 0], [-1, 1, 0], [-1, -1, 0], [1, -1, 0], [0, 0, 1]]
    >>> pyramid = Surface(corners, [[0, 1, 4], [1, 2, 4], [2, 3, 4], [3, 0, 4]], [0] * 4,
    ...                   [Patch("roof", 1.0)], fixed=range(4))
    >>> solve_once(pyramid, "lbfgs", tolerance=1e-20).surface.vertices[4].round(6).tolist()
    [0.0, 0.0, 0.353553]
    >>> solve_once(pyramid, "nestrov")  # doctest: +ELLIPSIS
    Traceback (most recent call last):
    ...
    pcmc.base.errors.OptionError: unknown method 'nestrov'; did you mean 'nesterov'? Known: newton, ...
    """
    expect_surface(surface)
    solver = find_method(method)
    cannot = "slide vertices along lines" if surface.on_line else ""
    cannot = cannot or next((f"keep the volume of room {room.name!r}" for room in surface.rooms), "")
    cannot = cannot or ("move curved elements" if surface.order > 1 else "")
    if cannot and method != "newton":
        message = f"method {method!r} cannot {cannot}; use method='newton'"
        raise OptionError(message, what="method", found=method, expected="newton")
    if callback is not None and not callable(callback):
        validate.refuse("callback", callback, "a function of a Progress")
    if surface.size == 0.0:
        message = "solve: all vertices are at one point; start from a surface that has a size"
        raise SurfaceError(message, what="vertices")
    result: Result = solver.solve(surface, validate.build(solver.options, method, options), callback)
    return result
