"""What is written is read back, as far as the format goes, and nothing half-written stays."""

import json
import sys
import warnings
from dataclasses import replace

import numpy as np
import pytest
from refusals import refused
from scipy.spatial import cKDTree
from tents import everything, tent

import pcmc
from pcmc.base.errors import FileError, FileWarning, LostWarning, MissingExtra, OptionError, SurfaceError
from pcmc.base.units import Units
from pcmc.io import FORMATS, load
from pcmc.io.mesh_data import converted

READ = [suffix for suffix, form in FORMATS.items() if form.reads]
SINGLE = (".stl", ".glb", ".gltf")  # in single precision
NAMES_ONLY = (".stl",)  # of all that is not the mesh
SCALARS = (".pcmc", ".ply", ".vtp", ".vtu", ".glb", ".gltf")


def matched(found, wanted, tolerance):
    """Where each vertex wanted is among those found."""
    assert len(found) == len(wanted)
    distance, place = cKDTree(found).query(wanted)
    assert distance.max() <= tolerance
    assert len(np.unique(place)) == len(wanted)
    return place


def turned(face):
    """A face from its smallest vertex on, the orientation kept."""
    k = int(np.argmin(face))
    return tuple(int(v) for v in np.roll(face, -k))


@pytest.mark.parametrize("suffix", READ)
@pytest.mark.parametrize(
    "names", [("west side", "east", "wall"), ("Süd/Ost", "a.b", "κ_1 (2)"), ("a\\", "$x$", "ü" * 100)]
)
def test_round_trip(tmp_path, suffix, names):
    surface = tent(names=names, tilted=suffix not in NAMES_ONLY)
    path = tmp_path / f"roof one{suffix}"
    pcmc.write(path, surface)
    assert [p.name for p in tmp_path.iterdir()] == [path.name]
    again = pcmc.read(path)
    tolerance = surface.size * (1e-7 if suffix in SINGLE else 0.0)
    place = matched(again.vertices, surface.vertices, tolerance)
    assert sorted(p.name for p in again.patches) == sorted(names)
    for k, name in enumerate(names):
        wanted = {turned(f) for f in place[surface.faces[surface.patch_of_face == k]]}
        mine = again.patch_of_face == again.patch_index(name)
        assert {turned(f) for f in again.faces[mine]} == wanted
    if suffix in NAMES_ONLY:
        assert set(again.tensions) == {1.0} == set(again.pressures)
        np.testing.assert_array_equal(again.fixed, again.topology.on_boundary)
        return
    assert again.patches == surface.patches
    assert again.plane == surface.plane
    np.testing.assert_array_equal(again.fixed[place], surface.fixed)
    np.testing.assert_array_equal(again.on_plane[place], surface.on_plane)
    assert pcmc.energy(again) == pytest.approx(pcmc.energy(surface), rel=tolerance or 1e-14)


ODD = "\\ * {%41} solid /* #1 $x$ 'q' \" a::b // 屋根\\"
NAMED = {
    "plain": (("west", "east"), ("ridge", "hall", "mirror 1")),
    "odd": ((ODD, "{a}"), (ODD, ODD, ODD)),
    "special": (("world", "fixed"), ("PCMC-RIM", "VERTICES", "read")),
    "case": (("East", "east"), ("EAST", "east", "East")),
}


@pytest.mark.parametrize("named", NAMED)
@pytest.mark.parametrize("suffix", READ)
def test_a_surface_read_back_equals_the_one_written(tmp_path, suffix, named):
    """Forces, cables, rooms, guides, mirrors, units and names; or the format says what it loses."""
    surface, path = everything(*NAMED[named]), tmp_path / f"a{suffix}"
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        if suffix in NAMES_ONLY and named == "odd":
            with refused(FileError, what=str(path), where="patches", found=ODD):
                pcmc.write(path, surface)
            return
        pcmc.write(path, surface, units=Units("m", "kN"))
        again = pcmc.read(path)
    lost = "".join(str(w.message) for w in caught if issubclass(w.category, LostWarning))
    assert len(caught) == bool(lost)
    place = matched(again.vertices, surface.vertices, surface.size * (1e-7 if suffix in SINGLE else 0.0))
    assert {p.name for p in again.patches} == {p.name for p in surface.patches}
    if suffix in NAMES_ONLY:
        words = ("weights", "snow", "lines or circles", "cables", "rooms", "planes", "unit m", "supports")
        assert all(word in lost for word in words)
        return
    assert ("its unit m" in lost) == (load(path).units == Units())
    assert not lost or suffix in (".fe", ".dmp")
    assert set(again.patches) == set(surface.patches)
    assert [(c.name, c.tension) for c in again.cables] == [(c.name, c.tension) for c in surface.cables]
    ends = np.sort(place[surface.cables[0].edges], axis=1)
    assert {tuple(e) for e in again.cables[0].edges.tolist()} == {tuple(e) for e in ends.tolist()}
    ((room, volume),) = ((dict(room.patches), room.volume) for room in again.rooms)
    assert (room, volume, again.rooms[0].name) == (dict.fromkeys(NAMED[named][0], 1), 7.0, NAMED[named][1][1])
    ((plane, mask),) = again.on_planes
    assert (plane.name, plane.mirror) == (NAMED[named][1][2], True)
    np.testing.assert_array_equal(mask[place], surface.on_planes[0][1])
    if "lines" not in lost:
        for (guide, along), (same, before) in zip(again.on_line, surface.on_line, strict=True):
            assert guide == same
            np.testing.assert_array_equal(along[place], before)
        for given, before in zip(
            *(x.given_supports.fixed_and_sliding() for x in (again, surface)), strict=True
        ):
            np.testing.assert_array_equal(given[place], before)
    assert pcmc.energy(again) == pytest.approx(pcmc.energy(surface), rel=1e-6 if suffix in SINGLE else 1e-13)


