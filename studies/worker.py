"""One study in a process of its own: ``python -m studies.worker NAME --results FOLDER``.

It prints the name of each step before it takes it, and nothing else, so that whoever started it can
show how far it is. A crash, even of a library's, ends this process only.
"""

from __future__ import annotations

import argparse
import sys
from pathlib import Path

from pcmc.base.errors import MissingExtra, PcmcError

from .registry import chosen
from .study import STEPS, perform


def main(words: list[str] | None = None) -> int:
    """Run it; 0 when every step was taken."""
    parser = argparse.ArgumentParser(prog="python -m studies.worker")
    parser.add_argument("name")
    parser.add_argument("--results", type=Path, required=True)
    parser.add_argument("--steps", nargs="+", choices=STEPS, default=list(STEPS))
    parser.add_argument("--short", action="store_true")
    asked = parser.parse_args(words)
    try:
        (study,) = chosen([asked.name])
        perform(
            study, asked.results, short=asked.short, steps=asked.steps,
            announce=lambda step: print(step, flush=True),
        )  # fmt: skip
    except (PcmcError, MissingExtra) as error:
        print(error, file=sys.stderr)
        return 1
    except KeyboardInterrupt:
        return 130
    return 0


if __name__ == "__main__":
    sys.exit(main())
