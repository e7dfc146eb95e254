"""The command cache: the roofs of projects solved before."""

from __future__ import annotations

from typing import Annotated

import typer

from .. import project as projects
from . import OK


def cache_(
    clear: Annotated[bool, typer.Option("--clear", help="Remove all roofs that are kept.")] = False,
) -> int:
    """Show where the roofs of projects solved before are kept, or remove them.

    The variable PCMC_CACHE names another folder; PCMC_CACHE=off keeps nothing.

    \b
    Example:
      pcmc cache --clear
    """
    folder = projects.cache_folder()
    if folder is None:
        print("no roofs are kept (PCMC_CACHE=off)")
        return OK
    if clear:
        print(f"{len(projects.clear_cache())} roofs removed from {folder}")
        return OK
    files = projects.cached_files()
    print(f"{len(files)} roofs in {folder}, {sum(file.stat().st_size for file in files) / 1e6:.1f} MB")
    return OK
