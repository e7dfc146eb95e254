"""Wrong models, materials and loads of structural models: each is refused by name."""

from functools import partial

import pytest
from refusals import refused
from structures import model_of, pyramid

from pcmc import Cable, Material, SelfWeight, Snow, Wind
from pcmc.base.errors import LoadWarning, OptionError
from pcmc.project import Structure


@pytest.mark.parametrize(
    ("given", "what"),
    [
        ({"material": None}, "material"),
        ({"material": 3.0}, "material"),
        ({"thickness": 0.0}, "thickness"),
        ({"thickness": -1.0}, "thickness"),
        ({"thickness": 1e-320}, "thickness"),
        ({"thickness": {"roof": 1e-320}}, "thickness"),
        ({"thickness": 1e300}, "thickness"),
        ({"thickness": None}, "thickness"),
        ({"thickness": {}}, "thickness"),
        ({"thickness": {"rof": 1.0}}, "patch"),
        ({"loads": [Wind({"rof": 1.0})]}, "patch"),
        ({"loads": [Snow(1.0, patches=["rof"])]}, "patch"),
        ({"loads": Snow(1.0)}, "loads"),
        ({"loads": [1.0]}, "loads"),
        ({"loads": [()]}, "loads"),
        ({"loads": [SelfWeight(), SelfWeight(5.0, "moon")]}, "loads"),
        ({"material": Material(1.0), "loads": [SelfWeight()]}, "Material.density"),
        ({"cable_material": 1}, "cable_material"),
    ],
)
def test_bad_models_are_refused(given, what):
    with refused(OptionError, what=what):
        model_of(pyramid(), **given)


@pytest.mark.parametrize(
    ("make", "what"),
    [
        (partial(Material, 0.0), "Material.young"),
        (partial(Material, 1e-320), "Material.young"),
        (partial(Material, 1.0, 0.3, 1e300), "Material.density"),
        (partial(SelfWeight, 1e-320), "SelfWeight.gravity"),
        (partial(Snow, 1e300), "Snow.load"),
        (partial(Wind, {"roof": -1e300}), "Wind.pressures"),
        (partial(Material, 1.0, 0.5), "Material.poisson"),
        (partial(Material, 1.0, 0.3, -1.0), "Material.density"),
        (partial(SelfWeight, 0.0), "SelfWeight.gravity"),
        (partial(Snow, float("nan")), "Snow.load"),
        (partial(Snow, 1.0, "roof"), "Snow.patches"),
        (partial(Snow, 1.0, (), "two\nlines"), "name of a load"),
        (partial(Wind, {}), "Wind.pressures"),
        (partial(Wind, {"roof": "1"}), "Wind.pressures"),
        (partial(Structure, thickness=1.0), "young"),
        (partial(Structure, young=1.0), "thickness"),
        (partial(Structure, 1.0, 1.0, zones=[{"case": "form pressure", "snow": 1.0}]), "loads"),
        (partial(Structure, 1.0, 1.0, combinations={"form pressure": {"form": 1.0}}), "combinations"),
    ],
)
def test_bad_materials_and_loads_are_refused(make, what):
    with refused(OptionError, what=what):
        make()


def test_a_weight_and_a_density_of_one_patch_are_told():
    """Both act: of a roof found under its own weight that would be twice the weight."""
    roof = pyramid().retensioned(weights={"roof": 0.01})
    told = r"'roof' has a weight, under which it is at rest; self-weight by its density comes on top"
    with pytest.warns(LoadWarning, match=told):
        Structure(young=1e6, thickness=0.001, density=1.0).check(roof)
    Structure(young=1e6, thickness=0.001).check(roof)
    roped = pyramid().rebuilt(cables=[Cable("rope", 1.0, [[0, 4]], weight=0.1)])
    with pytest.warns(LoadWarning, match="'rope' has a weight"):
        Structure(young=1e6, thickness=0.001, density=1.0, cable_area=1e-4).check(roped)
    Structure(young=1e6, thickness=0.001, density=1.0).check(pyramid())