@pytest.mark.parametrize("suffix", [".glb", ".3dm", ".ifc"])
def test_parts_that_no_longer_fit_their_mesh_are_left_out_with_a_note(tmp_path, suffix, monkeypatch):
    """As where another program moved the roof, but not what pcmc wrote about it."""
    surface, path = everything(), tmp_path / f"a{suffix}"
    pcmc.write(path, surface)
    reader = FORMATS[suffix].functions.read

    def moved(path):
        data = reader(path)
        return replace(data, vertices=data.vertices + np.array([0.0, 0.0, 0.1]))

    monkeypatch.setattr(FORMATS[suffix].functions, "read", moved)
    wrong = "cable 'ridge' was left out, what slides along a line is fixed, what slides on a plane is fixed"
    with pytest.warns(FileWarning, match=wrong):
        again = pcmc.read(path, plane=pcmc.Plane((0, 0, 0.1)))
    assert not any((again.cables, again.on_line, again.on_planes))
    assert again.held.sum() == surface.held.sum()


@pytest.mark.parametrize("suffix", [s for s in FORMATS if s != ".3dm"])  # it has the time in it
def test_same_surface_same_bytes(tmp_path, suffix):
    for name in ("a", "b"):
        pcmc.write(tmp_path / f"{name}{suffix}", tent(tilted=suffix not in NAMES_ONLY))
    assert (tmp_path / f"a{suffix}").read_bytes() == (tmp_path / f"b{suffix}").read_bytes()


@pytest.mark.parametrize("suffix", READ)
def test_scalars_travel_or_are_said_to_be_lost(tmp_path, suffix):
    surface, path = tent(), tmp_path / f"a{suffix}"
    scalars = {"height": surface.vertices[:, 2], "mean_curvature": pcmc.mean_curvature(surface)}
    if suffix not in SCALARS:
        too = ", its plane Π, supports, tensions, pressures" if suffix in NAMES_ONLY else ""
        with pytest.warns(FileWarning, match=f"cannot carry height, mean_curvature{too}; left out"):
            pcmc.write(path, surface, scalars=scalars)
        assert not load(path).scalars
        return
    pcmc.write(path, surface, scalars=scalars)
    contents = load(path)
    place = matched(contents.vertices, surface.vertices, 1e-6)
    for name, values in scalars.items():
        np.testing.assert_allclose(
            contents.scalars[name][place], values, rtol=1e-6 if suffix in SINGLE else 0
        )


@pytest.mark.parametrize("suffix", [".pcmc", ".ply", ".vtp", ".vtu"])
def test_scalars_of_faces_travel(tmp_path, suffix):
    surface, values = tent(), np.linspace(0, 1, 12)
    pcmc.write(tmp_path / f"a{suffix}", surface, scalars={"load": values})
    np.testing.assert_array_equal(load(tmp_path / f"a{suffix}").scalars["load"], values)


def test_gltf_says_that_face_scalars_are_lost(tmp_path):
    with pytest.warns(FileWarning, match=r"\.glb file cannot carry load"):
        pcmc.write(tmp_path / "a.glb", tent(), scalars={"load": np.zeros(12)})


@pytest.mark.parametrize("suffix", [".glb", ".gltf"])
def test_single_precision_is_enough_in_a_survey_s_coordinates(tmp_path, suffix):
    near = tent()
    shift = np.array([5e5, 5e6, 0.0])
    far = near.rebuilt(
        vertices=near.vertices + shift, plane=pcmc.Plane(near.plane.point + shift, near.plane.normal)
    )
    pcmc.write(tmp_path / f"far{suffix}", far)
    back = pcmc.read(tmp_path / f"far{suffix}")
    assert back.n == far.n
    assert cKDTree(far.vertices).query(back.vertices)[0].max() < 1e-6 * far.size


