"""Case functions for the tests of the sweep engine. Cheap to import: workers load this file."""

import asyncio
import math
import os
import signal
import sys
import time
from pathlib import Path


def chaos(seed, rate, pause=0.0):
    """The logistic map: any change in a bit shows in the numbers."""
    time.sleep(pause)
    x = seed
    for _ in range(60):
        x = rate * x * (1.0 - x)
    verdict = "high" if x > 0.5 else "low"
    return {"verdict": verdict, "x": x, "third": x / 3.0, "inverse": math.inf if x == 0 else 1 / x}


def echo(value, other=None):
    return {"back": str(value), "type": type(value).__name__}


def answers(what):
    """Return the oddest things."""
    return {
        "words": {"status": "converged", "verdict": None, "message": "well", "n": 3, "yes": True},
        "number": 3.0,
        "list": {"numbers": [1.0, 2.0]},
        "parameter": {"what": 1.0},
        "nothing": {},
        "huge": {"n": 10**5000},
        "half a character": {"s": "\ud800"},
    }[what]


def misbehave(how, marker=""):
    """Do what a case must not."""
    print("about to", how)
    if how == "raise":
        raise ArithmeticError("no root\nin sight")
    if how == "exit":
        sys.exit(3)
    if how == "interrupt":
        raise KeyboardInterrupt
    if how == "cancel":
        raise asyncio.CancelledError("late")
    if how == "hang":
        time.sleep(3600)
    if how == "stop":
        os.kill(os.getpid(), signal.SIGSTOP)
    if how == "leave a child":
        os.fork()  # it inherits the pipe to the sweep
        time.sleep(3600)
    if how == "die":
        os._exit(7)
    if how == "kill":
        os.kill(os.getpid(), signal.SIGKILL)
    if how == "close":
        os.closerange(0, 64)
    return {"how_it_went": 1.0}


def mortal(n, fatal, folder):
    """Print and note each case that is begun; one of them ends its process."""
    print("this is case", n)
    with (Path(folder) / "begun").open("a") as file:
        file.write(f"{n}\n")
    if n == fatal:
        os._exit(7)
    return {"pid": os.getpid()}


def forked(n):
    """Come back twice."""
    os.fork()
    return {"square": n * n}


def daemon(n):
    """Leave a process that no kill of the case reaches, and hang."""
    if os.fork() == 0:
        os.setsid()
        time.sleep(20.0)
        os._exit(0)
    time.sleep(3600.0)


def chatter(how):
    """Say far too much, then fail."""
    if how == "raise":
        raise ValueError("x" * 10**6)
    print("€" * 10**6, "the end €")
    os._exit(7)


def surroundings(n):
    """How many threads a case gets, and who runs it."""
    names = ("OMP_NUM_THREADS", "MKL_NUM_THREADS", "NUMBA_NUM_THREADS", "PCMC_THREADS")
    return {name: int(os.environ[name]) for name in names} | {"pid": os.getpid()}


def noted(n, folder, pause):
    """Leave a line in a file for each time the case is begun."""
    with (Path(folder) / "begun").open("a") as file:
        file.write(f"{n} {os.getpid()}\n")
    time.sleep(pause)
    return {"square": n * n}


def holding(n, folder, pause=0.5):
    """Hold a lock for as long as the process lives."""
    import fcntl  # Windows has none

    global held
    held = (Path(folder) / "held").open("w")
    fcntl.flock(held, fcntl.LOCK_EX)
    (Path(folder) / "begun").touch()
    time.sleep(pause)
    return {}


def anything(**parameters):
    return {"sum": sum(parameters.values())}
