"""A page in the browser to try tensions and pressures on a surface, and the same in JupyterLab.

``pcmc.explore.serve(surface)`` opens the page and waits until Ctrl-C; ``pcmc.explore.show(surface)`` is the
page as the output of a notebook's cell. Both need nothing but the core install and a browser with WebGL 2.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from ..surface import Surface

if TYPE_CHECKING:
    from .server import Explorer, View

__all__ = ["attend", "serve", "show", "start"]


def serve(
    surface: Surface,
    host: str = "127.0.0.1",
    port: int = 0,
    open_browser: bool = True,
    title: str = "",
) -> None:
    """Explore a surface in the browser; returns when Ctrl-C is pressed.

    Every page that is opened, in however many browsers, gets a draft of its own. The surface is solved
    first, unless it is at rest already.

    Parameters
    ----------
    surface : the surface to start from; it is not changed.
    host : the address to listen on. The default is this machine alone; ``"0.0.0.0"`` lets everyone
        on the network in.
    port : 0 for any that is free.
    open_browser : open the page at once.
    title : shown at the page's head, such as the name of a file.

    Raises
    ------
    OptionError : when the address cannot be listened on.
    """
    attend(start(surface, host, port, title), open_browser)


def attend(explorer: Explorer, open_browser: bool = True) -> None:
    """Say where a running server is, open its page, and wait; Ctrl-C closes it."""
    import webbrowser

    print(f"Exploring at {explorer.url}  (Ctrl-C ends it)", flush=True)
    try:
        if open_browser:
            webbrowser.open(explorer.url)
        explorer.wait()
    except KeyboardInterrupt:
        pass
    finally:
        explorer.close()


def start(surface: Surface, host: str = "127.0.0.1", port: int = 0, title: str = "") -> Explorer:
    """The same server in the background: an Explorer with ``.url`` and ``.close()``."""
    from .server import Explorer

    return Explorer(surface, host, port, title)


def show(surface: Surface, height: int = 680, title: str = "") -> View:
    """The page as the output of a cell in JupyterLab.

    ``.surface`` of what is returned is the surface as it is shown now, with the tensions and pressures
    chosen, to work on in the next cell. The browser must run on the machine of the notebook's kernel.

    Parameters
    ----------
    surface : the surface to start from; it is not changed.
    height : of the page in pixels.
    title : shown at the page's head.
    """
    from .server import View

    return View(surface, height, title)
