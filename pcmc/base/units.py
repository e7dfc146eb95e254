"""Units of length and force: their sizes, conversion, and the texts that results show."""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

from . import validate
from .errors import OptionError


class Length(NamedTuple):
    """A unit of length in every file format."""

    micrometres: int  # whole, so that factors are exact quotients
    dxf: int  # the number of ``$INSUNITS``
    rhino: str  # the name of a .3dm file's unit system
    ifc: str  # the prefix of the metre, or the name of a unit that is none of the SI


TABLE = {
    "m": Length(1_000_000, 6, "Meters", ""),
    "mm": Length(1_000, 4, "Millimeters", "MILLI"),
    "cm": Length(10_000, 5, "Centimeters", "CENTI"),
    "ft": Length(304_800, 2, "Feet", "foot"),
    "in": Length(25_400, 1, "Inches", "inch"),
    "µm": Length(1, 13, "Microns", "MICRO"),
    "dm": Length(100_000, 14, "Decimeters", "DECI"),
    "km": Length(1_000_000_000, 7, "Kilometers", "KILO"),
    "yd": Length(914_400, 10, "Yards", "yard"),
    "mi": Length(1_609_344_000, 3, "Miles", "mile"),
}
MICROMETRES = {name: unit.micrometres for name, unit in TABLE.items()}
LENGTHS = ("m", "mm", "cm", "ft", "in")  # of a project
NEWTONS = {"N": 1.0, "kN": 1e3, "MN": 1e6, "lbf": 4.4482216152605, "kip": 4448.2216152605}
FORCES = tuple(NEWTONS)  # of a project
KILOGRAMS = {"kg": 1.0, "t": 1e3, "slug": NEWTONS["lbf"] / 0.3048}
LARGEST, SMALLEST = 1000.0, 1.0  # metres: the size of a plan is between, as a rule


def _derived(template: str) -> property:
    """A unit of ``Units`` that follows from those of length and force."""
    return property(lambda u: template.format(length=u.length or "length", force=u.force or "force"))


@dataclass(frozen=True)
class Units:
    """The units of a surface's numbers: coordinates in ``length``, tensions in ``force``/``length``.

    Every other quantity follows, and its unit is an attribute: ``area``, ``volume``, ``curvature``,
    ``tension``, ``pressure``, ``eigenvalue``, ``energy``, ``angle``. An empty text is no unit.

    Attributes
    ----------
    length : one of ``MICROMETRES``, or empty; projects and pages use those of ``LENGTHS``.
    force : one of ``FORCES``, or empty; it needs a length.

    Raises
    ------
    OptionError : for another unit, and for a force without a length.

    Examples
    --------
    >>> units = Units("m", "kN")
    >>> units.tension, units.pressure, units.volume
    ('kN/m', 'kN/m²', 'm³')
    >>> Units("mm").tension, Units().tension, Units().curvature
    ('force/mm', 'force/length', '1/length')
    """

    length: str = ""
    force: str = ""
    area = _derived("{length}²")
    volume = _derived("{length}³")
    curvature = _derived("1/{length}")
    tension = _derived("{force}/{length}")  # and reactions per length
    pressure = _derived("{force}/{length}²")
    eigenvalue = _derived("{force}/{length}³")  # force per displacement and area
    energy = _derived("{force}·{length}")
    angle = _derived("°")
    times = _derived("times")  # of a factor

    def __post_init__(self) -> None:
        if self.length:
            validate.choice("units", self.length, tuple(MICROMETRES))
        if self.force:
            validate.choice("force", self.force, FORCES)
        if self.force and not self.length:
            text = f'force = "{self.force}" needs a unit of length, too; add units = "m"'
            raise OptionError(text, what="units", expected=LENGTHS)

    def __bool__(self) -> bool:
        """Whether there is a unit of length."""
        return bool(self.length)

    def behind(self, kind: str) -> str:
        """What follows a number: a space and the unit of its kind; nothing if no unit is given.

        ``kind`` is length, force, or a quantity such as volume.

        >>> Units("m", "kN").behind("volume"), Units("m").behind("force"), Units().behind("volume")
        (' m³', ' force', '')
        """
        return f" {getattr(self, kind) or kind}" if self else ""

    @property
    def sentence(self) -> str:
        """All units in one line, for the head of a table.

        >>> Units("m", "kN").sentence
        'lengths in m, tensions in kN/m, pressures in kN/m², reactions in kN'
        """
        lengths, reactions = f"lengths in {self.length or 'length'}", f"reactions in {self.force or 'force'}"
        return f"{lengths}, tensions in {self.tension}, pressures in {self.pressure}, {reactions}"

    @property
    def mass(self) -> str:
        """The unit of masses: what a unit of force accelerates by a unit of length per s².

        >>> [Units(*pair).mass for pair in (("m", "kN"), ("mm", "N"), ("ft", "lbf"), ("in", "kip"))]
        ['t', 't', 'slug', '175127 kg']
        """
        if not self.force:
            return "force·s²/" + (self.length or "length")
        kilograms = NEWTONS[self.force] / length_factor(self.length, "m")
        near = (name for name, known in KILOGRAMS.items() if abs(kilograms - known) < 1e-9 * known)
        return next(near, f"{kilograms:.6g} kg")


