"""Times as medians of repeats, the peak of memory, and the rows in which they are reported."""

from __future__ import annotations

import math
import sys
import time
from collections.abc import Callable, Iterable
from dataclasses import dataclass

import numpy as np


@dataclass(frozen=True)
class Row:
    """One line: what was measured, the median of its repeats, a remark, and what is asked of it.

    >>> Row("step", 0.5, "s", most=1.0).asked, Row("ratio", 5.0, "times", least=6.0).met
    ('≤ 1', 'no')
    """

    what: str
    value: float
    unit: str
    remark: str = ""
    least: float | None = None
    most: float | None = None

    @property
    def asked(self) -> str:
        """The bound on the value, in words; empty where there is none."""
        if self.least is not None:
            return f"≥ {self.least:g}"
        return "" if self.most is None else f"≤ {self.most:g}"

    @property
    def met(self) -> str:
        """Whether the value keeps its bound: yes, no, or empty where nothing is asked."""
        if not self.asked or np.isnan(self.value):
            return ""
        low = self.least is None or self.value >= self.least
        return "yes" if low and (self.most is None or self.value <= self.most) else "no"


def median(values: Iterable[float]) -> float:
    """The median of a few numbers."""
    return float(np.median(list(values)))


def median_seconds(call: Callable[[], object], repeats: int) -> float:
    """Median wall time of a call, after one that is not counted."""
    call()
    times = []
    for _ in range(repeats):
        start = time.perf_counter()
        call()
        times.append(time.perf_counter() - start)
    return median(times)


def peak_bytes() -> float:
    """The largest resident size of this process so far; NaN where the system does not tell."""
    try:  # ru_maxrss of a child starts at its parent's size, this does not
        with open("/proc/self/status") as status:
            line = next(line for line in status if line.startswith("VmHWM"))
        return 1024.0 * float(line.split()[1])
    except OSError:
        pass
    try:
        import resource
    except ImportError:  # Windows
        return math.nan
    unit = 1.0 if sys.platform == "darwin" else 1024.0
    return unit * resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
