"""A page in the browser, or in JupyterLab, that moves a surface by sliders for its tensions and pressures.

``pcmc.explore.serve(surface)`` opens the page and waits until Ctrl-C; ``pcmc.explore.show(surface)`` is the
page as the output of a notebook's cell. Both need only the core install and a browser with WebGL 2.
May import ``project`` and the rooms below it.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING

from ..base.units import NO_UNITS, Units, as_units
from ..surface import Surface

if TYPE_CHECKING:
    from .roof import ShownRoof
    from .server import Explorer, View

__all__ = ["open_and_wait", "serve", "show", "start"]


def serve(
    surface: Surface,
    host: str = "127.0.0.1",
    port: int = 0,
    open_browser: bool = True,
    title: str = "",
    units: Units | str = NO_UNITS,
) -> None:
    """Explore a surface in the browser; returns when Ctrl-C is pressed.

    Every page has its own session. The surface is solved first, unless it is at rest already.

    Parameters
    ----------
    surface : the surface to start from; it is not changed.
    host : the address to listen on; ``"0.0.0.0"`` lets everyone on the network in.
    port : 0 for any that is free.
    title : at the top of the page, such as the name of a file.
    units : of the surface's numbers, such as ``Units("m", "kN")``; a text is the unit of length.

    Raises
    ------
    OptionError : for unknown units, and if the server cannot listen on the address.
    """
    open_and_wait(start(surface, host, port, title, units), open_browser)


def open_and_wait(explorer: Explorer, open_browser: bool = True) -> None:
    """Print the address of a running server, open its page, and wait; Ctrl-C closes the server."""
    import webbrowser

    print(f"Exploring at {explorer.url}  (press Ctrl-C to stop)", flush=True)
    try:
        if open_browser:
            webbrowser.open(explorer.url)
        explorer.wait()
    except KeyboardInterrupt:
        print("stopped: the page can compute and save nothing more")
    finally:
        explorer.close()


def start(
    roof: Surface | ShownRoof,
    host: str = "127.0.0.1",
    port: int = 0,
    title: str = "",
    units: Units | str = NO_UNITS,
    watch: Callable[[], ShownRoof] | None = None,
) -> Explorer:
    """Start the server in the background; the Explorer returned has ``.url`` and ``.close()``.

    With ``watch``, which reads the roof of a file again, the page follows that file.

    >>> from pcmc.explore.roof import read_roof
    >>> explorer = start(read_roof("notebooks/roof.toml"))
    >>> explorer.start.certificate.verdict.name
    'STABLE'
    >>> explorer.close()
    """
    from .roof import ShownRoof
    from .server import Explorer

    shown = roof if isinstance(roof, ShownRoof) else ShownRoof.of(roof, title, as_units(units))
    return Explorer(shown, host, port, watch)


def show(surface: Surface, height: int = 680, title: str = "", units: Units | str = NO_UNITS) -> View:
    """The page as the output of a cell in JupyterLab.

    The View returned has ``.surface``, with the tensions and pressures now chosen, for the next cell. The
    browser must run on the kernel's machine. ``height`` is in pixels; the rest as for ``serve``.
    """
    from .roof import ShownRoof
    from .server import View

    return View(ShownRoof.of(surface, title, as_units(units)), height)
