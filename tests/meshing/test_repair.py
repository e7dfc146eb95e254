"""Dirty meshes repaired with MeshLab: each fault alone, all together, and what stays."""

from __future__ import annotations

import os

import numpy as np
import pytest
from nightly import at_night
from periodic_cases import bay
from refusals import refused

import pcmc
from generators import double_bubble
from pcmc import cli, io
from pcmc.base.errors import FileError, FileWarning, OptionError, SurfaceError
from pcmc.meshing.elevation import elevate
from pcmc.surface.geometry import area_vectors

pytest.importorskip("pymeshlab")

N = 9


def sheet(n=N, x=0.0):
    """Points and triangles of a bulging square of n by n points, 1 by 1, from x on."""
    u = np.linspace(0.0, 1.0, n)
    points = [[x + a, b, 2.0 * a * (1 - a) * b * (1 - b)] for a in u for b in u]
    corner = np.arange(n * n).reshape(n, n)
    quads = [(i, j) for i in range(n - 1) for j in range(n - 1)]
    a, b, c, d = (
        np.array([corner[i + p, j + q] for i, j in quads]) for p, q in ((0, 0), (1, 0), (1, 1), (0, 1))
    )
    return np.array(points), np.concatenate([np.stack([a, b, c], 1), np.stack([a, c, d], 1)])


def obj(path, X, groups):
    """An .obj with a group per entry: name and faces."""
    lines = [f"v {x!r} {y!r} {z!r}" for x, y, z in X.tolist()]
    for name, faces in groups.items():
        lines += [f"g {name}", *("f " + " ".join(str(v + 1) for v in face) for face in faces)]
    path.write_text("\n".join(lines) + "\n")
    return path


def changed(path, **options):
    """The repaired surface, how often what was changed, and the notes."""
    before = path.read_bytes()
    repaired = pcmc.repair(path, **options)
    assert path.read_bytes() == before
    return repaired.surface, dict(repaired.changes) | dict.fromkeys(repaired.notes)


def area(X, F):
    return np.linalg.norm(area_vectors(X[F]), axis=1).sum()


def test_a_clean_mesh_stays_as_it_is(tmp_path):
    X, F = sheet()
    surface, changes = changed(obj(tmp_path / "a.obj", X, {"roof": F}))
    assert changes == {}
    assert str(pcmc.repair(tmp_path / "a.obj")) == "nothing to repair"
    np.testing.assert_allclose(area(surface.vertices, surface.faces), area(X, F), rtol=1e-14)
    assert surface.m == len(F)


def test_open_seams_are_welded(tmp_path):
    X, F = sheet()
    soup = X[F].reshape(-1, 3) + np.random.default_rng(1).uniform(-1e-7, 1e-7, (3 * len(F), 3))
    path = obj(tmp_path / "a.obj", soup, {"roof": np.arange(3 * len(F)).reshape(-1, 3)})
    surface, changes = changed(path)
    assert (surface.n, surface.m) == (len(X), len(F))
    assert changes == {"vertices welded": 3 * len(F) - len(X)}
    loose, _ = changed(path, weld=0.0)
    assert loose.n == 3 * len(F)


def test_curved_elements_are_left_out_and_this_is_said(tmp_path):
    X, F = sheet()
    flat = pcmc.Surface(X, F, [0] * len(F), [pcmc.Patch("roof", 1.0)], fixed=range(len(X)))
    for name in ("a.pcmc", "a.vtp"):
        pcmc.write(tmp_path / name, elevate(flat, 2))
        repaired = pcmc.repair(tmp_path / name)
        assert repaired.surface.order == 1
        assert "left out: supports, curved elements; the boundary is fixed" in repaired.notes


@pytest.mark.filterwarnings("ignore:no vertex is fixed")
def test_bubbles_have_no_boundary_that_could_be_fixed(tmp_path):
    pcmc.write(tmp_path / "bubbles.pcmc", double_bubble(volumes=(1.0, 1.0)))
    assert str(pcmc.repair(tmp_path / "bubbles.pcmc")) == "left out: rooms"


def test_images_are_left_out_and_this_is_said(tmp_path):
    pcmc.write(tmp_path / "bay.pcmc", bay(4))
    repaired = pcmc.repair(tmp_path / "bay.pcmc")
    assert not repaired.surface.periodic
    assert "left out: supports, images; the boundary is fixed" in repaired.notes


