"""The lower sheet of a cushion has its factor times the tension of the upper one, whatever finds that."""

import numpy as np
import pytest

import pcmc
from pcmc.plan import Plan

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
