"""One study in a process of its own: ``python -m studies.worker NAME --results FOLDER``.

It prints the name of each step before it begins it, and nothing else, so that its parent can show the
progress. A crash, also one in a library, ends this process only.
"""

from __future__ import annotations

import argparse
import sys
from pathlib import Path

from pcmc.base.errors import MissingExtra, PcmcError

from .registry import chosen
from .study import STEPS, perform


def main(arguments: list[str] | None = None) -> int:
    """Run the study; the exit code, 0 if every step succeeded."""
    parser = argparse.ArgumentParser(prog="python -m studies.worker")
    parser.add_argument("name")
    parser.add_argument("--results", type=Path, required=True)
    parser.add_argument("--steps", nargs="+", choices=STEPS, default=list(STEPS))
    parser.add_argument("--short", action="store_true")
    options = parser.parse_args(arguments)
    try:
        (study,) = chosen([options.name])
        perform(
            study,
            options.results,
            short=options.short,
            steps=options.steps,
            announce=lambda step: print(step, flush=True),
        )
    except (PcmcError, MissingExtra) as error:
        print(error, file=sys.stderr)
        return 1
    except KeyboardInterrupt:
        return 130
    return 0


if __name__ == "__main__":
    sys.exit(main())
