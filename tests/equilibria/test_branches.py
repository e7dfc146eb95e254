"""Branches of equilibria: bifurcations, folds and ends, and the sentence about each."""

import re
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pandas as pd
import pytest
import volume_cases
from programs import needs_evolver
from shapes import cap

from generators import (
    cylinder,
    spherical_cap,
    two_squares,
)
from generators.grid import grid_faces
from pcmc import BoundaryMotion, Cable, Direction, Patch, Plane, Room, Surface, find_equilibria, solve
from pcmc.equilibria import branches, search
from pcmc.solvers.continuation import Branch, Ending
from studies.reference import evolver


@needs_evolver
def test_two_unduloids_leave_the_cylinder_of_length_2_pi():
    """The index of the cylinder rises where L = 2πR; both lean back over shorter cylinders."""
    edge, length = 2.0 * np.pi / 14, 6.0
    tube = cylinder(edge, length=length, exact=True)
    tube = solve(tube.moved(tube.vertices - [0.0, 0.0, 0.5 * length]), target="stationary").surface
    x, y, z = tube.vertices[tube.fixed].T
    longer = BoundaryMotion(lambda L: np.stack([x, y, 0.5 * np.sign(z) * L], axis=1), start=length)
    found = find_equilibria(tube, longer, starts=0, span=(5.8, 6.6))
    assert [one.index for one in found.found] == [1, 2, 2]
    assert found[2].energy == pytest.approx(found[3].energy, rel=1e-6)
    cylinders, one, other = found.branches["boundary"]
    assert cylinders.bifurcations.parameter.iloc[0] == pytest.approx(2.0 * np.pi, rel=0.01)
    assert one.points.parameter[0] == other.points.parameter[0] == cylinders.bifurcations.parameter.iloc[0]
    assert [evolver.inertia(one.surface).negative for one in found.found] == [1, 2, 2]


def test_two_unduloids_leave_a_tube_of_prescribed_volume():
    """A quarter of a tube between mirror planes at 0 and 3: below the radius 3/π it is a saddle.

    Half a period of the unduloid of volume 3π has the area 18.862749, by its equation, and the tube 6π.
    """
    length, number = 3.0, np.arange(13 * 7).reshape(13, 7)
    along, around = np.meshgrid(np.linspace(0.0, length, 13), np.linspace(0.0, np.pi / 2, 7), indexing="ij")
    X = np.stack([np.cos(around), np.sin(around), along], axis=-1).reshape(-1, 3).round(15)
    sides = {(1, 0, 0): number[:, -1], (0, 1, 0): number[:, 0], (0, 0, 1): number[0], (0, 0, -1): number[-1]}
    planes = [(Plane(X[on[0]], normal, mirror=True), on) for normal, on in sides.items()]
    room = Room("inside", {"tube": 1}, np.pi * length / 4.0)
    faces = grid_faces(12, 6)[:, ::-1]
    tube = Surface(X, faces, np.zeros(144, int), [Patch("tube", 1.0)], on_planes=planes, rooms=[room])
    found = find_equilibria(solve(tube, target="stationary"), "volume", starts=0)
    assert [one.index for one in found.found] == [0, 1, 1]
    assert found[2].energy == pytest.approx(found[3].energy, rel=1e-12)
    assert 4.0 * found.barrier(1) == pytest.approx(18.862749 - 6.0 * np.pi, rel=0.1)
    critical = found.branches["volume"][0].bifurcations.parameter
    assert critical.tolist() == pytest.approx([(length / np.pi) ** 2], rel=0.01)


