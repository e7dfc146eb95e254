"""What a project changes of its mesh: supports leave mirror planes, walls follow pressures."""

import pytest
from periodic_cases import bay

import pcmc
from generators import kelvin_foam
from pcmc import cli
from pcmc.base.errors import FileWarning, OptionError
from pcmc.base.units import Units
from pcmc.plan import Plan
from pcmc.project import build, designed

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


@pytest.mark.parametrize(
    "supports", ['"boundary"', '"ground"', "[[[0, 0, 0], [1, 0, 0]], [[0, 1, 0], [0.5, 1, 0]]]"]
)
def test_supports_of_a_bay_hold_images_and_their_vertices(tmp_path, supports):
    pcmc.write(tmp_path / "bay.pcmc", bay(6))
    (tmp_path / "roof.toml").write_text(f'[mesh]\nfile = "bay.pcmc"\nsupports = {supports}\n')
    surface = build(tmp_path / "roof.toml")
    assert surface.fixed[surface.images[:, 0]].any()
    assert (surface.fixed == bay(6).fixed).all() or "0.5" in supports


@pytest.mark.parametrize("supports", ["boundary", "ground"])
def test_supports_of_a_surface_without_boundary_are_refused(tmp_path, supports):
    pcmc.write(tmp_path / "foam.pcmc", kelvin_foam(levels=0))
    (tmp_path / "foam.toml").write_text(f'[mesh]\nfile = "foam.pcmc"\nsupports = "{supports}"\n')
    with pytest.raises(
        OptionError, match=f"the surface has no boundary for '{supports}'; leave supports out"
    ):
        build(tmp_path / "foam.toml")


def test_a_proof_of_a_cell_is_refused_before_the_work(tmp_path, capsys):
    pcmc.write(tmp_path / "foam.pcmc", kelvin_foam(levels=0))
    command = ["solve", str(tmp_path / "foam.pcmc"), "--verify", "-o", str(tmp_path / "new.pcmc")]
    assert cli.main(command) == 2
    said = capsys.readouterr()
    assert not said.out
    assert "verify: not for a periodic surface" in said.err
    assert not (tmp_path / "new.pcmc").exists()


def test_the_rise_of_half_a_mesh_is_over_its_supports_and_not_over_its_mirror_plane(tmp_path):
    plan = Plan([[0, 0], [6, 0], [6, 9], [0, 9]], edge_length=1.5, tension=3.0, mirrors=[[[6, 0], [6, 9]]])
    half = pcmc.solve(plan.surface()).surface
    heights = []
    for name, roof in (("half", half), ("whole", pcmc.mirrored(half))):
        pcmc.write(tmp_path / f"{name}.pcmc", roof)
        (tmp_path / f"{name}.toml").write_text(f'[mesh]\nfile = "{name}.pcmc"\nrise = 1.5\n')
        found = designed(tmp_path / f"{name}.toml", use_cache=False)
        heights.append((float(found.surface.tensions[0]), found.surface.vertices[:, 2].max()))
    assert heights[0] == pytest.approx(heights[1], rel=1e-6)


def test_a_point_beside_the_nearest_vertex_is_told(tmp_path):
    pcmc.write(
        tmp_path / "sail.obj", Plan([[0, 0], [4, 0], [4, 3], [0, 3]], tension=3.0, pressure=0.0).surface()
    )
    path = tmp_path / "roof.toml"
    path.write_text('[mesh]\nfile = "sail.obj"\nsupports = [[0.2, 0, 0], [4, 0, 0], [4, 3, 0], [0, 3, 0]]\n')
    with pytest.warns(
        FileWarning, match="number 1 is 0.2 from the nearest vertex, at .*, which is fixed"
    ) as told:
        assert build(path).fixed.sum() == 4
    assert len(told) == 1


