"""One call for every solver."""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

from ..base.errors import OptionError, SurfaceError, unknown
from ..base.validate import build
from ..surface import Surface

if TYPE_CHECKING:
    from .result import Callback, Result

# A method's module holds a function of its name and its options; imported when asked for.
METHODS = {"newton": "NewtonOptions", "nesterov": "NesterovOptions", "lbfgs": "LbfgsOptions"}


def solve(
    surface: Surface, method: str = "newton", callback: Callback | None = None, **options: Any
) -> Result:
    """Seek an equilibrium from where the surface stands.

    Parameters
    ----------
    surface : the surface to start from; it is not changed.
    method : ``"newton"``, the geometric solver; ``"nesterov"``, the paper's flow; ``"lbfgs"``,
        NLopt's L-BFGS.
    callback : called with a Progress after each iteration (each evaluation for ``"lbfgs"``). Raise
        StopIteration in it to stop; any other exception passes through.
    options : fields of the method's options class: ``NewtonOptions``, ``NesterovOptions``,
        ``LbfgsOptions``.

    Returns
    -------
    Result
        Not converging is a status there, never an exception.

    Raises
    ------
    OptionError
        For an unknown method or option, with the nearest known one, or a value it may not have.
    SurfaceError
        For what is no Surface, or one whose vertices are all at one point.

    Examples
    --------
    >>> from pcmc import Patch, Surface
    >>> corners = [[1, 1, 0], [-1, 1, 0], [-1, -1, 0], [1, -1, 0], [0, 0, 1]]
    >>> pyramid = Surface(corners, [[0, 1, 4], [1, 2, 4], [2, 3, 4], [3, 0, 4]], [0] * 4,
    ...                   [Patch("roof", 1.0)], fixed=range(4))
    >>> solve(pyramid, "lbfgs", tolerance=1e-20).surface.vertices[4].round(6).tolist()
    [0.0, 0.0, 0.353553]
    >>> solve(pyramid, "nestrov")  # doctest: +ELLIPSIS
    Traceback (most recent call last):
    ...
    pcmc.base.errors.OptionError: unknown method 'nestrov'; did you mean 'nesterov'? Known: newton, ...
    """
    if not isinstance(surface, Surface):
        raise SurfaceError(f"solve: expected a Surface, found {type(surface).__name__}")
    if method not in METHODS:
        raise OptionError(unknown("method", method, METHODS))
    if callback is not None and not callable(callback):
        raise OptionError(f"callback: expected a function of a Progress, found {callback!r}")
    if surface.size == 0.0:
        raise SurfaceError("solve: all vertices are at one point; there is no shape to start from")
    module = import_module(f".{method}", __package__)
    chosen = build(getattr(module, METHODS[method]), method, options)
    result: Result = getattr(module, method)(surface, chosen, callback)
    return result
