"""No answer hangs on a tolerance: each is halved and doubled; bounds of rounding get a tenth, ten times.

Compiled loops keep NO_AREA and NO_DIRECTION as they were; there only what runs around them sees the change.
"""

import importlib
import pkgutil
import sys

import numpy as np
import pytest
from nightly import night_but

import pcmc
from generators import bezier_hall, double_bubble, hypar_roof, spherical_cap, two_caps, two_squares
from pcmc import Line, Patch, Plane, Surface, certify, solve
from pcmc.base import tolerances

BOUNDS_OF_ROUNDING = (
    *("ON", "ON_CURVE", "SAME_PLACE", "RESTING", "RESTING_ROUNDED", "NO_AREA", "PARALLEL", "EXCESS"),
    *("SAME_PRESSURE", "NO_CHANGE", "FORCE_ROUNDING", "DIFFERENCE_ROUNDING", "ROUNDED_REST", "ROOM_VOLUME"),
    *("SAME_EIGENVALUE", "GOAL_ACCURACY", "ON_BRANCH", "AT_REST"),
)
NAMES = sorted(name for name in vars(tolerances) if name.isupper() and name != "EPS")
ENGINE = ("surface", "forces", "meshing", "stability", "certificate", "solvers", "existence", "continuation")


def slider():
    """A roof on rails: its sides slide along lines, its ends are held."""
    x, y = np.meshgrid(np.linspace(0.0, 3.0, 7), np.linspace(0.0, 2.0, 5), indexing="ij")
    X = np.stack([x.ravel(), y.ravel(), 0.3 * np.sin(np.pi * x.ravel() / 3.0)], axis=1)
    X[:, 2] *= (X[:, 1] > 0.0) & (X[:, 1] < 2.0)
    number = np.arange(35).reshape(7, 5)
    a, b, c, d = number[:-1, :-1], number[1:, :-1], number[1:, 1:], number[:-1, 1:]
    faces = np.concatenate([np.stack(t, axis=-1).reshape(-1, 3) for t in ((a, b, c), (a, c, d))])
    ends = np.isin(x.ravel(), (0.0, 3.0))
    rails = {Line((0, k, 0), (1, 0, 0)): (y.ravel() == k) & ~ends for k in (0.0, 2.0)}
    patches = [Patch("roof", 2.0, 1.0)]
    return Surface(X, faces, [0] * len(faces), patches, fixed=ends, on_line=rails, plane=Plane())


CASES = {
    "cap": lambda: spherical_cap(0.35),
    "upper cap": lambda: spherical_cap(0.25, upper=True, exact=True),
    "no cap": lambda: spherical_cap(0.35, alpha=0.4),
    "two caps": lambda: two_caps(1.2),
    "bubbles that nothing holds": lambda: double_bubble(0.6, volumes=(1.0, 1.0)),
    "hall": lambda: bezier_hall(12.0),
    "a wall that pinches": lambda: two_squares(4, alpha=2.0, alpha_aux=6.0),
    "slider": slider,
    "sail": lambda: hypar_roof(6, weight=0.05),
}


def answer(case):
    found = solve(CASES[case](), target="stationary" if case == "upper cap" else "minimum")
    certificate = certify(found.surface, tolerance=tolerances.AT_REST)
    return found.status.name, certificate.verdict.name, certificate.index, len(certificate.pinched)


@pytest.fixture(scope="module")
def answers():
    for module in pkgutil.walk_packages(pcmc.__path__, "pcmc."):
        if module.name.split(".")[1] in ENGINE:
            importlib.import_module(module.name)
    return {case: answer(case) for case in CASES}


@pytest.mark.parametrize("name", night_but(NAMES, "NEUTRAL"))
def test_status_verdict_and_index_stay(answers, monkeypatch, name):
    value, changed = getattr(tolerances, name), {}
    loaded = [module for key, module in sys.modules.items() if key.startswith("pcmc")]
    for factor in (0.1, 10.0) if name in BOUNDS_OF_ROUNDING else (0.5, 2.0):
        for module in loaded:
            if vars(module).get(name) == value:
                monkeypatch.setattr(module, name, factor * value)
        changed |= {(case, factor): now for case in CASES if (now := answer(case)) != answers[case]}
        monkeypatch.undo()
    assert not changed


def test_the_change_reaches_the_engine(answers, monkeypatch):
    for module in [module for key, module in sys.modules.items() if key.startswith("pcmc")]:
        if "COLLAPSED" in vars(module):
            monkeypatch.setattr(module, "COLLAPSED", 2.0)
    assert answers["cap"][1] == "STABLE"
    assert answer("cap")[1] == "DEGENERATE"