def test_native_keeps_the_certificate(tmp_path):
    told = {"verdict": "stable", "residual": np.float64(1e-13), "areas": np.array([1.0, 0.1])}
    pcmc.write(tmp_path / "a.pcmc", tent(), certificate=told)
    again = load(tmp_path / "a.pcmc").certificate
    assert (again["verdict"], again["residual"]) == ("stable", 1e-13)
    np.testing.assert_array_equal(again["areas"], [1.0, 0.1])
    certificate = pcmc.certify(tent())
    pcmc.write(tmp_path / "a.pcmc", tent(), certificate=certificate)
    again = load(tmp_path / "a.pcmc").certificate
    assert again["verdict"] == certificate.verdict.name.lower()
    np.testing.assert_array_equal(again["reactions"], certificate.reactions)
    assert again["supports"] == certificate.supports.to_dict(orient="records")
    assert again["balance"] == certificate.balance.to_dict(orient="records")
    assert "acting" not in again
    assert [row["patch"] for row in again["patches"]] == ["west side", "east", "wall"]
    with refused(FileError, what="certificate", found="int"):
        pcmc.write(tmp_path / "b.pcmc", tent(), certificate=3)
    with refused(FileError, where="certificate", found="object"):
        pcmc.write(tmp_path / "b.pcmc", tent(), certificate={"what": object()})
    with pytest.warns(FileWarning, match="cannot carry certificate"):
        pcmc.write(tmp_path / "a.obj", tent(), certificate=told)
    assert sorted(p.name for p in tmp_path.iterdir()) == ["a.obj", "a.pcmc"]


def test_closed_and_flat_surfaces(tmp_path):
    """Nothing held, and a boundary that is not held either: as written, not guessed."""
    X = [[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]]
    F = [[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]]
    flap = pcmc.Surface(X, F[1:], [0] * 3, [pcmc.Patch("a", 2.0)], fixed=[0])
    for suffix in set(READ) - set(NAMES_ONLY):
        pcmc.write(tmp_path / f"a{suffix}", flap)
        again = pcmc.read(tmp_path / f"a{suffix}")
        assert again.fixed.sum() == 1, suffix
        np.testing.assert_allclose(again.vertices[again.fixed], [X[0]], atol=1e-7)


def test_what_the_caller_says_wins(tmp_path):
    path = tmp_path / "a.obj"
    pcmc.write(path, tent())
    plane = tent().plane
    again = pcmc.read(path, tensions={"wall": 9.0}, pressures=2.0, fixed="boundary", on_plane=(), plane=plane)
    assert again.tensions.tolist() == [3.0, 2.1, 9.0]
    assert again.pressures.tolist() == [2.0] * 3
    np.testing.assert_array_equal(again.fixed, again.topology.on_boundary)
    held = pcmc.read(path, fixed=[0, 1])
    assert np.flatnonzero(held.fixed).tolist() == [0, 1]
    with pytest.raises(OptionError, match=r"a\.obj: unknown patch 'wal'; did you mean 'wall'"):
        pcmc.read(path, tensions={"wal": 1.0})
    with pytest.raises(OptionError, match="unknown fixed 'boundry'; did you mean 'boundary'"):
        pcmc.read(path, fixed="boundry")
    with pytest.raises(SurfaceError, match=r"a\.obj: fixed\[0\] = 99"):
        pcmc.read(path, fixed=[99])


@pytest.mark.parametrize("suffix", FORMATS)
@pytest.mark.parametrize("part", [0.0, 0.02, 0.3, 0.6, 0.9, 0.99])
def test_truncated_files_are_refused_in_one_line(tmp_path, suffix, part):
    pcmc.write(tmp_path / f"a{suffix}", tent(tilted=suffix not in NAMES_ONLY))
    data = (tmp_path / f"a{suffix}").read_bytes()
    path = tmp_path / f"cut{suffix}"
    path.write_bytes(data[: int(part * len(data))])
    with pytest.raises((FileError, SurfaceError)) as caught:
        pcmc.read(path)
    message = str(caught.value)
    assert message.startswith(f"{path}: ")
    assert "\n" not in message
    assert len(message) < 400


@pytest.mark.parametrize("suffix", FORMATS)
def test_other_formats_under_this_suffix_are_refused(tmp_path, suffix):
    path = tmp_path / f"wrong{suffix}"
    for data in (b"", b"\x00\xff\xfe" * 200, "Grüße\n".encode("latin-1"), b"<html></html>\n" * 9):
        path.write_bytes(data)
        with refused(FileError, what=str(path)):
            pcmc.read(path)


