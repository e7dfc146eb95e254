"""CalculiX runs our structural models: what it finds under the form-finding load is what pcmc says."""

from functools import cache, partial
from importlib.util import find_spec

import numpy as np
import pytest
from nightly import at_night
from programs import needs_ccx
from refusals import refused
from shapes import rotation
from starts import four_fans, joined_caps, spherical_cap, stationary, two_squares
from structures import FABRIC, model_of, pyramid, results_of, square

import pcmc
from pcmc import Material, SelfWeight, Snow, StructuralModel, Surface, Wind
from pcmc.certificate.forces import support_forces, total_load
from pcmc.plan import Plan
from pcmc.structure import analyse, calculix
from pcmc.structure.calculix import CalculixError
from pcmc.surface.geometry import face_areas
from studies.questions import structure
from studies.reference import kratos
from tests.surface.test_circles import roofs
from tests.surface.test_lines import squares

pytestmark = needs_ccx


def flat_square(turn=None, **more):
    """The flat film with a cable, its plane turned with it."""
    surface = square(4, cable=3.0, turn=turn)
    plane = pcmc.Plane(normal=(0, 0, 1) if turn is None else turn[:, 2])
    parts = {"fixed": surface.fixed, "cables": surface.cables, "plane": plane}
    surface = Surface(surface.vertices, surface.faces, surface.patch_of_face, surface.patches, **parts)
    return model_of(surface, anyway=True, cable_area=1e-4, **more)


@pytest.mark.parametrize("turn", [None, rotation(4)])
def test_a_flat_film_and_its_cable_stay_where_they_are(turn):
    """Stress α/t in every element, tension τ in every edge, and τ more at the ends of the cable."""
    model = flat_square(turn)
    (form,) = results_of(model)
    assert form.largest_displacement < 1e-12
    np.testing.assert_allclose(form.principal_stresses, 2000.0, rtol=1e-5)
    np.testing.assert_allclose(form.cable_tensions["tie"], 3.0, rtol=1e-5)
    ends = model.surface.cables[0].edges[[0, -1], [0, 1]]
    axis = np.eye(3)[0] if turn is None else turn[:, 0]
    np.testing.assert_allclose(form.reactions[ends], np.outer([-1, 1], (3.0 + 0.5) * axis), atol=1e-4)


def test_weight_and_snow_arrive_at_the_supports():
    """All of ρ t g A, ρ a g ℓ and s A, those on the held nodes themselves, too."""
    model = flat_square(loads=[SelfWeight(), Snow(0.01, patches=["film"])])
    own = 0.1 * 9.81 * (1e-3 * 1.0 + 1e-4 * 1.0)
    _, weight, snow = results_of(model)
    np.testing.assert_allclose(weight.reactions.sum(axis=0), [0, 0, own], atol=1e-6)
    np.testing.assert_allclose(snow.reactions.sum(axis=0), [0, 0, own + 0.01], rtol=1e-4, atol=1e-6)
    assert snow.deflections.min() < weight.deflections.min() < 0.0


def test_the_deflection_of_a_tense_film_is_that_of_poisson():
    """α Δu = s over the square: u = 0.0736714 s / α in the middle, to the second order in the edge."""
    errors = []
    for n in (4, 8, 16):
        model = model_of(square(n), loads=[Snow(1e-3, patches=["film"])], anyway=True)
        depth = -np.nanmin(results_of(model)[1].deflections)
        errors.append(abs(depth / (0.0736714 * 1e-3 / 2.0) - 1.0))
    order = np.polyfit(np.log([4, 8, 16]), -np.log(errors), 1)[0]
    assert order == pytest.approx(2.0, abs=0.1)
    assert errors[-1] < 0.01


@cache
def comparison(edge):
    """Displacement, stress and reactions of the cap's model on a mesh, against ours."""
    surface = stationary(partial(spherical_cap, edge, alpha=0.6)).surface
    model = structure.structural_model(surface)
    form, snow = results_of(model)
    return structure.compared(model, form, snow)


@pytest.mark.parametrize(
    ("key", "least"), [("displacement", 1.5), ("stress_rms", 1.5), ("reaction_rms", 0.8)]
)
def test_the_cap_converges_to_ours(key, least):
    edges = (0.3, 0.15, 0.075)
    values = [comparison(edge)[key] for edge in edges]
    assert np.polyfit(np.log(edges), np.log(values), 1)[0] > least
    assert comparison(0.075)["displacement"] < 1e-6
    assert comparison(0.075)["stress_largest"] < 0.02
    assert comparison(0.075)["reaction_largest"] < 0.01