def test_each_of_two_bifurcations_of_nearly_one_shape_is_followed():
    """Quarters of two tubes that do not touch, one a little longer: each is left by two unduloids."""
    lengths, number = (3.0, 3.05), np.arange(9 * 4).reshape(9, 4)
    rows, planes = list[np.ndarray](), {}
    for first, bottom, length in ((0, 0.0, lengths[0]), (36, 10.0, lengths[1])):
        around, along = np.linspace(0.0, np.pi / 2, 4), np.linspace(bottom, bottom + length, 9)
        around, along = np.meshgrid(around, along)
        rows.append(np.stack([np.cos(around), np.sin(around), along], axis=-1).reshape(-1, 3).round(15))
        for side, on in (((1, 0, 0), number[:, -1]), ((0, 1, 0), number[:, 0])):
            planes.setdefault(Plane((0, 0, 0), side, mirror=True), []).extend(first + on)
        for on in (number[0], number[-1]):
            planes[Plane((0, 0, rows[-1][on[0], 2]), (0, 0, 1))] = first + on
    faces = grid_faces(8, 3)[:, ::-1]
    rooms = [Room(f"in {k}", {f"tube {k}": 1}, np.pi * length / 4.0) for k, length in enumerate(lengths)]
    patches, patch = [Patch(f"tube {k}", 1.0) for k in (0, 1)], np.repeat([0, 1], len(faces))
    tubes = Surface(np.vstack(rows), [*faces, *(faces + 36)], patch, patches, on_planes=planes, rooms=rooms)
    found = find_equilibria(solve(tubes, target="stationary"), "volume", starts=0, depth=1, span=(0.9, 1.02))
    first, *others = found.branches["volume"]
    critical = first.bifurcations.parameter
    assert critical.tolist() == pytest.approx([(length / np.pi) ** 2 for length in lengths], rel=0.02)
    assert sorted(other.points.parameter[0] for other in others) == sorted([*critical, *critical])
    assert [one.index for one in found.found] == [0, 1, 1, 1, 1]


def test_a_crossing_without_an_equilibrium_is_named(monkeypatch):
    resume = Branch.resume

    def lost(branch, row, stop, **options):
        return replace(resume(branch, row, stop, **options), ending=Ending.LOST, detail="too steep")

    monkeypatch.setattr(Branch, "resume", lost)
    found = find_equilibria(spherical_cap(0.5), starts=0)
    assert len(found) == 1
    lines = [line for line in str(found).splitlines() if line.startswith("A branch passes pressure 1, but")]
    assert len(lines) == 1
    assert "not reached: the branch could not be followed further" in lines[0]
    assert "(too steep)" in lines[0]

    def higher(branch, row, stop):
        way = resume(branch, row, stop)
        return replace(way, surfaces={0: way.last.moved(way.last.vertices * [1.0, 1.0, 1.01])})

    monkeypatch.setattr(Branch, "resume", higher)
    found = find_equilibria(spherical_cap(0.5), starts=0)
    assert "A branch passes pressure 1, but its equilibrium there cannot be certified." in str(found)


def test_a_crossing_between_a_bifurcation_and_a_fold_has_no_point_to_start_from():
    points = pd.DataFrame({"arclength": [0.0, 0.1], "parameter": [1.2, 1.3], "slope": [0.0, 1.0]})
    folds = pd.DataFrame({"arclength": [0.05], "parameter": [0.9]})
    way = SimpleNamespace(ending=Ending.REACHED, last="a surface")
    branch = SimpleNamespace(points=points, folds=folds, resume=lambda row, value: way)
    line = branches.TracedParameter("pressure", Direction({"cap": 1.0}), 1.0, (0.5, 1.5))
    (one, beside), other = line.crossings(branch)
    assert one == "no regular point of the branch is beside it"
    assert beside == "1.2 and was first met at 0.9"
    assert other == ("a surface", "")


def test_a_branch_that_ends_within_the_span_is_named(monkeypatch):
    """Of an edge cable of chord 2 on a film of tension 1 the arcs end at the half circle, of tension 1."""
    X = np.array([[x, y, 0.0] for x in np.linspace(-1.0, 1.0, 9) for y in np.linspace(0.0, 3.0, 13)])
    rim, edge = (np.abs(X[:, 0]) == 1.0) | (X[:, 1] == 3.0), Cable.along("edge", 1.5, np.arange(0, 117, 13))
    film = Surface(X, grid_faces(8, 12), [0] * 192, [Patch("film", 1.0, 0.0)], fixed=rim, cables=[edge])
    (line,) = find_equilibria(film, Direction(cables={"edge": 1.0}), starts=0).failed
    assert line.startswith("A branch ended at parameter 1.0")
    assert "as triangles collapse; what lies beyond on it is not known" in line
    monkeypatch.setattr(branches, "STEPS", 2)
    found = find_equilibria(spherical_cap(0.5), starts=0)
    (line,) = found.failed  # branches that ended alike have one sentence, here and on the page
    assert re.fullmatch(r"2 branches ended at pressure 0\.8\d*, 1\.\d+ after 2 steps; .* on them .*", line)
    assert line in found.text()


