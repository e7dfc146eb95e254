"""The volume between a patch and Π: closed forms, its gradient, and what the patches' volumes add up to."""

import dataclasses

import numpy as np
import pytest
from design_cases import changed

import pcmc
from generators import catenoid, double_bubble, four_fans, spherical_cap, two_caps, two_squares
from pcmc import Parameter, Patch, Plane, Target
from pcmc.accuracy.quantities import given_volume
from pcmc.certificate.quantities import figures
from pcmc.design.targets import measure
from pcmc.forces.functional import patch_volumes, volume
from pcmc.forces.volume_below import volume_below, volume_below_gradient, volumes_below
from pcmc.plan import Divider, Plan
from pcmc.surface.geometry import area_vectors
from pcmc.sweep.solving import case_row
from studies.forces.cases import tube

TIGHT = {"tolerance": 1e-13, "min_quality": 0.0}


def leaning_hall():
    """Two patches over a rectangle, at rest; the wall between them leans towards the stronger one."""
    patches = {"west": {"tension": 6.0}, "east": {"tension": 4.0}}
    outline = [[0, 0], [12, 0], [12, 6], [0, 6]]
    plan = Plan(outline, [Divider([[6, 0], [6, 6]], 3.0)], patches=patches, edge_length=1.0)
    return pcmc.solve(plan.surface(), **TIGHT).surface


@pytest.fixture(scope="module")
def hall():
    return leaning_hall()


@pytest.mark.parametrize(
    "make",
    [lambda: two_squares(5, height=1.0), lambda: two_caps(1.0), lambda: four_fans(4), leaning_hall],
    ids=["two squares", "two caps", "four fans", "leaning walls"],
)
def test_volumes_of_patches_add_up_to_the_enclosed_volume(make):
    """That of the cones of the energy: where patches share a curve, the differences cancel."""
    surface = make()
    rng = np.random.default_rng(3)
    surface = surface.moved(
        surface.vertices + 0.02 * rng.standard_normal((surface.n, 3)) * surface.free[:, None]
    )
    each, cones = volumes_below(surface), patch_volumes(surface)
    roof = surface.roof
    assert roof.sum() > 1
    assert each[roof].sum() == pytest.approx(cones[roof].sum(), rel=1e-12)
    assert pcmc.certify(surface).volume == volume_below(surface) == measure(surface, Target("volume")).value


def test_a_patchs_volume_does_not_depend_on_the_point_of_the_plane(hall):
    west = Target("volume", "west")
    there = dataclasses.replace(hall, plane=Plane((50.0, -20.0, 0.0)))
    assert measure(there, west).value == pytest.approx(measure(hall, west).value, rel=1e-12)
    far = hall.rebuilt(vertices=hall.vertices + np.array([1e5, 2e5, 0.0]))
    assert measure(far, west).value == pytest.approx(measure(hall, west).value, rel=1e-9)


def test_half_a_cap_has_half_its_volume():
    """V = π h (3 + h²) / 12 for half of a cap over the unit circle, whatever the rest is; of order 2."""
    errors = []
    for edge_length in (0.4, 0.2, 0.1):
        cap = spherical_cap(edge_length, alpha=1.0, exact=True)
        half = cap.vertices[cap.faces].mean(axis=1)[:, 0] > 0.0
        both = cap.rebuilt(patch_of_face=half.astype(int), patches=[Patch(n, 1.0) for n in ("left", "right")])
        share = volumes_below(both)[1] / volume(cap)
        height = cap.vertices[:, 2].max()
        errors.append([share, volume_below(both) - np.pi * height * (3.0 + height**2) / 6.0])
    shares, total = np.array(errors).T
    assert shares == pytest.approx(0.5, abs=0.05)
    assert np.log2(total[:-1] / total[1:])[-1] == pytest.approx(2.0, abs=0.2)


def test_a_roof_raised_over_the_plane_has_more_volume_by_the_area_of_its_plan():
    """There the cones have only a third of it, and the certificate agrees with the target."""
    low = spherical_cap(0.3, alpha=1.0)
    high = low.rebuilt(vertices=low.vertices + np.array([0.0, 0.0, 7.0]), plane=Plane())
    plan = area_vectors(low.vertices[low.faces])[:, 2].sum()
    expected = volume_below(low) + 7.0 * plan
    assert measure(high, Target("volume")).value == pytest.approx(expected, rel=1e-12)
    assert pcmc.certify(high).volume == pytest.approx(expected, rel=1e-12)
    assert volume(high) < 0.6 * expected


