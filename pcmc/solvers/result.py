"""What every solver returns, and what a solver may be told to do while it runs."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from enum import Enum
from functools import cached_property
from typing import TYPE_CHECKING, Any

from ..surface import Surface

if TYPE_CHECKING:
    import pandas as pd

    from ..certificate.certificate import Certificate


class Status(Enum):
    """Why a solver stopped. The value is a sentence a user can act on."""

    CONVERGED = "converged: the residual is below its tolerance"
    ITERATION_LIMIT = (
        "stopped at the iteration limit before the tolerance was met; raise the limit, or finish"
        " with method='newton'"
    )
    STALLED = (
        "stalled: no further step lowers the residual; look at the triangle quality near the"
        " largest forces, or remesh"
    )
    DIVERGED = (
        "diverged: the surface inflates without bound, which happens when no equilibrium exists or"
        " the step is too long; raise the tensions, lower the pressure or take a smaller step"
    )
    VANISHED = (
        "stopped because the surface shrinks to nothing: nothing holds it against its tension"
    )
    NON_FINITE = (
        "stopped at a number that is not finite; the returned surface is the last finite one; use a"
        " smaller step"
    )
    DEGENERATE = (
        "stopped because triangles collapse; remesh, or let the certificate name where they do"
    )
    STOPPED = "stopped on request; the returned surface is the best so far"


@dataclass(frozen=True, eq=False)
class Result:
    """The end of a solve. Every value describes exactly ``surface``.

    Attributes
    ----------
    surface : the surface reached.
    status : why the solver stopped; ``message`` is its sentence.
    method : the solver's name.
    energy : E of ``surface``, force·length.
    iterations, evaluations : steps taken; passes over the triangles made, for E, ∇E or its
        derivative along a motion.
    rows : the rows of ``history``, each a mapping of its columns.
    history : a row per iteration (per evaluation for ``"lbfgs"``) with at least ``evaluation``,
        ``energy`` and ``gradient_squared`` (‖∇E‖², the paper's squared sum).
    note : what else the solver found on its way, for the message.
    """

    surface: Surface
    status: Status
    method: str
    energy: float
    iterations: int
    evaluations: int
    rows: Sequence[Mapping[str, Any]] = field(repr=False)
    note: str = ""

    @property
    def converged(self) -> bool:
        """Whether the solver met its tolerance."""
        return self.status is Status.CONVERGED

    @cached_property
    def certificate(self) -> Certificate:
        """What the surface reached is: residual, curvature error, stability, verdict."""
        from ..certificate.certificate import (
            certify,  # here, as pandas below: both take long to import
        )

        return certify(self.surface, status=self.status.name)

    @cached_property
    def history(self) -> pd.DataFrame:
        """A row per iteration (per evaluation for ``"lbfgs"``), made when first asked for."""
        import pandas as pd

        return pd.DataFrame(self.rows)

    @property
    def message(self) -> str:
        """A sentence that says why the solver stopped and what to do."""
        return "; ".join(filter(None, (f"{self.method}: {self.status.value}", self.note)))


@dataclass(frozen=True, eq=False)
class Progress:
    """What a callback is shown after each iteration. ``row`` is the history row just written."""

    iteration: int
    surface: Callable[[], Surface]
    row: Mapping[str, Any]


Callback = Callable[[Progress], None]
"""Called after each iteration. Raise StopIteration to stop with the best surface so far; any other
exception passes through to the caller of ``solve``."""
