"""Probable mistakes in a mesh from another program give a warning, other meshes none."""

import warnings

import numpy as np
import pytest
from tents import tent

import pcmc
from pcmc import cli, project
from pcmc.base.errors import FileWarning

SIDE = 4  # quads of each square
FAR = np.array([5e5, 5.4e6, 0.0])


def square(left, tilt=0.3):
    """A square of triangles from x = left on, sloping up from its outer side."""
    s = np.arange(SIDE + 1) / SIDE
    x, y = np.meshgrid(left + s, s)
    points = np.column_stack([x.ravel(), y.ravel(), tilt * np.abs(x.ravel() - 1)])
    a = (np.arange(SIDE)[:, None] * (SIDE + 1) + np.arange(SIDE)).ravel()
    lower = np.column_stack([a, a + 1, a + SIDE + 2])
    upper = np.column_stack([a, a + SIDE + 2, a + SIDE + 1])
    return points, np.concatenate([lower, upper])


def write_obj(path, gap=0.0, turned=False, axes=(0, 1, 2)):
    """Two squares side by side, each with vertices of its own, as an .obj of two groups."""
    lines, first = [], 1
    for name, (X, F) in (("west", square(0.0)), ("east", square(1.0))):
        X = X + gap * np.array([float(name == "east"), 0.0, 0.0])
        F = F[:, ::-1] if turned and name == "east" else F
        lines += [f"g {name}", *("v {:.9g} {:.9g} {:.9g}".format(*x) for x in X[:, axes].tolist())]
        lines += ["f {} {} {}".format(*f) for f in (F + first).tolist()]
        first += len(X)
    path.write_text("\n".join(lines) + "\n", encoding="utf-8")
    return path


def test_patches_that_meet_and_agree_give_no_warning(tmp_path):
    surface = pcmc.read(write_obj(tmp_path / "good.obj"))
    assert len(surface.topology.junctions) == 1


def test_a_narrow_open_seam_gives_a_warning(tmp_path):
    with pytest.warns(
        FileWarning, match=r"a seam is open: 10 boundary vertices are within 0\.001 of another"
    ):
        surface = pcmc.read(write_obj(tmp_path / "gap.obj", gap=1e-3))
    assert not len(surface.topology.junctions)


def test_a_wide_gap_gives_no_warning(tmp_path):
    pcmc.read(write_obj(tmp_path / "apart.obj", gap=0.5 / SIDE))


def test_patches_turned_against_each_other_are_named(tmp_path):
    with pytest.warns(FileWarning, match="patches 'west' and 'east' are turned against each other"):
        pcmc.read(write_obj(tmp_path / "turned.obj", turned=True))


@pytest.mark.parametrize(("axes", "named"), [((0, 2, 1), "y"), ((2, 0, 1), "x")])
def test_a_roof_on_its_side_gives_a_warning(tmp_path, axes, named):
    with pytest.warns(
        FileWarning, match=f"faces {named}, but z is up here; if {named} was up, turn it: pcmc repair"
    ):
        pcmc.read(write_obj(tmp_path / "lying.obj", axes=axes))


def test_a_roof_on_its_side_whose_areas_cancel_gives_a_warning_and_the_command_turns_it(tmp_path, capsys):
    """Patches turned against each other have no sum of areas; their boundary has a plane."""
    path = write_obj(tmp_path / "lying.obj", turned=True, axes=(0, 2, 1))
    with pytest.warns(FileWarning, match="the surface faces y") as caught:
        lying = pcmc.read(path)
    command = str(caught[0].message).split("turn it: pcmc ")[1].split(";")[0]
    assert cli.main([*command.replace("turned.obj", str(tmp_path / "turned.obj")).split()]) == 0
    upright = pcmc.read(tmp_path / "turned.obj")
    assert np.ptp(upright.vertices, axis=0).tolist() == np.ptp(lying.vertices, axis=0)[[0, 2, 1]].tolist()
    assert upright.vertices[:, 2].tolist() == lying.vertices[:, 1].tolist()
    capsys.readouterr()


