"""``python -m pcmc.compas``: the service for ``compas.rpc.Proxy``; with ``--folder``, its settings."""

from __future__ import annotations

import argparse
import sys
from contextlib import suppress

from ..base.errors import MissingExtra, PcmcError


def command() -> int:
    """Serve, or set up; 2 if that cannot be."""
    parser = argparse.ArgumentParser(prog="python -m pcmc.compas", description=__doc__, allow_abbrev=False)
    parser.add_argument("--folder", help="let pcmc read and write in this folder, make a new secret, and end")
    parser.add_argument("--port", type=int, help="of the service; without it that of the settings")
    for name in ("--autoreload", "--no-autoreload"):  # Proxy passes one of them
        parser.add_argument(name, action="store_true", help=argparse.SUPPRESS)
    given = parser.parse_args()
    try:
        from .server import serve_calls, set_up

        if given.folder is None:
            with suppress(KeyboardInterrupt):
                serve_calls(given.port)
        else:
            print(f"settings for Proxy, with its secret: {set_up(given.folder)}")
    except (PcmcError, MissingExtra) as error:
        print(f"error: {error}", file=sys.stderr)
        return 2
    return 0


if __name__ == "__main__":
    sys.exit(command())
