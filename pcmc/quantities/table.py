"""Every quantity that pcmc shows, sweeps or aims at: its name, dimension, owner and formula."""

from __future__ import annotations

from dataclasses import dataclass

from ..base.errors import OptionError, unknown

OWNERS = ("roof", "patch", "wall", "point", "cable", "room", "boundary")


@dataclass(frozen=True)
class Quantity:
    """A quantity of a roof or of a part of it.

    Attributes
    ----------
    name : one word, one meaning, wherever it appears.
    dimension : its unit, as a name of ``Units``.
    owners : what it may belong to, of ``OWNERS``; "roof" is all patches that are no walls together.
    formula : how it is computed.
    """

    name: str
    dimension: str
    owners: tuple[str, ...]
    formula: str


_ROWS = (
    Quantity("apex", "length", ("roof", "patch"), "greatest height over Π"),
    Quantity("height", "length", ("point", "patch"), "height over Π at a point; of a patch the greatest"),
    Quantity("rise", "length", ("roof",), "apex less the height of the lowest support"),
    Quantity("area", "area", ("roof", "patch", "wall"), "Σ A_T"),
    Quantity("volume", "volume", ("roof", "patch", "room"), "∫ z ν·n dA, the volume between patch and Π"),
    Quantity("energy", "energy", ("roof",), "E = Σ α A - Σ p V, with cables and weights"),
    Quantity("tension", "tension", ("patch", "wall"), "α"),
    Quantity("pressure", "pressure", ("patch", "room"), "p of the air, without snow"),
    Quantity("snow", "pressure", ("patch",), "s, per area of the plan"),
    Quantity("net pressure", "pressure", ("patch",), "p - s"),
    Quantity("weight", "pressure", ("patch",), "w, per area of the patch"),
    Quantity("curvature", "curvature", ("patch",), "(p - s) / (2 α)"),
    Quantity("lean", "angle", ("wall",), "largest angle between the wall and Π's normal"),
    Quantity("force", "force", ("cable",), "τ, the tension of the cable"),
    Quantity("length", "length", ("cable",), "Σ of its edges"),
    Quantity("sag", "length", ("cable",), "largest distance from the chord between its ends"),
    Quantity("load", "force", ("roof",), "pressure, snow and weight along Π's normal"),
    Quantity("reaction", "force", ("roof", "boundary"), "force of the supports along Π's normal"),
    Quantity("thrust", "force", ("boundary",), "force of the supports along Π"),
    Quantity("reaction per length", "tension", ("roof", "patch", "boundary"), "largest |Σ (α + w z) n|"),
    Quantity("margin", "times", ("roof",), "factor on a load or tension up to which the roof stays stable"),
    Quantity("lowest eigenvalue", "eigenvalue", ("roof",), "smallest second variation per unit area"),
)

QUANTITIES = {quantity.name: quantity for quantity in _ROWS}
"""Every quantity by its name."""

CHANGED = {"cable": "force"}  # kinds of parameters with the name of what they belong to


def dimension_of(name: str) -> str:
    """The unit of a quantity or of a kind of parameter, as a name of ``Units``.

    >>> dimension_of("apex"), dimension_of("reaction per length"), dimension_of("cable")
    ('length', 'tension', 'force')

    Raises
    ------
    OptionError : for another name.
    """
    if name in CHANGED:
        return CHANGED[name]
    if name not in QUANTITIES:
        raise OptionError(unknown("quantity", name, QUANTITIES), what="quantity", found=name)
    return QUANTITIES[name].dimension
