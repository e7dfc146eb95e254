"""A project's mesh that is half of a roof: other supports leave its mirror plane."""

import pytest

import pcmc
from pcmc.plan import Plan
from pcmc.project import designed

SIDES = "[[[6, 0, 0], [0, 0, 0], [0, 9, 0], [6, 9, 0]]]"


@pytest.mark.parametrize("supports", ['"boundary"', '"ground"', SIDES])
def test_supports_of_a_project_leave_the_mirror_plane_of_its_mesh(tmp_path, supports):
    outline = [[0, 0], [6, 0], [6, 9], [0, 9]]
    half = Plan(outline, edge_length=1.5, tension=3.0, pressure=0.4, mirrors=[[[6, 0], [6, 9]]]).surface()
    pcmc.write(tmp_path / "half.obj", half)
    path = tmp_path / "roof.toml"
    path.write_text(f'[mesh]\nfile = "half.obj"\nsupports = {supports}\n')
    roof, plain = designed(path, use_cache=False), pcmc.solve(half)
    assert roof.good
    assert len(roof.surface.on_planes) == 1
    assert roof.surface.vertices[:, 2].max() == pytest.approx(plain.surface.vertices[:, 2].max(), rel=1e-6)