def test_why_no_branch_starts_at_an_equilibrium_is_said():
    tube = volume_cases.cylinder(0.7, 2.0, "plates")
    (line,) = find_equilibria(tube, "volume", starts=0).failed
    assert line.startswith("No branch in volume starts at the equilibrium from the start given: follow: ")
    assert "nothing holds the surface against 2 rigid motions" in line


@pytest.mark.nightly
def test_a_way_back_past_a_bifurcation_to_a_known_shape_is_named():
    """The index rises at 1.05, but on this mesh walls lean below 0.95 only; at 1 they are upright."""
    found = find_equilibria(two_squares(8, alpha_aux=2.1), "tension of wall", starts=0, depth=1)
    assert [one.index for one in found.found] == [0]
    assert "A branch left at tension of wall 1.05 and was first met at 0.9456; the way from there" in str(
        found
    )


def test_where_contact_hides_a_change_of_index_the_branch_is_followed_in_shorter_steps(monkeypatch):
    """Only a change of index on the step of a change of contact asks for that."""
    steps = []

    def follow(surface, parameter, *, largest, **options):
        steps.append(largest)
        at = [0.3, 0.3] if largest > 0.01 else [0.3, 0.31]
        events = pd.DataFrame({"kind": ["index", "contact"], "arclength": at})
        return SimpleNamespace(events=events, ending=Ending.STEPS)

    monkeypatch.setattr(branches, "follow", follow)
    cap = spherical_cap(0.5)
    line = branches.TracedParameter.of(cap, "pressure", None)
    assert line._half(cap, 1.0, lambda _: None).events.arclength.tolist() == [0.3, 0.31]
    assert steps == list(branches.LARGEST)


def test_without_a_span_a_branch_goes_half_of_the_present_value_each_way():
    cap = spherical_cap(0.5, alpha=2.5)
    assert branches.TracedParameter.of(cap, Direction({"cap": 1.0}), None).span == (1.25, 3.75)


def test_the_line_may_be_a_direction_and_the_boundary():
    cap = spherical_cap(0.25)
    found = find_equilibria(cap, [Direction(pressures={"cap": 1.0})], starts=0)
    assert [one.index for one in found.found] == [0, 1]
    ring = cap.vertices[cap.fixed]
    wider = BoundaryMotion(lambda radius: ring * [radius, radius, 1.0], start=1.0)
    found = find_equilibria(cap, wider, starts=0)
    assert [one.index for one in found.found] == [0, 1]
    assert found.branches["boundary"][0].folds.parameter[0] == pytest.approx(1.2, abs=0.05)


def test_each_equilibrium_is_followed_in_each_parameter(monkeypatch):
    """Two caps that do not touch: small or large each, so four equilibria."""
    monkeypatch.setattr(search._Search, "descend", lambda *_: None)
    one, other = cap(2, 0.52), cap(2, 0.5)
    patches, aside = [Patch("left", 0.52), Patch("right", 0.5)], [3.0, 0.0, 0.0]
    X, F = np.concatenate([one.vertices, other.vertices + aside]), [*one.faces, *(other.faces + one.n)]
    caps = Surface(X, F, np.repeat([0, 1], one.m), patches, fixed=np.tile(one.fixed, 2))
    loads = [Direction(pressures={patch.name: 1.0}) for patch in patches]
    found = find_equilibria(caps, loads, starts=0, span=(0.9, 1.2))
    assert [one.index for one in found.found] == [0, 1, 1, 2]
    assert {name: len(branches) for name, branches in found.branches.items()} == {
        "parameter 1": 2,
        "parameter 2": 2,
    }