def pinched():
    """Example 1, whose junction rests on Π at the ends of a strong wall."""
    return two_squares(8, alpha_aux=3.0)


@pytest.mark.parametrize(
    "make",
    [
        partial(joined_caps, 1.0),
        *at_night(partial(four_fans, 4, alpha_aux=2.0), partial(pinched), partial(squares)),
        partial(roofs),
    ],
    ids=["sliding wall", "four walls", "pinched wall", "sliding on lines", "sliding on circles"],
)
def test_every_support_and_wall_is_at_rest_there(make):
    """Displacement, patches' stress and the sum of reactions agree; what slides has no reaction along."""
    surface = pcmc.solve(make(), target="stationary").surface
    model = structure.structural_model(surface)
    form, snow = results_of(model)
    compared = structure.compared(model, form, snow)
    assert compared["displacement"] < 1e-5
    assert compared["stress_rms"] < 0.015
    assert compared["reaction_rms"] < 0.02
    assert all(abs(row["mean"] - 1.0) < 0.02 for row in structure.by_patch(model, form))
    assert compared["support_theirs"] == pytest.approx(compared["support_ours"], rel=0.01)
    across = form.displacements - np.einsum("nij,nj->ni", model.allowed, np.nan_to_num(form.displacements))
    assert np.abs(across[model.held]).max() < 1e-9 * surface.size
    assert compared["snow_deflection"] > 0.0


def test_a_turned_surface_has_turned_results():
    given, turn = stationary(partial(joined_caps, 1.0)).surface, rotation(3)
    turned = Surface(
        given.vertices @ turn.T, given.faces, given.patch_of_face, given.patches,
        fixed=given.fixed, on_plane=given.on_plane, plane=pcmc.Plane(normal=turn[:, 2]),
    )  # fmt: skip
    loads = [(Snow(0.2), Wind({"left": 0.1}))]
    one, other = (results_of(model_of(s, loads=loads, thickness=0.01)) for s in (given, turned))
    for here, there in zip(one, other, strict=True):
        scale = np.nanmax(np.abs(one[1].displacements))
        np.testing.assert_allclose(here.displacements @ turn.T, there.displacements, atol=1e-4 * scale)
        np.testing.assert_allclose(
            here.reactions @ turn.T, there.reactions, atol=1e-4 * np.abs(here.reactions).max()
        )


def test_thicker_patches_have_less_stress_and_the_same_forces():
    surface = stationary(partial(joined_caps, 1.0)).surface
    thickness = {"left": 1e-3, "right": 2e-3, "wall": 4e-3}
    model = StructuralModel(surface, Material(1e7), thickness)
    (form,) = results_of(model)
    means = {row["patch"]: row["mean"] for row in structure.by_patch(model, form)}
    assert means == pytest.approx(dict.fromkeys(thickness, 1.0), abs=0.02)
    assert form.reactions.sum(axis=0)[2] == pytest.approx(-total_load(surface), rel=1e-2)
    ours = support_forces(surface)
    assert np.linalg.norm(form.reactions - ours) < 0.01 * np.linalg.norm(ours)


def test_self_weight_is_that_of_the_elements():
    surface = stationary(partial(spherical_cap, 0.3, alpha=0.6)).surface
    form, weight = results_of(model_of(surface, loads=[SelfWeight(2.0)], material=FABRIC, thickness=0.01))
    change = (weight.reactions - form.reactions).sum(axis=0)
    area = face_areas(surface.vertices[surface.faces]).sum()
    assert change == pytest.approx([0, 0, 0.1 * 0.01 * 2.0 * area], rel=0.02, abs=1e-6)


