"""The solvers: a method each, branches of equilibria, further starts, and films whose neighbours swap.

Gives ``solve``, the package's own, ``solve_once``, which tries the given start alone, ``find_method`` and
``METHODS``. May import ``certificate`` and below.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from importlib import import_module
from typing import TYPE_CHECKING, Any, NamedTuple

from ..base import validate
from ..base.errors import OptionError, SurfaceError
from ..surface import Surface, expect_surface

if TYPE_CHECKING:
    from .result import Callback, Result

__all__ = ["METHODS", "find_method", "solve", "solve_once"]
METHODS = ("newton", "nesterov", "lbfgs")


class Method(NamedTuple):
    """A solver, called with a surface, its options and a callback; and the class of its options."""

    solve: Callable[..., Result]
    options: type[Any]


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
    cannot = cannot or ("move a periodic surface" if surface.periodic else "")
    if cannot and method != "newton":
        message = f"method {method!r} cannot {cannot}; use method='newton'"
        raise OptionError(message, what="method", found=method, expected="newton")
    validate.callback("callback", callback, "a function of a Progress")
    if surface.size == 0.0:
        message = "solve: all vertices are at one point; start from a surface that has a size"
        raise SurfaceError(message, what="vertices")
    return solver.solve(surface, validate.options_from(solver.options, method, options), callback)


def solve(
    surface: Surface, method: str = "newton", callback: Callback | None = None, **options: Any
) -> Result:
    """Find an equilibrium, first from the given surface; if that leads to none, from further starts.

    With ``method="newton"``, a surface that inflates, pinches off, collapses or stalls is solved again: from
    a low start; by raising pressure and weight along the branch of equilibria; from equal tensions; and, for
    a film between several held curves, by moving these apart. A branch that folds before it arrives says
    where it ends, not that there is no equilibrium on another. A part that nothing fixes, under pressure, is
    at rest only at a saddle; where a minimum is sought, that saddle is the result.

    Parameters
    ----------
    surface : the surface to start from; it is not changed.
    method : ``"newton"``, the geometric solver; ``"nesterov"``, the paper's flow; ``"lbfgs"``,
        NLopt's L-BFGS. Only the first tries further starts.
    callback : called with a Progress after each iteration (each evaluation for ``"lbfgs"``). Raise
        StopIteration in it to stop; any other exception passes through, and as a RuntimeError also the
        StopIteration of a ``next()`` in it.
    options : fields of the method's options class: ``NewtonOptions``, ``NesterovOptions``, ``LbfgsOptions``.

    Returns
    -------
    Result
        Not converging is a status there, never an exception: NO_EQUILIBRIUM with ``proofs`` that no smooth
        surface is at rest, or NONE_FOUND with what was ``tried``. Ctrl-C stops as StopIteration does.

    Raises
    ------
    OptionError : an unknown method or option, with the nearest known one, or a value out of range.
    SurfaceError : ``surface`` is no Surface, or all of its vertices are at one point.

    See Also
    --------
    pcmc.solvers.solve_once : the same from the given start alone.

    Examples
    --------
    A pyramid of tension α over a square, E = 4 α √(1 + h²) - 4h/3, has an equilibrium for α > 1/3.

    >>> from pcmc import Patch, Surface
    >>> corners = [[1, 1, 0], [-1, 1, 0], [-1, -1, 0], [1, -1, 0], [0, 0, 1]]
    >>> pyramid = Surface(corners, [[0, 1, 4], [1, 2, 4], [2, 3, 4], [3, 0, 4]], [0] * 4,
    ...                   [Patch("roof", 1.0)], fixed=range(4))
    >>> solve(pyramid).surface.vertices[4].round(6).tolist()
    [0.0, 0.0, 0.353553]
    >>> result = solve(pyramid.retensioned({"roof": 0.2}))
    >>> result.status.name, result.certificate.verdict.name
    ('NO_EQUILIBRIUM', 'NO_EQUILIBRIUM')
    >>> print(result.proofs[0])
    the pressure is 2.50 times what the boundary's tension could carry on any smooth surface
    """
    first = solve_once(surface, method, callback, **options)
    if method != "newton" or first.converged or first.surface.order > 1 or surface.periodic:
        return first
    from .search import search

    flat = {name: value for name, value in options.items() if name != "order"}
    found = search(surface, first, callback, flat)
    if not found.converged or flat == options:
        return found
    curved = solve_once(found.surface, method, callback, **options | {"levels": 0})
    return replace(curved, note="; ".join(filter(None, (found.note, curved.note))))