NO_UNITS = Units()
"""Those of numbers whose units are not given."""


def as_units(units: object) -> Units:
    """Units as given, or by their unit of length alone; OptionError for an unknown unit, and anything else.

    >>> as_units("mm").volume
    'mm³'
    """
    if isinstance(units, str):
        return Units(units)
    if not isinstance(units, Units):
        validate.refuse("units", units, 'a unit of length such as "m", or Units("m", "kN")')
    return units


def expect_length(unit: object, purpose: str) -> str:
    """The unit of lengths that a purpose cannot do without; OptionError where it is missing or unknown.

    >>> expect_length("", "a drawing")
    Traceback (most recent call last):
    ...
    pcmc.base.errors.OptionError: units: a drawing needs the unit of the lengths; add units = "m" to the
    project, or use --units m (or another of m, mm, cm, ft, in)
    """
    if unit is None or unit == "":
        text = f'units: {purpose} needs the unit of the lengths; add units = "m" to the project, or use'
        text += f" --units m (or another of {', '.join(LENGTHS)})"
        raise OptionError(text, what="units", found=unit, expected=LENGTHS)
    return validate.choice("units", unit, LENGTHS)


def length_factor(source: str, target: str) -> float:
    """What a length in ``source`` is multiplied by to be in ``target``; 1 where one of them is empty.

    OptionError for a text that is no unit of ``MICROMETRES``.

    >>> length_factor("mm", "m"), length_factor("ft", "in"), length_factor("", "m")
    (0.001, 12.0, 1.0)
    """
    for unit in filter(None, (source, target)):
        validate.choice("units", unit, tuple(MICROMETRES))
    return MICROMETRES[source] / MICROMETRES[target] if source and target else 1.0


def conversion_note(source: str, target: str) -> str:
    """A line about the conversion of lengths; empty where nothing changes.

    >>> conversion_note("mm", "m")
    'lengths converted from mm to m (1 mm = 0.001 m)'
    """
    factor = length_factor(source, target)
    text = f"lengths converted from {source} to {target} (1 {source} = {factor:g} {target})"
    return "" if factor == 1.0 else text


def unit_in_file(system: int | str) -> tuple[str, str]:
    """The unit of length that a drawing names, and a note if it is none of ours; both empty without one.

    ``system`` is the ``$INSUNITS`` of a .dxf file, or the name of a .3dm file's unit system.

    >>> unit_in_file(3), unit_in_file("Microns"), unit_in_file(0)
    (('mi', ''), ('µm', ''), ('', ''))
    >>> unit_in_file(21)
    ('', 'its unit of length (21) is unknown here: the numbers are taken as they are')
    """
    if system in (0, "None", "Unset"):
        return "", ""
    note = f"its unit of length ({system}) is unknown here: the numbers are taken as they are"
    return next(((name, "") for name, unit in TABLE.items() if system in (unit.dxf, unit.rhino)), ("", note))


def unlikely_size(size: float, unit: str, drawn: str = "", what: str = "plan") -> str:
    """A sentence on a plan or a mesh whose size is unlikely in its unit, with the line to type; else empty.

    ``size`` is its longest side in ``unit``, ``drawn`` the unit that its drawing itself has.

    >>> unlikely_size(12000.0, "m"), unlikely_size(12.0, "m")
    ('the plan is 12 km long; are its numbers in mm? Then type units = "mm"', '')
    """
    metres = size * length_factor(unit, "m")
    if not unit or SMALLEST <= metres <= LARGEST:
        return ""
    own = size * length_factor(unit, drawn)
    likely = [name for name in LENGTHS if SMALLEST <= own * length_factor(name, "m") <= LARGEST]
    note = (
        f"the {what} is {f'{metres / 1000:.4g} km' if metres > LARGEST else f'{metres * 1000:.4g} mm'} long"
    )
    if not likely:
        return f"{note}; check its unit, which is {drawn or unit}"
    if not drawn:
        where = f" in [mesh], or --units {likely[0]}" if what == "mesh" else ""
        return f'{note}; are its numbers in {likely[0]}? Then type units = "{likely[0]}"{where}'
    note += f"; is the drawing in {likely[0]}? Its unit is {drawn}: set it to {likely[0]} in CAD, or write"
    return f'{note} the project with pcmc plan and type units = "{likely[0]}" there'
