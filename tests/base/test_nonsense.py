"""Values of a wrong kind in Python: each is refused in one line, by pcmc and not by a library."""

from __future__ import annotations

from functools import partial
from pathlib import Path

import numpy as np
import pytest

import pcmc
from pcmc.base.errors import PcmcError
from pcmc.plan import CableLine, Divider, Hole, PatchSpec, Plan

ROUGH, NAN, HUGE = [[1, 2], [3]], float("nan"), 10**400
TABLE = np.full((3, 3), NAN)
ONCE = iter(())  # the next to read it finds nothing
GRADED = Path(__file__).resolve().parents[2] / "results" / "accuracy" / "graded.pcmc"
OUTLINE = [[0, 0], [4, 0], [4, 3], [0, 3]]
plan = partial(Plan, OUTLINE, tension=2.0)
FILM = pcmc.Surface(
    [[0, 0, 0], [1, 0, 0], [0, 1, 0], [1, 1, 0]],
    [[0, 1, 2], [1, 3, 2]],
    [0, 0],
    [pcmc.Patch("film", 1.0)],
    [0],
)


def film(**given):
    """The film with another value of one of its arrays."""
    return pcmc.Surface(
        **{"vertices": FILM.vertices, "faces": FILM.faces, "patch_of_face": [0, 0], "patches": FILM.patches}
        | {"fixed": [0]}
        | given
    )


CASES = [
    *((lambda key, v: plan(**{key: v}), (key, v)) for key in ("dividers", "holes") for v in (NAN, None, 1j)),
    *((lambda key, v: plan(**{key: v}), (key, True)) for key in ("supports", "cables", "mirrors")),
    *((lambda v: Plan(OUTLINE, patches=v), (v,)) for v in (NAN, ROUGH, b"x")),
    *((lambda key, v: plan(**{key: v}), (key, ONCE)) for key in ("dividers", "holes", "cables", "supports")),
    *((lambda v: plan(rooms=v), (v,)) for v in (NAN, ROUGH, TABLE)),
    *((lambda v: plan([Divider([[2, 0], [2, 3]], name=v)]), (v,)) for v in (TABLE, ROUGH)),
    (lambda v: plan([Divider([[2, 0], [2, 3]], wall=v)]), (TABLE,)),
    (lambda v: plan(holes=[Hole([[1, 1], [2, 1], [2, 2]], name=v)]), (TABLE,)),
    (lambda v: plan(holes=[Hole([[1, 1], [2, 1], [2, 2]], cable=v)]), (TABLE,)),
    *((lambda v: plan(cables=[CableLine([[0, 0], [4, 0]], 5.0, v)]), (v,)) for v in (TABLE, ROUGH)),
    (lambda v: PatchSpec("roof", 1.0, at=v), (HUGE,)),
    *((lambda v: pcmc.Room("hall", v, 1.0), (v,)) for v in (NAN, None, True, b"x")),
    *((lambda v: pcmc.Cable("rim", 1.0, v), (v,)) for v in (NAN, 1e30)),
    *((lambda v: pcmc.Wind({"roof": 1.0}, area=v), (v,)) for v in (HUGE, ROUGH)),
    (lambda v: pcmc.Snow(1.0, slides=v), (TABLE,)),
    *((lambda v: pcmc.Target(v, value=1.0), (v,)) for v in ([], {}, TABLE)),
    (lambda v: pcmc.Target("apex", v, 1.0), (TABLE,)),
    *(
        (lambda key, v: film(**{key: v}), (key, v))
        for key in ("faces", "patch_of_face", "fixed", "on_plane", "images")
        for v in (NAN, 1e30)
    ),
    *((lambda v: film(images=v), (v,)) for v in (ROUGH, np.array(5))),
    *((lambda v: film(order=v), (v,)) for v in (TABLE, ROUGH)),
    *((lambda v: pcmc.cutting_pattern(FILM, seams=v, anyway=True), (v,)) for v in (NAN, None, True, ONCE)),
    (lambda v: pcmc.cutting_pattern(FILM, width=1.0, seams=v, anyway=True), (ONCE,)),
    (lambda v: pcmc.cutting_pattern(FILM, strips=1, compensation=v, anyway=True), (ROUGH,)),
    (lambda v: pcmc.cutting_pattern(FILM, strips=1, poisson=v, anyway=True), (TABLE,)),
    *((lambda v: pcmc.panels(FILM, 0.1, anyway=True, certificate=v), (v,)) for v in (NAN, "", {})),
    *(
        (lambda v: pcmc.StructuralModel(FILM, pcmc.Material(1.0), 1e-3, members=v, anyway=True), (v,))
        for v in (NAN, None, True)
    ),
    *((lambda v: pcmc.find_equilibria(FILM, v), (v,)) for v in (NAN, None, True)),
    (lambda v: pcmc.check_mesh(FILM, corners=v), (ROUGH,)),
    *((lambda v: pcmc.certify(FILM, clear=v), (v,)) for v in (5, "x", NAN)),
    *((lambda v: pcmc.margin(FILM, "pressure", callback=v), (v,)) for v in (5, "x", NAN)),
    *((lambda v: pcmc.margin(FILM, "pressure", certificate=v), (v,)) for v in (5, "x", NAN)),
    *((lambda v: pcmc.fewer_families(FILM, 0.1, 0.1, anyway=True, callback=v), (v,)) for v in (5, NAN)),
    *((lambda v: pcmc.read(GRADED, plane=v), (v,)) for v in (5, "x", NAN)),
    *((lambda v: pcmc.write("film.obj", FILM, mark=v), (v,)) for v in (5, "a\nv 1 2 3")),
]


@pytest.mark.parametrize(("make", "given"), CASES)
def test_a_value_of_a_wrong_kind_is_refused_in_one_line(make, given):
    with pytest.raises(PcmcError) as caught:
        make(*given)
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize("frozen", [True, False])
def test_arrays_that_are_given_are_left_as_they_are(frozen):
    X = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [1, 1, 0]])
    arrays = {"vertices": X, "faces": FILM.faces.copy(), "fixed": np.array([2, 0])}
    before = {name: array.copy() for name, array in arrays.items()}
    for array in arrays.values():
        array.flags.writeable = not frozen
    pcmc.certify(film(**arrays))
    for name, array in arrays.items():
        np.testing.assert_array_equal(array, before[name])
        assert array.flags.writeable is not frozen