def test_paths_that_cannot_be(tmp_path):
    with pytest.raises(FileError, match=r"unknown suffix '\.obk'; did you mean '\.obj'"):
        pcmc.read(tmp_path / "a.obk")
    with refused(FileError, what=str(tmp_path / "a"), found="", expected=list(FORMATS)):
        pcmc.write(tmp_path / "a", tent())
    with pytest.raises(FileError, match=r"cannot be read \(No such file"):
        pcmc.read(tmp_path / "none.ply")
    (tmp_path / "folder.obj").mkdir()
    with pytest.raises(FileError, match=r"is no regular file but a folder"):
        pcmc.read(tmp_path / "folder.obj")
    for suffix in FORMATS:
        path = tmp_path / "no folder" / f"a{suffix}"
        with refused(FileError, what=str(path)):
            pcmc.write(path, tent())
    with refused(FileError, what="scalars", where="h", found=(3,)):
        pcmc.write(tmp_path / "a.ply", tent(), scalars={"h": np.zeros(3)})
    for wrong in ("abc", [1.0], 3):
        with refused(OptionError, what="scalars", found=wrong):
            pcmc.write(tmp_path / "a.ply", tent(), scalars=wrong)
    for named in ({"h": "abc"}, {"a\nb": np.zeros(10)}, {3: np.zeros(10)}):
        with refused(OptionError, what="scalars"):
            pcmc.write(tmp_path / "a.ply", tent(), scalars=named)
    for suffix in (".ply", ".vtp"):
        with refused(FileError, where="support", found="support"):
            pcmc.write(tmp_path / f"a{suffix}", tent(), scalars={"support": np.zeros(10)})
    assert [p.name for p in tmp_path.iterdir()] == ["folder.obj"]


def test_a_failed_write_leaves_the_old_file(tmp_path, monkeypatch):
    path = tmp_path / "a.obj"
    pcmc.write(path, tent())
    before = path.read_bytes()

    def half(path, *_, **__):
        path.write_text("half")
        raise KeyboardInterrupt

    monkeypatch.setattr("pcmc.io.obj.write", half)
    with pytest.raises(KeyboardInterrupt):
        pcmc.write(path, tent())
    assert path.read_bytes() == before
    assert [p.name for p in tmp_path.iterdir()] == ["a.obj"]


@pytest.mark.parametrize(
    ("suffix", "name"), [(".stl", "trimesh"), (".glb", "trimesh"), (".vtp", "pyvista"), (".3dm", "rhino3dm")]
)
def test_missing_libraries_are_named(tmp_path, monkeypatch, suffix, name):
    path = tmp_path / f"a{suffix}"
    pcmc.write(path, tent(tilted=False))
    monkeypatch.setitem(sys.modules, name, None)
    with pytest.raises(MissingExtra, match=rf"{name} is not installed.*pcmc-surfaces\[files\]"):
        pcmc.read(path)


def test_damaged_native_files(tmp_path):
    pcmc.write(tmp_path / "a.pcmc", tent())
    with np.load(tmp_path / "a.pcmc") as archive:
        arrays = {name: archive[name] for name in archive.files}
    meta = json.loads(str(arrays["meta"]))

    def changed(**changes):
        path = tmp_path / "b.pcmc"
        with path.open("wb") as file:
            np.savez(file, **{**arrays, "meta": np.array(json.dumps({**meta, **changes}))})
        return path

    with refused(FileError, where="version", found=11, expected=10):
        pcmc.read(changed(version=11))
    with pytest.raises(FileError, match=r"written by a pcmc before 0.1.0, with 'cables'; write"):
        pcmc.read(changed(cables=[["ridge", 0.5]]))  # whose arrays this one would not read
    with refused(FileError, where="format", found="other", expected="pcmc surface"):
        pcmc.read(changed(format="other"))
    with refused(FileError, where="metadata", found="{}"):
        pcmc.read(changed(description="{}"))
    assert pcmc.read(changed()).n == 10


def test_findings_of_a_file_do_not_stay_in_another_unit(tmp_path):
    """Before, a file in mm had areas, volume and curvature of the one in m."""
    result = pcmc.solve(tent())
    curvature = {"mean curvature": np.ones(result.surface.n)}
    pcmc.write(tmp_path / "a.pcmc", result, scalars=curvature, units="m")
    data = converted(load(tmp_path / "a.pcmc"), "mm")
    assert set(data.certificate) == {"mark"}
    assert data.scalars["mean curvature"] == pytest.approx(1e-3)
    assert data.notes[1] == "its certificate is left out"