def test_a_room_between_plates_does_not_prescribe_the_volume_over_the_plane():
    """A tube between level plates has none over Π but where it bulges; its room has all that it encloses."""
    enclosed = pcmc.solve(tube(0.4, 2.0), target="stationary").surface
    assert given_volume(enclosed) is None
    assert abs(volume_below(enclosed)) < 0.01 * enclosed.rooms[0].volume
    bubbles = pcmc.solve(double_bubble(0.6, volumes=(1.0, 0.7))).surface
    assert given_volume(bubbles) == pytest.approx(1.7) == volume_below(bubbles)


def test_films_without_pressure_have_the_volume_of_the_target():
    film = catenoid(half=True)
    assert film.auxiliary.all()
    assert film.roof.all()
    assert pcmc.certify(film).volume == measure(film, Target("volume")).value != 0.0


def cap(**changes):
    low = spherical_cap(0.4, alpha=1.0)
    return low.rebuilt(vertices=low.vertices + np.array([0.0, 0.0, 2.0]), **{"plane": Plane(), **changes})


def two_snows():
    """Patches of unequal net pressures, one of them without any, between a raised boundary."""
    patches = {"west": {"tension": 6.0, "snow": 1.0}, "east": {"tension": 6.0, "snow": 0.2}}
    outline = [[0, 0, 3], [6, 0, 3], [6, 4, 3], [0, 4, 3]]
    return Plan(outline, [Divider([[3, 0], [3, 4]], 3.0)], patches=patches, edge_length=1.0).surface()


@pytest.mark.parametrize(
    "make",
    [
        cap,
        lambda: cap(plane=Plane((0, 0, -3), (1, 2, 8))),
        lambda: cap(patches=[Patch("sail", 1.0, 0.0, weight=0.2)]),
        two_snows,
        lambda: catenoid(half=True),
        leaning_hall,
        lambda: double_bubble(0.6, volumes=(1.0, 0.7)),
    ],
    ids=["above", "slanted", "sail", "two snows", "film", "hall", "rooms"],
)
def test_volume_has_one_meaning(make):
    """In the certificate, as a target, among the figures, along branches, and in rows of sweeps."""
    result = pcmc.solve(make(), **TIGHT)
    surface, found = result.surface, result.certificate
    assert found.index is not None
    volume = found.volume
    assert volume == pytest.approx(volume_below(surface), rel=1e-12)
    assert measure(surface, Target("volume")).value == pytest.approx(volume, rel=1e-12)
    shown = [f.value for f in figures(surface, found) if (f.quantity, f.owner) == ("volume", "roof")]
    assert shown == [pytest.approx(volume, rel=1e-12)]
    assert case_row(result, ())["volume"] == pytest.approx(volume, rel=1e-12)
    name, goal = surface.patches[0].name, 1.01 * volume
    if surface.held.any():
        branch = pcmc.follow(surface, name, until={"volume": goal}, steps=3, min_quality=0.0)
        ends = [pcmc.certify(branch.surfaces[k]).volume for k in (0, max(branch.surfaces))]
        assert branch.points.volume.iloc[[0, -1]].tolist() == pytest.approx(ends, rel=1e-9)
        assert ends[0] == pytest.approx(volume, rel=1e-9)


@pytest.mark.parametrize("normal", [(0.0, 0.0, 1.0), (1.0, -2.0, 2.0)])
def test_the_gradient_has_taylor_slope_two(hall, normal):
    surface = hall.rebuilt(plane=Plane((1.0, 2.0, -3.0), normal), fixed=[0], on_plane=())
    factors = np.array([2.0, -1.0, 0.5])
    direction = np.random.default_rng(1).standard_normal(surface.vertices.shape)
    slope = float((volume_below_gradient(surface, factors) * direction).sum())
    start, left = factors @ volumes_below(surface), []
    for t in (1e-2, 1e-3):
        there = factors @ volumes_below(surface.moved(surface.vertices + t * direction))
        left.append(abs(there - start - t * slope))
    assert np.log10(left[0] / left[1]) == pytest.approx(2.0, abs=0.1)


def test_volumes_of_patches_answer_to_tensions_and_pressures_as_solves_do(hall):
    targets = [Target("volume", name) for name in ("west", "east")]
    for parameter in (Parameter("west"), Parameter("east", "pressure")):
        found = pcmc.sensitivities(hall, targets, parameter).to_numpy()[:, 0]
        ends = []
        for step in (1e-4, -1e-4):
            value = parameter.value(hall) + step
            solved = pcmc.solve(changed(hall, parameter, value), **TIGHT).surface
            ends.append(np.array([measure(solved, t).value for t in targets]))
        np.testing.assert_allclose(found, (ends[0] - ends[1]) / 2e-4, rtol=1e-5, atol=1e-5)


def test_a_patch_gets_the_volume_that_is_asked_for(hall):
    design = pcmc.meet(hall, Target("volume", "east", 24.0), "east")
    assert volumes_below(design.surface)[hall.patch_index("east")] == pytest.approx(24.0, rel=1e-7)
