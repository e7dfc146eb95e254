"""The lower sheet of a cushion has its factor times the tension of the upper one, whatever finds that."""

import numpy as np
import pytest
from refusals import refused

import pcmc
from pcmc.accuracy.varied import Varied
from pcmc.base.errors import OptionError
from pcmc.cli.arguments import Loads
from pcmc.explore.following import wanted
from pcmc.plan import Plan
from pcmc.project.values import changeable_values, data_with_values

ROOF = {"outline": [[0, 0], [6, 0], [6, 4], [0, 4]], "edge_length": 1.0, "cushion": 1.5}


@pytest.fixture(scope="module")
def cushion():
    return Plan(**ROOF, tension=3.0).surface()


def test_a_rise_keeps_the_factor(tmp_path):
    path = tmp_path / "cushion.toml"
    path.write_text("[plan]\noutline = [[0, 0], [6, 0], [6, 4], [0, 4]]\nrise = 0.6\ncushion = 1.5\n")
    designed = pcmc.project.designed(path, use_cache=False)
    above, below = designed.surface.tensions
    assert designed.good
    assert below == pytest.approx(1.5 * above, rel=1e-12)
    path.write_text(path.read_text().replace("rise = 0.6", f"tension = {float(above)!r}"))
    typed = pcmc.project.designed(path, use_cache=False)
    assert typed.certificate.volume == pytest.approx(designed.certificate.volume, rel=1e-3)


def test_a_tension_changes_both_sheets_unless_both_are_named(cushion):
    assert cushion.retensioned({"patch 1": 4.0}).tensions.tolist() == [4.0, 6.0]
    assert cushion.retensioned({"patch 1 below": 4.0}).tensions.tolist() == [3.0, 4.0]
    assert cushion.retensioned({"patch 1": 4.0, "patch 1 below": 4.0}).tensions.tolist() == [4.0, 4.0]


def test_the_rate_of_a_target_is_that_of_both_sheets(cushion):
    roof = pcmc.solve(cushion).surface
    target = pcmc.Target("volume", "patch 1 below")
    rate = pcmc.sensitivities(roof, [target], ["patch 1"]).to_numpy().item()
    h = 1e-4
    volumes = [
        pcmc.certify(pcmc.solve(roof.retensioned({"patch 1": 3.0 + step})).surface).volumes[1]
        for step in (h, -h)
    ]
    assert rate == pytest.approx(np.subtract(*volumes) / (2.0 * h), rel=1e-4)


def test_no_snow_falls_on_the_lower_sheet(cushion, tmp_path):
    given = Plan(**ROOF, tension=4.0, snow=0.3).surface()
    assert cushion.with_snow(0.3).snows.tolist() == given.snows.tolist() == [0.3, 0.0]
    typed = Loads(snow=["0.3"], tension=["4"]).of(cushion)
    assert (typed.snows.tolist(), typed.tensions.tolist()) == (given.snows.tolist(), given.tensions.tolist())
    assert Varied.of(cushion, "snow").parts == (("snow", "patch 1"),)


def test_one_value_is_the_pressure_of_both_sheets(cushion):
    values = changeable_values(cushion)
    assert (*values["pressures"],) == ("patch 1",)
    assert wanted(cushion, {"pressures": {"patch 1": 1.5}}).pressures.tolist() == [1.5, 1.5]


def test_a_project_holds_the_tensions_of_both_sheets_as_a_factor(tmp_path):
    path = tmp_path / "cushion.toml"
    data = {"plan": {**ROOF, "tension": 3.0}}
    start = Plan(**data["plan"]).surface()
    for tensions, cushion in (({"patch 1": 4.0}, 1.5), ({"patch 1": 4.0, "patch 1 below": 5.0}, 1.25)):
        plan = data_with_values(path, data, start.retensioned(tensions))[0]["plan"]
        assert (plan["tension"], plan["cushion"]) == (4.0, cushion)
    with refused(OptionError, what="values"):  # the project has one weight for both
        data_with_values(path, data, start.retensioned(weights={"patch 1 below": 0.1}))


@pytest.mark.parametrize("key", ["rise = 0.5", "tension = 4.0"])
def test_a_mesh_of_a_project_keeps_the_factor(cushion, tmp_path, key):
    pcmc.write(tmp_path / "cushion.pcmc", cushion)
    path = tmp_path / "roof.toml"
    path.write_text(f'[mesh]\nfile = "cushion.pcmc"\n{key}\n')
    designed = pcmc.project.designed(path, use_cache=False)
    above, below = designed.surface.tensions
    assert designed.good
    assert below == pytest.approx(1.5 * above, rel=1e-12)
