"""The process a case runs in: takes cases from its standard input, answers on its standard output.

``isolate`` starts this file as a script. It needs the standard library alone, so that a worker is
ready in some hundredths of a second and its death costs no more; ``grid`` borrows its helpers.
"""

from __future__ import annotations

import faulthandler
import gc
import importlib
import importlib.metadata
import importlib.util
import io
import operator
import os
import pickle
import platform
import signal
import sys
import threading
import time
import traceback
from collections.abc import Callable, Mapping
from datetime import UTC, datetime
from typing import Any, BinaryIO

WORDS = ("status", "verdict", "message")  # keys of a case's answer that hold text about the case
OUTPUT = 4000  # characters kept of what a failed case says
LONGEST = 1024  # bits of a whole number, the range of floats; far longer ones have no decimal text
DISTRIBUTIONS = {"pcmc": "pcmc-surfaces"}  # where a package is installed under another name
ORPHANED = 1.0  # seconds between looks whether the parent lives


def resolve(case: str) -> Callable[..., Any]:
    """The function that ``"package.module:function"`` names.

    >>> resolve("math:hypot")(3.0, 4.0)
    5.0
    """
    module, _, name = case.partition(":")
    found: Callable[..., Any] = operator.attrgetter(name)(importlib.import_module(module))
    return found


def scalar(value: object) -> bool | int | float | str | None:
    """The plain Python value of a number, text, truth value or None; a TypeError for all else.

    All else includes what no file can hold: texts with half a character, whole numbers beyond floats.

    >>> import numpy as np
    >>> scalar(np.float64(0.1)), scalar(np.int32(3)), scalar(np.bool_(True))
    (0.1, 3, True)
    """
    masked = hasattr(value, "mask")  # numpy would make a 0 of it
    if getattr(value, "shape", None) == () and hasattr(value, "item") and not masked:
        value = value.item()
    if value is None or isinstance(value, bool):
        return value
    if isinstance(value, int) and value.bit_length() > LONGEST:
        raise TypeError(f"expected a number, found a whole one of {value.bit_length()} bits")
    if isinstance(value, str) and value != whole_text(value):
        raise TypeError(f"expected a text of whole characters, found {value!r:.80}")
    for kind in (int, float, str):
        if isinstance(value, kind):
            return kind(value)  # subclasses print themselves in ways of their own
    raise TypeError(f"expected a number, a text, a truth value or None, found {value!r:.80}")


def whole_text(text: str) -> str:
    r"""The text with halves of characters, which no file can hold, spelt out.

    >>> whole_text("half: \ud800")
    'half: \\ud800'
    """
    return text.encode("utf-8", "backslashreplace").decode()


def answer(values: object, parameters: Mapping[str, Any]) -> dict[str, Any]:
    """Sort what a case returned into status, verdict, message and numbers.

    >>> answer({"verdict": "stable", "energy": 1.5}, {"alpha": 0.6})
    {'status': 'finished', 'verdict': 'stable', 'message': '', 'numbers': {'energy': 1.5}}
    """
    if not isinstance(values, Mapping):
        raise TypeError(f"a case returns a mapping of names to numbers, found {values!r:.80}")
    fields: dict[str, Any] = {"status": "finished", "verdict": "", "message": "", "numbers": {}}
    for name, value in values.items():
        if not isinstance(name, str) or name in parameters or name == "case":
            raise TypeError(f"a case may not call a number {name!r}: a parameter has that name")
        try:
            plain = scalar(value)
        except TypeError as error:
            raise TypeError(f"{name!r} of a case's answer: {error}") from None
        if name in WORDS:
            fields[name] = "" if plain is None else str(plain)
        else:
            fields["numbers"][name] = plain
    return fields


