"""Files that keep curved elements, and those that say that they do not."""

import numpy as np
import pytest

import pcmc
from generators import spherical_cap
from pcmc.base.errors import LostWarning
from pcmc.meshing.elevation import elevate


@pytest.mark.parametrize("suffix", [".pcmc", ".vtp", ".vtu"])
@pytest.mark.parametrize("order", [2, 4])
def test_nodes_and_order_are_kept(tmp_path, suffix, order):
    curved = elevate(spherical_cap(0.5), order)
    path = tmp_path / f"cap{suffix}"
    pcmc.write(path, curved)
    again = pcmc.read(path)
    assert again.order == order
    np.testing.assert_array_equal(again.nodes, curved.nodes)
    assert pcmc.energy(again) == pytest.approx(pcmc.energy(curved), rel=1e-15)


@pytest.mark.parametrize("suffix", [".obj", ".ply", ".fe"])
def test_other_files_say_that_they_have_flat_triangles(tmp_path, suffix):
    path = tmp_path / f"cap{suffix}"
    with pytest.warns(LostWarning, match="its curved elements"):
        pcmc.write(path, elevate(spherical_cap(0.5), 2))
    assert pcmc.read(path).order == 1