def test_repeated_and_flat_triangles_are_left_out(tmp_path):
    X, F = sheet()
    wrong = [F[0], F[3][::-1], [F[5][0], F[5][1], F[5][1]]]
    surface, changes = changed(obj(tmp_path / "a.obj", X, {"roof": [*F, *wrong[:2], wrong[2]]}))
    assert surface.m == len(F)
    assert changes["repeated triangles left out"] == 2
    assert changes["triangles without area left out"] == 1


def test_a_flat_triangle_inside_leaves_no_crack(tmp_path):
    """A vertex on the side of its neighbour: the flat triangle is flipped away."""
    X = np.array([[0, 0, 0], [2, 0, 0], [1, 1, 0], [1, -1, 0], [1, 0, 0]], dtype=float)
    F = [[0, 4, 2], [4, 1, 2], [0, 1, 4], [1, 0, 3]]
    surface, _ = changed(obj(tmp_path / "a.obj", X, {"roof": F}), holes=0)
    assert surface.m == 4
    assert area(surface.vertices, surface.faces) == pytest.approx(2.0, rel=1e-12)
    assert surface.topology.boundary_edge.sum() == 4


def test_edges_of_three_triangles_are_split_unless_they_are_junctions(tmp_path):
    X, F = sheet()
    flap = np.array([[0.5, 0.5, 1.0]])
    edge = F[np.flatnonzero((F == 4 * N + 4).any(axis=1))[0]][:2]
    points = np.concatenate([X, flap])
    fin = [[edge[0], edge[1], len(X)]]
    path = obj(tmp_path / "one.obj", points, {"roof": [*F, *fin]})
    with pytest.raises((SurfaceError, FileError)):
        pcmc.read(path)
    surface, changes = changed(path)
    assert changes["edges of three or more triangles of one patch split"] == 1
    assert surface.m == len(F) + 1
    junction, changes = changed(obj(tmp_path / "two.obj", points, {"roof": F, "wall": fin}))
    assert changes == {}
    assert [patch.name for patch in junction.patches] == ["roof", "wall"]
    assert junction.topology.junctions


def test_small_holes_are_closed_and_openings_and_junctions_stay(tmp_path):
    X, F = sheet(13)
    middle = X[F].mean(axis=1)[:, :2]
    small = np.abs(middle - [0.29, 0.29]).max(axis=1) < 0.05
    large = np.abs(middle - [0.7, 0.7]).max(axis=1) < 0.2
    inner = np.abs(middle - [0.29, 0.71]).max(axis=1) < 0.05
    assert (small.sum(), inner.sum()) == (2, 2)
    groups = {"roof": F[~(small | large | inner)], "eye": F[inner]}
    surface, changes = changed(obj(tmp_path / "a.obj", X, groups))
    assert changes == {"holes closed": 1, "triangles added in holes": 2}
    assert surface.m == len(F) - large.sum()
    assert [patch.name for patch in surface.patches] == ["roof", "eye"]
    _, changes = changed(tmp_path / "a.obj", holes=0)
    assert changes == {}
    surface, changes = changed(obj(tmp_path / "b.obj", *_square()))
    assert (changes, surface.m) == ({}, 2)


def _square():
    return np.array([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0.0]]), {"roof": [[0, 1, 2], [0, 2, 3]]}


def test_triangles_are_turned_alike_and_up(tmp_path):
    X, F = sheet()
    mixed = F.copy()
    mixed[::3] = mixed[::3, ::-1]
    surface, changes = changed(obj(tmp_path / "a.obj", X, {"roof": mixed}))
    assert changes["triangles turned"] == len(F[::3])
    assert (area_vectors(surface.vertices[surface.faces])[:, 2] > 0.0).all()