def test_a_mesh_without_a_unit_says_so_and_takes_the_one_given(tmp_path):
    path = write_obj(tmp_path / "plain.obj")
    with pytest.warns(FileWarning, match="no unit of length in the file; name it with --units mm, say"):
        bare = pcmc.io.read_bare(path)[0]
    for units, assumed, factor, unit in (
        ("mm", "", 1.0, "mm"),
        ("m", "mm", 1e-3, "m"),
        ("", "ft", 1.0, "ft"),
    ):
        with pytest.warns(FileWarning) as caught:
            surface, data = pcmc.io.read_bare(path, units, assumed)
        assert "no unit of length" not in str(caught[0].message)
        assert data.units.length == unit
        np.testing.assert_allclose(surface.vertices, factor * bare.vertices)


@pytest.mark.parametrize("command", ["convert", "repair", "solve"])
def test_commands_say_that_metres_are_assumed(tmp_path, capsys, command):
    pcmc.write(tmp_path / "told.obj", pcmc.read(write_obj(tmp_path / "plain.obj"), tensions=4.0))
    for units, said in (([], True), (["--units", "mm"], False)):
        out = tmp_path / "a.glb"
        more = {
            "convert": [str(out)],
            "repair": ["-o", str(out)],
            "solve": ["-o", str(out), "--no-mesh-check"],
        }
        assert cli.main([command, str(tmp_path / "told.obj"), *more[command], *units]) == 0
        assert ("a.glb: there is no unit of length, so metres are assumed" in capsys.readouterr().out) == said


def test_files_that_pcmc_wrote_give_no_warning(tmp_path):
    upright = pcmc.read(write_obj(tmp_path / "good.obj"))
    lying = upright.moved(upright.vertices[:, [2, 0, 1]])
    for suffix in (".obj", ".ply", ".vtp"):
        pcmc.write(tmp_path / f"a{suffix}", lying)
        pcmc.read(tmp_path / f"a{suffix}")


def test_the_command_warns_that_a_plain_mesh_has_no_supports(tmp_path, capsys):
    path = write_obj(tmp_path / "good.obj")
    for command in (["solve", str(path), "--tension", "4", "--no-mesh-check"], ["certify", str(path)]):
        cli.main(command)
        assert "its boundary is taken as fixed; tensions and pressures are 1" in capsys.readouterr().err
    pcmc.write(tmp_path / "told.obj", pcmc.read(path, tensions=4.0))
    assert cli.main(["solve", str(tmp_path / "told.obj"), "--no-mesh-check"]) == 0
    assert capsys.readouterr().err == ""


def surveyed():
    near = tent(tilted=False)
    plane = pcmc.Plane(tuple(FAR))
    return near, pcmc.Surface(
        near.vertices + FAR, near.faces, near.patch_of_face, near.patches, near.fixed, near.on_plane, plane
    )


def test_stl_far_from_the_origin_is_written_about_its_middle_and_says_so(tmp_path):
    near, far = surveyed()
    with pytest.warns(FileWarning, match=r"a\.stl: its coordinates are relative to \[50000\d, 540000\d, 0\]"):
        pcmc.write(tmp_path / "a.stl", far)
    again = pcmc.read(tmp_path / "a.stl")
    assert again.size == pytest.approx(near.size, rel=1e-6)
    assert again.vertices[:, 2].max() == pytest.approx(near.vertices[:, 2].max(), rel=1e-6)
    assert np.abs(again.vertices).max() < 2.0 * near.size


def test_stl_at_the_origin_is_written_where_it_is(tmp_path):
    near, _ = surveyed()
    pcmc.write(tmp_path / "a.stl", near)
    np.testing.assert_allclose(
        np.ptp(pcmc.read(tmp_path / "a.stl").vertices, axis=0), np.ptp(near.vertices, axis=0), rtol=1e-6
    )


def test_output_says_that_it_is_moved_and_what_it_lost_of_the_final_file(tmp_path):
    _, far = surveyed()
    path = tmp_path / "roof.stl"

    def write(place):
        pcmc.write(place, far, scalars={"height": far.vertices[:, 2]})

    with warnings.catch_warnings(record=True) as found:
        warnings.simplefilter("always")
        project.writing.write_all([(path, write)])
    lost, moved = (str(warning.message) for warning in found)
    assert lost.startswith(f"{path}: a .stl file cannot carry height, supports")
    assert moved.startswith(f"{path}: its coordinates are relative to")
