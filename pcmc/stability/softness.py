"""How many motions lower the energy, and how many nearly: counted by inertia, no eigenvalue computed.

A motion v is soft if |v·A v| ≤ band · Σ α |v|² dA: beside the tension α of what it moves. The counts are
those of the pencil A s = λ N s, N the lumped area times each triangle's tension: the negative eigenvalues of
A - band·N and of A + band·N are those below ±band. With σ = near · max α, near ≥ band, and M the lumped area,
A - σM is not above A - band·N: where it has no negative eigenvalue, none is negative nor soft.
"""

from __future__ import annotations

from dataclasses import dataclass

from ..base.arrays import Floats
from .equilibrium import Equilibrium, SecondVariation
from .factorisation import SingularMatrix

# |λ| size²/α up to which a certificate's detail names a fold. A mesh's own branch folds where the derivative
# of the forces left is singular, which is not quite the second variation: at reported folds of coarse caps,
# catenoids and pairs of caps |λ| is 0.003 to 0.55. A flat film over a disc has 46.
NEAR = 1.0
NEUTRAL = 1e-2  # |λ| size²/α up to which a motion counts as neutral, α the tension of what it moves


@dataclass(frozen=True)
class Spectrum:
    """Counts of eigenvalues."""

    index: int | None = None  # of the negative ones; None where rounding hides it
    below: int | None = None  # of those that are negative and not soft; None where rounding hides it
    soft: int = 0  # of the soft ones
    near: int = 0  # of those in a wider band
    hidden: str = ""  # what else of it could not be computed, as a sentence

    @property
    def unknown(self) -> bool:
        """Whether something is missing that decides about stability."""
        return self.below is None or bool(self.hidden)


def clear_of_zero(at: Equilibrium) -> SecondVariation | None:
    """A - σM with σ = near · max α, factorised, if nothing is negative or near; None otherwise."""
    above = _factorised(at, _wide(at, NEAR / at.shape.size**2))
    return above if above is not None and above.negative == 0 else None


def _wide(at: Equilibrium, near: float) -> Floats:
    return near * at.surface.tensions.max(initial=0.0) * at.mass


def count_soft(
    at: Equilibrium, band: float, near: float, clear: SecondVariation | None = None
) -> tuple[Spectrum, SecondVariation | None]:
    """The counts for two bands in units of α, 1/length², and a factor for the modes; None if there is none.

    One factorisation where nothing is near or negative, or none if ``clear_of_zero`` is known; two where
    nothing is near, else up to seven.
    """
    wide = _wide(at, near)
    above = clear or _factorised(at, wide)
    if above is not None and above.negative == 0:
        return Spectrum(0, 0), above
    below = _factorised(at, -wide)
    if above is not None and below is not None and above.negative == below.negative:
        return Spectrum(below.negative, below.negative), below
    least, most = _between(at, near)
    near_count = 0 if least is None or most is None else most - least
    down, up = _between(at, band)
    here = _factorised(at, 0.0)  # the last: it has the modes
    index = None if here is None else here.negative
    if down is None or up is None:
        return Spectrum(index), here
    index = down if down == up else index
    return Spectrum(index, down, up - down, near_count), here or _factorised(at, wide)


def _between(at: Equilibrium, band: float) -> tuple[int, int] | tuple[None, None]:
    """The negative eigenvalues of A + band·N, and those of A - band·N; None where rounding hides one."""
    ends = [_factorised(at, shift * at.tension_mass) for shift in (-band, band)]
    return (None, None) if ends[0] is None or ends[1] is None else (ends[0].negative, ends[1].negative)


def _factorised(at: Equilibrium, shift: Floats | float) -> SecondVariation | None:
    try:
        return at.factorised(shift)
    except SingularMatrix:
        return None