def test_points_that_are_no_numbers_and_polygons(tmp_path):
    X, F = sheet()
    X[0] = np.nan
    quads = [[F[k][0], F[k][1], F[k][2], F[len(F) // 2 + k][2]] for k in range(len(F) // 2)]
    path = obj(tmp_path / "a.obj", X, {"roof": F})
    _, changes = changed(path)
    assert changes["triangles at points that are no numbers left out"] == 2
    X[0] = 0.0
    _, changes = changed(obj(tmp_path / "b.obj", X, {"roof": quads}))
    assert changes == {f"{len(quads)} quads were cut into triangles": None}


def test_a_polygon_that_read_refuses_is_read_by_meshlab(tmp_path):
    turn = np.linspace(0, 2 * np.pi, 300, endpoint=False)
    X = np.stack([np.cos(turn), np.sin(turn), 0 * turn], axis=1)
    path = obj(tmp_path / "a.obj", X, {"disc": [range(300)]})
    with pytest.raises(FileError, match="pcmc repair"):
        pcmc.read(path)
    surface, _ = changed(path)
    assert area(surface.vertices, surface.faces) == pytest.approx(np.pi, rel=1e-3)


def test_a_wall_quad_without_height_is_left_out_and_the_groups_stay(tmp_path):
    X, F = sheet()
    flat = [[0, 1, 1 + len(X), len(X)]]  # below the first edge of the sheet, and at its place
    path = obj(tmp_path / "a.obj", np.concatenate([X, X[:2]]), {"roof": F, "wall": flat})
    surface, changes = changed(path)
    assert [patch.name for patch in surface.patches] == ["roof"]
    assert surface.m == len(F)
    assert changes["triangles without area left out"] == 2
    with pytest.raises(SurfaceError, match=r"pcmc repair .* -o clean.obj"):
        pcmc.read(path)


def test_a_file_that_only_meshlab_reads_says_why_in_full(tmp_path):
    star = np.array([[0, 0, 0], [4, 0, 0], [1, 1, 0], [0, 4, 0], [4, 4, 0.0]])
    path = obj(tmp_path / "a.obj", star, {"roof": [[0, 4, 1, 3, 2], [0, 1, 2]]})
    notes = [note for note in pcmc.repair(path, holes=0).notes if "MeshLab" in note]
    assert notes[0].endswith("in the program that wrote it, or with pcmc repair)")


@pytest.mark.parametrize("suffix", [".3dm", ".obj"])
def test_a_repaired_mesh_keeps_its_unit(tmp_path, suffix):
    X, F = sheet()
    plain, path, out = tmp_path / "a.obj", tmp_path / f"b{suffix}", tmp_path / f"c{suffix}"
    obj(plain, 12000.0 * X, {"roof": F})
    for file, more, to in ((plain, ["--units", "mm"], path), (path, [], out), (out, ["--units", "m"], plain)):
        assert cli.main(["repair", str(file), "-o", str(to), *more]) == 0
        data = pcmc.io.load(to)
        unit, factor = ("m", 1e-3) if to == plain else ("mm", 1.0)
        assert data.units.length == unit
        np.testing.assert_allclose(np.ptp(data.vertices, axis=0)[:2], [12000.0 * factor] * 2)


def test_a_scan_is_simplified_to_an_edge_length(tmp_path):
    X, F = sheet(61)
    X[:, 2] += np.random.default_rng(2).normal(0, 1e-4, len(X))
    surface, changes = changed(obj(tmp_path / "a.obj", X, {"scan": F}), edge_length=0.1)
    lengths = np.linalg.norm(np.diff(surface.vertices[surface.topology.edges], axis=1), axis=2)
    assert lengths.mean() == pytest.approx(0.1, rel=0.25)
    assert changes == {f"{len(F)} triangles became {surface.m}": None}
    assert area(surface.vertices[:, :2] @ np.eye(2, 3), surface.faces) == pytest.approx(1.0, rel=1e-2)


def test_the_command_says_what_it_changed_and_writes_a_roof_that_solves(tmp_path, capsys):
    X, F = sheet()
    path = obj(tmp_path / "a.obj", X, {"roof": [*F, F[0]]})
    out = tmp_path / "clean.obj"
    assert cli.main(["repair", str(path), "-o", str(out)]) == 0
    assert "1 repeated triangles left out" in capsys.readouterr().out
    assert cli.main(["solve", str(out), "--tension", "4", "--no-mesh-check"]) == 0
    capsys.readouterr()
    assert cli.main(["repair", str(path), "-o", str(path)]) == 2
    assert "name another file" in capsys.readouterr().err
    for option in (["--weld", "-1"], ["--holes", "-1"], ["--edge-length", "0"]):
        assert cli.main(["repair", str(path), "-o", str(out), *option]) == 2
    assert "edge_length" in capsys.readouterr().err


OFF = "OFF\n4 2 0\n0 0 0\n1 0 0\n1 1 0\n0 1 0\n3 0 1 2\n3 0 2 3\n"
X3D = """<?xml version="1.0" encoding="UTF-8"?><X3D profile="Interchange" version="3.0"><Scene><Shape>
<IndexedFaceSet coordIndex="0 1 2 -1 0 2 3 -1"><Coordinate point="0 0 0 1 0 0 1 1 0 0 1 0"/></IndexedFaceSet>
</Shape></Scene></X3D>"""


@pytest.mark.parametrize(("suffix", "content"), [(".off", OFF), (".x3d", X3D)])
def test_formats_of_meshlab_are_read(tmp_path, suffix, content):
    path = tmp_path / f"roof{suffix}"
    path.write_text(content)
    surface = pcmc.read(path, fixed="boundary")
    assert (surface.n, surface.m) == (4, 2)
    with refused(FileError, found=suffix):
        pcmc.write(path, surface)
    path.write_text(content[: len(content) // 2])
    with refused(FileError, what=str(path)):
        pcmc.read(path)
    assert cli.main(["solve", str(path), "-o", str(path)]) == 2


def test_a_hard_link_to_the_mesh_is_not_written_over(tmp_path, capsys):
    X, F = sheet()
    path, link = obj(tmp_path / "a.obj", X, {"roof": F}), tmp_path / "b.obj"
    link.hardlink_to(path)
    assert cli.main(["repair", str(path), "-o", str(link)]) == 2
    assert path.samefile(link)


def test_what_cannot_be_repaired_is_refused_by_name(tmp_path):
    X, F = sheet()
    with refused(FileError, what=str(tmp_path / "none.obj")):
        pcmc.repair(tmp_path / "none.obj")
    path = obj(tmp_path / "a.obj", X, {"roof": F})
    with refused(FileError) as caught:
        pcmc.repair(path, weld=100.0)
    assert "weld" in str(caught.value)
    lengths = [{"edge_length": length} for length in (0.0, 1e-320, 1e-5)]
    for options in ({"weld": -1.0}, {"holes": 2.5}, *lengths):
        with pytest.raises(OptionError):
            pcmc.repair(path, **options)


@pytest.mark.parametrize("units", ["mm", *at_night("")])
@pytest.mark.parametrize("suffix", [s for s, form in io.FORMATS.items() if form.reads])
def test_a_repaired_mesh_has_no_more_tensions_than_before(tmp_path, suffix, units):
    """Tensions and pressures of 1 stood for none, and became 1000 and 1000000 in metres."""
    X, F = sheet()
    raw = obj(tmp_path / "a.obj", 1000.0 * X, {"roof": F})
    once, clean = tmp_path / "b.obj", tmp_path / f"c{suffix}"
    assumed = "" if suffix in (".glb", ".gltf", ".3dm") else "mm"  # these have a unit of their own
    assert cli.main(["repair", str(raw), "-o", str(once)]) == 0
    for source in (raw, once):
        more = ["--units", units] if units else []
        assert cli.main(["repair", str(source), "-o", str(clean), *more]) == 0
        with pytest.warns(FileWarning, match="tensions and pressures are 1 unless given"):
            surface, data = io.read_bare(clean, "m", assumed)
        assert (surface.tensions.tolist(), surface.pressures.tolist()) == ([1.0], [1.0])
        assert data.bare == ("roof",)
        assert np.ptp(surface.vertices[:, 0]) == pytest.approx(1.0, rel=1e-6) or not units


def test_a_patch_that_another_program_added_has_no_tension_to_convert(tmp_path):
    X, F = sheet()
    surface = pcmc.repair(obj(tmp_path / "b.obj", X, {"roof": F})).surface
    pcmc.write(path := tmp_path / "a.obj", surface, units="mm")
    assert not io.load(path).bare
    path.write_text(path.read_text().replace("g roof", "g roof_1"))
    with pytest.warns(FileWarning, match="tensions and pressures are 1 unless given"):
        assert io.read_bare(path, "m")[0].tensions.tolist() == [1.0]


def test_flipped_bits_never_crash_the_repair(tmp_path):
    X, F = sheet()
    data = obj(tmp_path / "a.obj", X, {"roof": F}).read_bytes()
    random = np.random.default_rng(3)
    file = tmp_path / "flipped.obj"
    outcomes = set()
    for _ in range(int(os.environ.get("PCMC_FLIPS", "100")) // 10):
        flipped = bytearray(data)
        for place in random.integers(0, len(flipped), 5):
            flipped[place] ^= 1 << int(random.integers(8))
        file.write_bytes(bytes(flipped))
        try:
            pcmc.repair(file)
            outcomes.add("repaired")
        except (FileError, SurfaceError, OptionError, FileWarning) as error:
            outcomes.add(type(error).__name__)
    assert "repaired" in outcomes
