"""What every solver returns, what it shows while it runs, and how it is stopped."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from enum import Enum
from functools import cached_property
from typing import TYPE_CHECKING, Any, TypeVar

from ..base.interrupts import stop_requested
from ..base.tolerances import AT_REST
from ..surface import Plane, Surface

if TYPE_CHECKING:
    import pandas as pd

    from ..certificate import Certificate
    from ..certificate.proof import Attempt, Proof
    from ..stability.equilibrium import SecondVariation

End = TypeVar("End")


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
        "diverged: the surface inflates without bound; either there is no equilibrium, or the step is"
        " too long; raise the tensions, lower the pressure or take a smaller step"
    )
    VANISHED = (
        "stopped because the surface shrinks to nothing under its tension; hold it with fixed= or"
        " on_plane=, or raise the pressure"
    )
    NON_FINITE = (
        "stopped at a number that is not finite; the surface returned is the last finite one; use a"
        " smaller step"
    )
    DEGENERATE = "stopped because triangles collapse; remesh; the certificate names the place"
    STOPPED = "stopped on request; the surface returned is the best so far"
    SADDLE = (
        "stopped at a saddle: the way down from it leads to no minimum; hold what slips, or accept the"
        " saddle with target='stationary'"
    )
    NO_EQUILIBRIUM = (
        "ended without an equilibrium, as no smooth surface has one; change the tensions, the loads or the"
        " supports, as the proof says"
    )
    NONE_FOUND = (
        "ended without an equilibrium: the search found none, and no proof that there is none; raise the"
        " tensions, lower the loads, or start from another shape"
    )


ROUNDED = "converged: rounding lets no step lower the residual, which is above its tolerance"


@dataclass(frozen=True, eq=False, repr=False)
class Result:
    """The end of a solve. Every value describes exactly ``surface``.

    Attributes
    ----------
    surface : the surface reached.
    status : why the solver stopped; ``message`` is its sentence.
    method : the solver's name.
    energy : E of ``surface``, force·length.
    iterations, evaluations : steps taken; passes over the triangles, for E, ∇E or its derivative.
    rows : of ``history``, with at least ``evaluation``, ``energy`` and ``gradient_squared`` (‖∇E‖²).
    note : a further finding of the solver, shown in the message.
    rounded : whether rounding, and not the tolerance, ended a solve that converged.
    proofs : why there is no equilibrium, where that was proved.
    tried : what the search has tried, the given start first, if it found none.
    room_changes : δ of each room of prescribed volume, by which its pressure has changed, force/length².
    clear : the second variation factorised at rest, if it is clear of zero; used up by the first certificate.
    """

    surface: Surface
    status: Status
    method: str
    energy: float
    iterations: int
    evaluations: int
    rows: Sequence[Mapping[str, Any]]
    note: str = ""
    rounded: bool = False
    proofs: tuple[Proof, ...] = ()
    tried: tuple[Attempt, ...] = ()
    room_changes: tuple[float, ...] = ()
    clear: list[SecondVariation] = field(default_factory=list)

    def __repr__(self) -> str:
        known = [self.certificate.verdict.value] if "certificate" in vars(self) else []
        energy = f"E = {self.energy:.10g}, {self.iterations} iterations"
        return "\n".join([self.message, *known, energy, repr(self.surface)])

    @property
    def converged(self) -> bool:
        """Whether the solver met its tolerance."""
        return self.status is Status.CONVERGED

    def certify(
        self, *, modes: int = 1, tolerance: float = AT_REST, whole: bool | Sequence[str | Plane] = False
    ) -> Certificate:
        """The certificate of ``surface``, which also takes into account how the solver ended.

        Parameters as for ``pcmc.certify``.
        """
        # imported here, as they take long to import; so does pandas below
        from ..certificate import Evidence, certify

        names = {"diverged": "INFLATED", "vanished": "VANISHED", "degenerate": "COLLAPSED"}
        first = self.tried[0].end if self.tried else self.status.name.lower()  # before the search
        return certify(
            self.surface,
            modes=modes,
            tolerance=tolerance,
            evidence=Evidence[names[first]] if first in names else None,
            tried=self.tried,
            whole=whole,
            clear=self.clear.pop() if self.clear else None,
        )

    @cached_property
    def certificate(self) -> Certificate:
        """``certify()``: residual, curvature error, stability, verdict. Computed when first asked for."""
        return self.certify()

    @cached_property
    def history(self) -> pd.DataFrame:
        """A row per iteration (per evaluation for ``"lbfgs"``), made when first asked for."""
        import pandas as pd

        return pd.DataFrame(self.rows)

    @cached_property
    def rooms(self) -> pd.DataFrame:
        """A row per room of prescribed volume: the certificate's, and the ``change`` of its pressure."""
        from ..certificate.tables import room_table

        return room_table(self.surface).assign(change=self.room_changes)

    @property
    def message(self) -> str:
        """A sentence that says why the solver stopped and what to do."""
        reason = ROUNDED if self.rounded and self.converged else self.status.value
        return "; ".join(filter(None, (f"{self.method}: {reason}", self.note)))


@dataclass(frozen=True, eq=False)
class Progress:
    """What a callback gets after each iteration."""

    iteration: int  # its number; 0 is the start
    surface: Callable[[], Surface]  # call it for the surface reached
    row: Mapping[str, Any]  # the row just added to the history


Callback = Callable[[Progress], None]
"""Called after each iteration. Raise StopIteration to stop with the best surface so far; any other exception
passes through to the caller of ``solve``, and so does StopIteration out of ``next()``, as a RuntimeError."""


def until_stopped(run: Callable[[], End], stopped: End) -> End:
    """The end that ``run`` returns; ``stopped`` where StopIteration or Ctrl-C ends it.

    >>> until_stopped(lambda: Status.CONVERGED, Status.STOPPED).name
    'CONVERGED'
    """
    try:
        return run()
    except (StopIteration, KeyboardInterrupt) as error:
        stop_requested(error)
        return stopped


def unless_stopped(result: Result) -> Result:
    """What a solve gave; KeyboardInterrupt where it was stopped, as that stops what it is a part of."""
    if result.status is Status.STOPPED:
        raise KeyboardInterrupt
    return result
