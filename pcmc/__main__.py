"""``python -m pcmc``: the command, where the shell does not find ``pcmc``."""

from .cli import main

if __name__ == "__main__":
    raise SystemExit(main())