def run(
    function: Callable[..., Any], parameters: Mapping[str, Any], time_limit: float | None
) -> dict[str, Any]:
    """Run one case; the outcome without its provenance. The process exits at the time limit."""
    started, begin, extra = datetime.now(UTC), time.perf_counter(), {}
    process = os.getpid()
    if time_limit is not None:
        # a watchdog of C: it works while compiled code holds the interpreter or the parent is dead
        faulthandler.dump_traceback_later(time_limit, exit=True)
    try:
        fields = answer(function(**parameters), parameters)
    except BaseException as error:  # nobody but the case can have raised it: Ctrl-C goes elsewhere
        text = whole_text("".join(traceback.format_exception_only(error)).strip()[:OUTPUT])
        fields = {"status": "raised", "verdict": "", "message": text, "numbers": {}}
        extra = {"output": whole_text(traceback.format_exc()[-OUTPUT:])}
    finally:
        if os.getpid() != process:
            os._exit(0)  # a fork that the case has made; the case itself answers
        faulthandler.cancel_dump_traceback_later()
    fields["wall_time"] = time.perf_counter() - begin
    fields["provenance"] = {"started": started.isoformat(timespec="milliseconds"), **extra}
    return fields


def postpone(name: str) -> None:
    """Have a module of an imported package run when something in it is used, not when it is named."""
    package, _, last = name.rpartition(".")
    if package not in sys.modules or name in sys.modules:
        return
    found = importlib.util.find_spec(name)
    if found is None or found.loader is None:
        return
    found.loader = importlib.util.LazyLoader(found.loader)
    module = importlib.util.module_from_spec(found)
    sys.modules[name] = module
    found.loader.exec_module(module)
    setattr(sys.modules[package], last, module)


def provenance() -> dict[str, Any]:
    """Where this process runs and with what."""
    told: dict[str, Any] = {"host": platform.node(), "pid": os.getpid()}
    told["python"] = platform.python_version()
    for package in ("pcmc", "numpy", "scipy", "numba"):
        told[package] = version(package)
    return told


def version(package: str) -> str:
    """The installed version of a package, or ``"not installed"``."""
    try:
        return importlib.metadata.version(DISTRIBUTIONS.get(package, package))
    except importlib.metadata.PackageNotFoundError:
        return "not installed"


def _forget_output() -> None:
    """Empty the file that keeps what a case prints before it dies."""
    sys.stdout.flush()
    os.lseek(2, 0, os.SEEK_SET)
    os.ftruncate(2, 0)


def _cut_forks_off(*pipes: BinaryIO) -> None:
    """Take the pipes from every process that a case forks: it must neither answer nor hold them open."""
    nothing = os.open(os.devnull, os.O_RDWR)
    if hasattr(os, "register_at_fork"):
        os.register_at_fork(
            after_in_child=lambda: [os.dup2(nothing, pipe.fileno(), False) for pipe in pipes]
        )


def _outlive(parent: int) -> None:
    """End this process and what it started soon after its parent, in the middle of a case too."""
    while os.getppid() == parent:  # for ever on Windows, where the case is run to its end
        time.sleep(ORPHANED)
    os.killpg(0, signal.SIGKILL)


def _reply(stream: BinaryIO, message: object) -> None:
    stream.write(pickle.dumps(message))
    stream.flush()


def main() -> None:
    """Answer cases until the other side closes."""
    requests, answers = os.fdopen(os.dup(0), "rb"), os.fdopen(os.dup(1), "wb")
    os.dup2(os.open(os.devnull, os.O_RDONLY), 0)
    os.dup2(2, 1)  # what a case prints must not get between the answers
    if isinstance(sys.stdout, io.TextIOWrapper):
        sys.stdout.reconfigure(line_buffering=True)
    faulthandler.enable()
    _cut_forks_off(requests, answers)
    threading.Thread(target=_outlive, args=(os.getppid(),), daemon=True).start()
    try:
        path, case = pickle.load(requests)
        sys.path[:] = path
        try:
            gc.disable()  # looking for garbage takes a fifth of the time of large imports
            function = resolve(case)
            # scipy names all that numpy has; these tables take long to make and no case needs them
            postpone("numpy.f2py")
        except Exception:
            _reply(answers, ("failed", traceback.format_exc(limit=-3)))
            return
        about = provenance()
        _reply(answers, ("ready", None))
        while True:
            parameters, time_limit = pickle.load(requests)
            _forget_output()
            outcome = run(function, parameters, time_limit)
            outcome["provenance"] |= about
            _reply(answers, outcome)
            if not gc.isenabled():  # the first case has imported the rest
                gc.freeze()
                gc.enable()
    except (EOFError, BrokenPipeError):
        os._exit(0)  # nobody is left to answer to


if __name__ == "__main__":
    main()