def test_the_program_absent_slow_or_failing_is_an_error_in_one_line(monkeypatch, tmp_path):
    with pytest.raises(CalculixError, match="within"):
        analyse(model_of(pyramid()), timeout=1e-4)
    path = tmp_path / "model.inp"
    pcmc.write_structure(path, model_of(pyramid()))
    path.write_text(path.read_text().replace("*STATIC", "*STATICALLY").replace("FIXED,1,3", "FIXED,one"))
    with pytest.raises(CalculixError, match="ERROR"):
        calculix.run_file(path)
    wrong = path.read_text()
    monkeypatch.setattr(calculix, "text_of", lambda *_, **__: wrong)
    with pytest.raises(CalculixError, match="ERROR"):  # no load that is too much
        calculix.run_as_far(model_of(pyramid()), model_of(pyramid()).steps)
    pcmc.write_structure(path, model_of(pyramid()))
    path.write_text(path.read_text().replace("TYPE=M3D3", "TYPE=M3D9"))
    with pytest.raises(CalculixError, match=r"\*ERROR reading \*ELEMENT: M3D9 is an unknown element type"):
        calculix.run_file(path)
    monkeypatch.setattr(calculix, "PROGRAM", "no-such-program")
    assert not calculix.available()
    with pytest.raises(CalculixError, match="not installed"):
        analyse(model_of(pyramid()))
    with refused(CalculixError) as caught:
        structure.data(None, True)
    assert "\n" not in str(caught.value)


def test_without_kratos_the_comparison_says_what_to_install(monkeypatch):
    monkeypatch.delenv(kratos.PYTHON, raising=False)
    if find_spec("KratosMultiphysics") is None:
        with pytest.raises(kratos.KratosError, match="install Kratos") as caught:
            kratos.run(model_of(pyramid()))
        assert "\n" not in str(caught.value)
    cable = model_of(square(2, cable=1.0), cable_area=1e-4, anyway=True)
    with pytest.raises(kratos.KratosError, match="one material"):
        kratos.run(cable)


def test_shells_carry_the_same_load_and_bend_less():
    """Shells of three nodes lock: their deflection is less than that of membranes, and nears it."""
    depths = []
    for n in (8, 16):
        given = {"loads": [Snow(1e-3, patches=["film"])], "anyway": True, "thickness": 1e-4}
        for elements in ("membrane", "shell"):
            form, snow = results_of(model_of(square(n), elements=elements, **given))
            np.testing.assert_allclose(form.principal_stresses, 2e4, rtol=1e-4)
            depths.append(-np.nanmin(snow.deflections))
    assert depths[1] < 0.9 * depths[0]
    assert depths[1] / depths[0] < depths[3] / depths[2] < 1.0


def sail(n):
    """A saddle over a square of side 8, held at its four corners, with a cable along each edge."""
    flat, side = square(n), np.arange(n + 1)
    x, y = 8.0 * flat.vertices[:, 0], 8.0 * flat.vertices[:, 1]
    X = np.column_stack([x, y, 2.0 * (x / 4.0 - 1.0) * (y / 4.0 - 1.0)])
    rims = {"south": side, "north": n * (n + 1) + side, "west": side * (n + 1), "east": side * (n + 1) + n}
    cables = [pcmc.Cable.along(name, 20.0, vertices) for name, vertices in rims.items()]
    corners = [0, n, n * (n + 1), n * (n + 2)]
    return Surface(X, flat.faces, flat.patch_of_face, flat.patches, fixed=corners, cables=cables)


def test_a_sail_between_edge_cables_is_at_rest_there():
    """Tensions of cables and reactions converge to ours, about fourfold nearer for each halving."""
    off = []
    for n in (6, 12):
        model = model_of(pcmc.solve(sail(n)), loads=[Snow(0.05, patches=["film"])], cable_area=1e-3)
        form, snow = results_of(model)
        compared = structure.compared(model, form, snow)
        assert compared["displacement"] < 3e-5
        tensions = np.concatenate(list(form.cable_tensions.values()))
        off.append([np.abs(tensions / 20.0 - 1.0).max(), compared["stress_rms"], compared["reaction_rms"]])
        assert snow.deflections.min() < 0.0
    assert (np.array(off[1]) < 0.4 * np.array(off[0])).all()
    assert max(off[1]) < 3e-3


ROPE = {"cable_area": 0.025**2, "cable_material": Material(young=1.6e8)}  # steel, as a beam 0.5 stiff


