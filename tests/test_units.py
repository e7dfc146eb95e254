"""Units of length and force, and files that carry them."""

import pytest

from pcmc.base.errors import OptionError
from pcmc.base.units import DXF_UNITS, FORCES, LENGTHS, MICROMETRES, Units, conversion_note, length_factor
from tests.refusals import refused


@pytest.mark.parametrize("source", MICROMETRES)
@pytest.mark.parametrize("target", MICROMETRES)
def test_there_and_back_is_the_same_length(source, target):
    assert length_factor(source, target) * length_factor(target, source) == pytest.approx(1.0, rel=1e-15)


def test_factors_are_exact_quotients():
    assert length_factor("yd", "ft") == 3.0
    assert length_factor("cm", "dm") == 0.1
    assert length_factor("ft", "m") == 0.3048
    assert length_factor("mm", "") == length_factor("", "mm") == 1.0
    assert not conversion_note("", "m")
    assert not conversion_note("m", "m")


def test_units_of_drawings_have_a_length():
    assert set(LENGTHS) <= set(DXF_UNITS.values()) <= set(MICROMETRES)


def test_every_unit_gives_its_texts():
    for length in LENGTHS:
        for force in FORCES:
            units = Units(length, force)
            assert units.pressure == f"{force}/{length}²"
            assert units.energy == f"{force}·{length}"
    assert (Units().area, Units().volume, Units().pressure) == ("length²", "length³", "force/length²")
    assert not Units()
    assert Units("m")


def test_wrong_units_are_refused():
    with refused(OptionError, what="units", found="meter"):
        Units("meter")
    with refused(OptionError, what="force", found="kg"):
        Units("m", "kg")
    with refused(OptionError, what="units"):
        Units(force="kN")
    with refused(OptionError, what="units", found="furlong"):
        length_factor("furlong", "m")
