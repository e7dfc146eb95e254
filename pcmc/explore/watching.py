"""Following a file: when it or a drawing that it refers to is saved, its roof is read again."""

from __future__ import annotations

import threading
from collections.abc import Callable
from pathlib import Path

from ..base.errors import MissingExtra, PcmcError
from .roof import Roof, Signature, signature

EVERY = 0.5  # seconds between two looks


class Watch:
    """A thread that reads a roof again whenever its files change.

    Attributes
    ----------
    problem : why the newest save has no roof, in one line; empty if it has one.
    working : whether the roof of a save is being computed.
    """

    def __init__(self, path: Path, seen: Signature, read: Callable[[], Roof], show: Callable[[Roof], None]):
        self.path, self.seen = path, seen
        self._read, self._show = read, show
        self.problem, self.working = "", False
        self._end = threading.Event()
        self._thread = threading.Thread(target=self._run, daemon=True)
        self._thread.start()

    def close(self) -> None:
        """End the thread."""
        self._end.set()

    def _run(self) -> None:
        last = self.seen
        while not self._end.wait(EVERY):
            now = signature(self.path)
            if now != self.seen and now == last:  # saved, and no longer being written
                self.seen = now
                self._follow()
            last = now

    def _follow(self) -> None:
        self.working = True
        try:
            roof = self._read()
            if roof.good:
                self._show(roof)
            self.problem = "" if roof.good else roof.note
        except (PcmcError, MissingExtra, OSError) as error:
            self.problem = " ".join(str(error).replace(f"{self.path}: ", "").split())
        except Exception as error:  # the net: the page must learn that its shape is an old one
            self.problem = " ".join(f"{type(error).__name__}: {error}".split())
        finally:
            self.working = False