def test_shells_and_a_cable_across_them_stay_where_they_are():
    """Their nodes are tied: with shared ones CalculiX stopped with "code 255"."""
    line = {"curve": [[2, 0], [2, 4]], "cable": 3.0, "wall": False}
    plan = Plan([[0, 0], [4, 0], [4, 4], [0, 4]], [line], edge_length=0.7, tension=1.5, pressure=0.2)
    surface, snow = pcmc.solve(plan.surface()).surface, 0.05
    shells, films = (
        results_of(model_of(surface, loads=[Snow(snow)], elements=elements, cable_area=1e-4))
        for elements in ("shell", "membrane")
    )
    assert shells[0].largest_displacement < 1e-4
    for shell, film in zip(shells, films, strict=True):
        np.testing.assert_allclose(shell.cable_tensions["cable 1"], film.cable_tensions["cable 1"], rtol=0.02)
        np.testing.assert_allclose(shell.reactions.sum(axis=0), film.reactions.sum(axis=0), atol=1e-3)
        total = shell.model.nodal_loads(shell.step, shell.displacements).sum(axis=0)
        np.testing.assert_allclose(shell.reactions.sum(axis=0), -total, atol=1e-3)


@pytest.mark.nightly
def test_a_film_with_a_rope_across_follows_poisson():
    """α Δu + τ u_xx δ(y - ½) = s over the square: a series of the odd modes n, k = nπ, of closed form.

    Beside the rope u_n = p (1 - cosh ky) + ..., p = 4 s/(nπ α k²); at the rope
    u_n = p (cosh(k/2) - 1) / (cosh(k/2) + τ k sinh(k/2) / (2α)).
    """
    tension, snow, n = 3.0, 1e-3, 32
    model = model_of(square(n, cable=tension), loads=[Snow(snow, patches=["film"])], anyway=True, **ROPE)
    k = np.pi * np.arange(1, 100, 2)[:, None]
    share = 4.0 * snow / (k * 2.0 * k**2)
    share = share * (1.0 - 1.0 / np.cosh(k / 2)) / (1.0 + tension * k / 4.0 * np.tanh(k / 2))
    rope = np.append(model.surface.cables[0].edges[:, 0], model.surface.cables[0].edges[-1, 1])
    expected = (share * np.sin(k * model.surface.vertices[rope, 0])).sum(axis=0)
    found = -results_of(model)[1].deflections[rope]
    np.testing.assert_allclose(found, expected, atol=1e-3 * expected.max())


def test_a_sail_between_ropes_follows_poisson_with_strings():
    """α Δu = s inside, τ u'' = α ∂u/∂n along the arcs of its edges; by linear elements on the same mesh."""
    flat = sail(12)
    start = flat.moved(flat.vertices * [1.0, 1.0, 0.0])
    surface = pcmc.solve(start.retensioned(pressures={"film": 0.0}), target="stationary").surface
    snow = 1e-4
    model = model_of(surface, loads=[Snow(snow, patches=["film"])], anyway=True, **ROPE)
    X, K, load_at = surface.vertices, np.zeros((surface.n, surface.n)), np.zeros(surface.n)
    for face, area in zip(surface.faces, face_areas(X[surface.faces]), strict=True):
        sides = X[np.roll(face, -1)] - X[np.roll(face, 1)]
        K[np.ix_(face, face)] += 2.0 * sides @ sides.T / (4.0 * area)
        load_at[face] += snow * area / 3.0
    for cable in surface.cables:
        for a, b in cable.edges:
            K[np.ix_([a, b], [a, b])] += 20.0 / np.linalg.norm(X[b] - X[a]) * np.array([[1, -1], [-1, 1]])
    free = np.setdiff1d(np.arange(surface.n), np.flatnonzero(surface.fixed))
    expected = np.zeros(surface.n)
    expected[free] = np.linalg.solve(K[np.ix_(free, free)], load_at[free])
    found = -results_of(model)[1].deflections
    assert np.ptp(X[:, 2]) < 1e-9
    np.testing.assert_allclose(found, expected, atol=1e-3 * expected.max())
    edge = surface.cables[0].edges[1:, 0]
    np.testing.assert_allclose(found[edge], expected[edge], rtol=1e-3)


def test_a_heavy_roof_is_at_rest_under_its_own_weight():
    """Weights per area belong to the form-finding load."""
    surface = pcmc.solve(spherical_cap(0.15, alpha=0.6).retensioned(weights={"cap": 0.2})).surface
    model = structure.structural_model(surface)
    form, snow = results_of(model)
    compared = structure.compared(model, form, snow)
    assert compared["displacement"] < 2e-6
    assert compared["reaction_rms"] < 0.01
    assert compared["support_theirs"] == pytest.approx(compared["support_ours"], rel=5e-3)
