"""What runs cases in a case process, which loads this file by its path. It imports the standard library
alone, so that a process starts in some hundredths of a second."""

from __future__ import annotations

import faulthandler
import gc
import importlib
import importlib.metadata
import importlib.util
import operator
import os
import platform
import sys
import time
import traceback
from collections.abc import Callable, Mapping
from datetime import UTC, datetime
from functools import cache
from typing import Any

WORDS = ("status", "verdict", "message")  # keys of a case's answer that are not numbers
OUTPUT = 4000  # characters of a failed case's output that are stored
LONGEST = 1024  # bits of an integer, the range of floats; far longer ones have no decimal text
DISTRIBUTIONS = {"pcmc": "pcmc-surfaces"}  # where a package is installed under another name


def resolve(case: str) -> Callable[..., Any]:
    """The function that ``"package.module:function"`` names.

    >>> resolve("math:hypot")(3.0, 4.0)
    5.0
    """
    module, _, name = case.partition(":")
    return operator.attrgetter(name)(importlib.import_module(module))


def scalar(value: object) -> bool | int | float | str | None:
    """The plain Python value of a number, text, truth value or None; a TypeError for anything else, and for
    what no file can hold: texts with lone surrogates, integers beyond the range of floats.

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
        raise TypeError(f"expected a number in the range of floats, found {value.bit_length()} bits")
    if isinstance(value, str) and value != escape_surrogates(value):
        raise TypeError(f"expected a text without lone surrogates, found {value!r:.80}")
    for kind in (int, float, str):
        if isinstance(value, kind):
            return kind(value)  # subclasses print themselves in ways of their own
    raise TypeError(f"expected a number, a text, a truth value or None, found {value!r:.80}")


def escape_surrogates(text: str) -> str:
    r"""The text with lone surrogates, which no file can hold, as escapes.

    >>> escape_surrogates("half: \ud800")
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


def import_case(case: str) -> None:
    """Import a case, which then runs without garbage collection once: it takes a fifth of large imports."""
    gc.disable()
    resolve(case)
    postpone("numpy.f2py")  # scipy imports all of numpy; this part takes long and no case needs it
    environment()


def answer_case(case: str, parameters: Mapping[str, Any], time_limit: float | None) -> dict[str, Any]:
    """Run one case that is loaded; its outcome. The process exits at the time limit."""
    function, process, extra = resolve(case), os.getpid(), {}
    started, begin = datetime.now(UTC).isoformat(timespec="milliseconds"), time.perf_counter()
    if time_limit is not None:
        # written in C: it works while compiled code holds the interpreter, and if the parent is dead
        faulthandler.dump_traceback_later(time_limit, exit=True)
    try:
        fields = answer(function(**parameters), parameters)
    except BaseException as error:  # Ctrl-C does not reach this process, so the case has raised it
        text = escape_surrogates("".join(traceback.format_exception_only(error)).strip()[:OUTPUT])
        fields = {"status": "raised", "verdict": "", "message": text, "numbers": {}}
        extra = {"output": escape_surrogates(traceback.format_exc()[-OUTPUT:])}
    finally:
        if os.getpid() != process:
            os._exit(0)  # this is a fork that the case has made; only the case itself answers
        faulthandler.cancel_dump_traceback_later()
    seconds = time.perf_counter() - begin
    if not gc.isenabled():  # the first case has imported the rest
        gc.freeze()
        gc.enable()
    return {**fields, "wall_time": seconds, "provenance": {"started": started, **extra, **environment()}}


def postpone(name: str) -> None:
    """Import a module of an imported package when something in it is used, not before."""
    package, _, last = name.rpartition(".")
    if package not in sys.modules or name in sys.modules:
        return
    spec = importlib.util.find_spec(name)
    if spec is not None and spec.loader is not None:
        spec.loader = importlib.util.LazyLoader(spec.loader)
        sys.modules[name] = module = importlib.util.module_from_spec(spec)
        spec.loader.exec_module(module)
        setattr(sys.modules[package], last, module)


@cache
def environment() -> dict[str, Any]:
    """Host, process and versions."""
    packages = {name: version(name) for name in ("pcmc", "numpy", "scipy", "numba")}
    return {"host": platform.node(), "pid": os.getpid(), "python": platform.python_version(), **packages}


def version(package: str) -> str:
    """The installed version of a package, or ``"not installed"``."""
    try:
        return importlib.metadata.version(DISTRIBUTIONS.get(package, package))
    except importlib.metadata.PackageNotFoundError:
        return "not installed"
