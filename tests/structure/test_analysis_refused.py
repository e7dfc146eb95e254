"""Models and values that cannot be are refused in one line."""

import pytest
from refusals import refused
from structures import FABRIC, model_of, pyramid, square

import pcmc
from pcmc import Material, Snow, Wind
from pcmc.base.errors import OptionError
from pcmc.structure import Gas


@pytest.mark.parametrize(
    ("given", "what"),
    [
        ({"loads": [Snow(1.0)], "combinations": {"uls": {"snw": 1.5}}}, "combinations"),
        ({"loads": [Snow(1.0)], "combinations": {"snow": {"snow": 1.5}}}, "combinations"),
        ({"loads": [Snow(1.0), Snow(2.0)]}, "loads"),
        ({"combinations": {"uls": {}}}, "combinations"),
        ({"combinations": {"uls": {"form": float("nan")}}}, "factor"),
        ({"combinations": [1.0]}, "combinations"),
        ({"gas": True}, "gas"),
        ({"gas": Gas()}, "Gas.ambient"),
        ({"gas": Gas(patches=["rof"], ambient=100.0)}, "patch"),
        ({"material": {"rof": FABRIC}}, "patch"),
        ({"material": {"roof": 1.0}}, "material"),
        ({"loads": [Snow(1.0, area=[(9, 9), (10, 9), (10, 10)])]}, "snow"),
    ],
)
def test_bad_models_are_refused_in_one_line(given, what):
    with refused(OptionError, what=what) as caught:
        model_of(pyramid(), **given).steps  # noqa: B018
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize(
    ("make", "what"),
    [
        (lambda: Material(1e6, weft=1e6), "Material.shear"),
        (lambda: Material(1e6, 0.4, weft=1e7, shear=1e5), "Material.weft"),
        (lambda: Material(1e6, weft=1e6, shear=1e5, warp=(1, 0)), "Material.warp"),
        (lambda: Snow(1.0, slopes=(30, 10)), "Snow.slopes"),
        (lambda: Snow(1.0, area=[(0, 0), (1, 1)]), "Snow.area"),
        (lambda: Wind({"roof": 1.0}, slopes="steep"), "Wind.slopes"),
        (lambda: Gas(ambient=-1.0), "Gas.ambient"),
        (lambda: Gas(patches="roof"), "Gas.patches"),
    ],
)
def test_bad_values_are_refused_in_one_line(make, what):
    with refused(OptionError, what=what) as caught:
        make()
    assert "\n" not in str(caught.value)


def test_cloth_with_its_warp_across_a_triangle_is_refused(tmp_path):
    model = model_of(square(2), material=Material(1e6, weft=1e6, shear=1e5, warp=(0, 0, 1)), anyway=True)
    with refused(OptionError, what="Material.warp"):
        pcmc.write_structure(tmp_path / "film.inp", model)
    assert not list(tmp_path.iterdir())