@pytest.mark.parametrize("suffix", [".pcmc", ".obj"])
def test_walls_of_a_mesh_follow_the_pressures_that_the_project_gives(tmp_path, suffix):
    patches = {
        "west": {"tension": 3.0, "pressure": 0.4},
        "east": {"tension": 3.0, "pressure": 0.3, "snow": 0.05},
    }
    start = Plan(
        [[0, 0], [8, 0], [8, 4], [0, 4]], [[[4, 0], [4, 4]]], edge_length=1.0, patches=patches
    ).surface()
    wall = start.patches[2].tension
    pcmc.write(tmp_path / f"hall{suffix}", start.retensioned(pressures={"west": 0.9}))
    path, text = tmp_path / "roof.toml", f'[mesh]\nfile = "hall{suffix}"\npatches.west.pressure = 0.4\n'
    path.write_text(text)
    found = build(path)
    assert found.pressures == pytest.approx(start.pressures)
    lines = (tmp_path / f"hall{suffix}").read_bytes().splitlines()
    if suffix == ".obj":  # as from a program that knows no pressures
        (tmp_path / "hall.obj").write_bytes(b"\n".join(line for line in lines if not line.startswith(b"#")))
        given = "[mesh.patches]\nwest = {tension = 3, pressure = 0.4}\n"
        given += "east = {tension = 3, pressure = 0.3, snow = 0.05}\n"
        given += f'"wall 1" = {{tension = {wall}, wall = true}}\n'
        path.write_text(f'[mesh]\nfile = "hall.obj"\nsupports = "boundary"\n{given}')
        with pytest.warns(FileWarning, match="tensions and pressures are 1 unless given"):
            bare = build(path)
        assert (bare.pressures, bare.snows) == (pytest.approx(start.pressures), pytest.approx(start.snows))


def test_tensions_in_another_unit_of_force_than_the_file_has_are_refused(tmp_path, capsys):
    roof = Plan([[0, 0], [4, 0], [4, 3], [0, 3]], tension=3.0).surface()
    pcmc.write(tmp_path / "roof.pcmc", pcmc.solve(roof).surface, units=Units("m", "kN"))
    path = tmp_path / "roof.toml"
    path.write_text('units = "m"\nforce = "N"\n[mesh]\nfile = "roof.pcmc"\n')
    with pytest.raises(OptionError, match=r"force = 'N', but .* are in kN; make it 'kN'"):
        build(path)
    report = ["report", str(tmp_path / "roof.pcmc"), "-o", str(tmp_path / "roof.pdf"), "--force", "N"]
    assert cli.main(report) == 2
    assert "--force: the forces of roof.pcmc are in kN, not in N" in capsys.readouterr().err


FLAT = "v 0 0 0\nv 8000 0 0\nv 8000 8000 0\nv 0 8000 0\nv 4000 4000 10\nf 1 2 5\nf 2 3 5\nf 3 4 5\nf 4 1 5\n"


def test_another_unit_than_the_file_s_own_is_refused(tmp_path):
    """Before, it counted for nothing."""
    pcmc.write(tmp_path / "bay.pcmc", bay(6), units="m")
    (tmp_path / "roof.toml").write_text('[mesh]\nfile = "bay.pcmc"\nunits = "mm"\n', encoding="utf-8")
    with pytest.raises(OptionError, match=r"bay\.pcmc is in m itself, not in mm; leave units out"):
        build(tmp_path / "roof.toml")


def test_a_mesh_of_an_unlikely_size_is_noted(tmp_path):
    (tmp_path / "flat.obj").write_text(FLAT, encoding="utf-8")
    (tmp_path / "roof.toml").write_text('units = "m"\nmesh = "flat.obj"\n', encoding="utf-8")
    note = r'the mesh is 8 km long; are its numbers in mm\? Then type units = "mm" in \[mesh\], or --units mm'
    with pytest.warns(FileWarning, match="boundary is taken"), pytest.warns(FileWarning, match=note):
        build(tmp_path / "roof.toml")


@pytest.mark.parametrize("pressure", [-1.0, 0.0])
def test_a_rise_needs_a_pressure_that_lifts_the_mesh(tmp_path, pressure):
    """Before, a search ended with "a bound on the parameters is in the way", or met nothing."""
    (tmp_path / "flat.obj").write_text(FLAT, encoding="utf-8")
    text = f'[mesh]\nfile = "flat.obj"\nrise = 900\n[mesh.patches.flat]\npressure = {pressure}\n'
    (tmp_path / "roof.toml").write_text(text, encoding="utf-8")
    with (
        pytest.warns(FileWarning, match="boundary is taken"),
        pytest.raises(OptionError, match="rise is for a roof that a pressure lifts, and none does here"),
    ):
        build(tmp_path / "roof.toml")
