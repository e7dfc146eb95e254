"""The units of an IFC file."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from ..base.units import NEWTONS, TABLE, Units, length_factor

NAMES = {name: unit.ifc for name, unit in TABLE.items()}
NAMES |= {"N": "", "kN": "KILO", "MN": "MEGA", "lbf": "pound-force", "kip": "kip"}


def assigned_units(add: Callable[..., Any], units: Units) -> Any:
    """Units of length and angle; areas and volumes in m², m³; and the units of tensions and pressures.

    ``add`` makes an entity.
    """
    length = _unit(add, "LENGTHUNIT", "METRE", units.length, (1, 0, 0), length_factor(units.length, "m"))
    listed = [
        length,
        add("IfcSIUnit", UnitType="AREAUNIT", Name="SQUARE_METRE"),
        add("IfcSIUnit", UnitType="VOLUMEUNIT", Name="CUBIC_METRE"),
        add("IfcSIUnit", UnitType="PLANEANGLEUNIT", Name="RADIAN"),
    ]
    if units.force:
        force = _unit(add, "FORCEUNIT", "NEWTON", units.force, (1, 1, -2), NEWTONS[units.force])
        listed.append(force)
        for kind, power in (("LINEARFORCEUNIT", -1), ("PLANARFORCEUNIT", -2)):
            factors = [
                add("IfcDerivedUnitElement", Unit=force, Exponent=1),
                add("IfcDerivedUnitElement", Unit=length, Exponent=power),
            ]
            listed.append(add("IfcDerivedUnit", Elements=factors, UnitType=kind))
    return add("IfcUnitAssignment", Units=listed)


def _unit(
    add: Callable[..., Any], kind: str, name: str, unit: str, powers: tuple[int, int, int], factor: float
) -> Any:
    """A unit of the SI with its prefix, or one that is a multiple of it."""
    prefix = NAMES[unit] if NAMES[unit].isupper() else None
    plain = add("IfcSIUnit", UnitType=kind, Prefix=prefix, Name=name)
    if prefix or not NAMES[unit]:
        return plain
    exponents = add("IfcDimensionalExponents", *powers, 0, 0, 0, 0)
    measure = "IfcLengthMeasure" if kind == "LENGTHUNIT" else "IfcForceMeasure"
    one = add("IfcMeasureWithUnit", ValueComponent=add(measure, factor), UnitComponent=plain)
    return add(
        "IfcConversionBasedUnit",
        Dimensions=exponents,
        UnitType=kind,
        Name=NAMES[unit],
        ConversionFactor=one,
    )
