"""The answer of a structural model: each case and combination analysed as far as it is carried, in tables."""

from __future__ import annotations

import os
from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import product, takewhile
from typing import Any

import numpy as np
import pandas as pd

from ..base.arrays import Floats
from ..base.units import Units
from ..certificate.supports import FORCE
from ..surface.geometry import face_areas
from ..surface.pieces import point_text
from .calculix import CalculixError, expect_program, run_as_far
from .columns import column_table, column_text
from .gas import balanced_pressure
from .loads import FORM, Step, nothing
from .member_forces import (
    MemberForces,
    cable_notes,
    cable_offers,
    member_tables,
    members_in,
    sentences,
    slack_cables,
    supports_with_members,
    weak_members,
)
from .model import StructuralModel, expect_model
from .results import StepResults

THROUGH = 1e-3  # of the size: a roof that has sunk farther below Π hangs through
STILL = 1e-9  # of the largest displacement: a smaller deflection is rounding
STRONGER = 1.1  # the first factor tried on a prestress that is too small, over what the share asks for
FARTHER = 1.35  # each further factor over the one before
TRIES = 4
COLUMNS = ["case", "share", "taut", "down", "up", "moved", *"xyz", "least_force", "largest_force"]
COLUMNS += ["least_x", "least_y", "least_z", "slack_area", "slack_share", *FORCE, "pressure", "volume"]
MESH = "beyond the first slack part a share depends on the mesh; the share before that hardly does"
UNCLEAR = ": a roof wrinkles before it gives way, so this may be the program's convergence, not the roof"
OnCase = Callable[[str], object]  # called with a few words before each case


@dataclass(frozen=True, eq=False)
class Case:
    """A case or combination of loads, as far as the roof carries it.

    Attributes
    ----------
    name : of the step.
    results : at the share of the load that was reached.
    share : of the loads besides the form-finding load and self-weight; 1 if all is carried, 0 where
        self-weight is not: then the results are those of the share of self-weight.
    pressure, volume : of the enclosed gas, NaN without one.
    """

    name: str
    results: StepResults
    share: float
    pressure: float = np.nan
    volume: float = np.nan

    @property
    def carried(self) -> bool:
        """Whether all of the load is carried."""
        return self.share >= 1.0

    @cached_property
    def members(self) -> tuple[MemberForces, ...]:
        """What the beams carry."""
        return members_in(self.results.model, self.results.step, self.results)

    @property
    def taut(self) -> float:
        """The share of its loads up to which no part of the membrane is slack."""
        return min(self.results.taut, self.share)


@dataclass(frozen=True, eq=False)
class Analysis:
    """What a roof does under each case and combination; see ``analyse``. ``print`` shows the main numbers.

    Attributes
    ----------
    cases : the form-finding load first, then the loads and combinations.
    remedy : a factor on all tensions and pressures, tried: with it the same shape carries all cases; 0 where
        none of those tried is enough, None where none was tried.
    """

    model: StructuralModel
    cases: tuple[Case, ...]
    remedy: float | None = None

    @property
    def carried(self) -> bool:
        """Whether each case is carried as a whole."""
        return all(case.carried for case in self.cases)

    def __getitem__(self, name: str) -> Case:
        """The case of a name."""
        return next(case for case in self.cases if case.name == name)

    @cached_property
    def table(self) -> pd.DataFrame:
        """A row per case and combination.

        Columns: ``case``; ``share`` of its loads that is reached; ``taut``, the share up to which nothing is
        slack; ``down`` and ``up``, the largest deflections along Π's normal; ``moved``, the largest
        displacement, at ``x``, ``y``, ``z``; ``least_force`` and ``largest_force`` of the principal membrane
        forces, force/length, the least at ``least_x``, …; ``slack_area``, where one of them is not above 0,
        and ``slack_share``, that over the area; ``force_x``, …, the sum of all reactions. With a gas
        ``pressure`` and ``volume``.
        """
        rows, surface, areas = list[list[object]](), self.model.surface, self._areas
        for case in self.cases:
            found, forces = case.results, case.results.principal_forces
            size, up = np.linalg.norm(found.displacements, axis=1), found.deflections
            far, slack = int(np.nanargmax(size)), areas[found.slack].sum()
            place = surface.vertices[surface.faces[self.slackest(case)]].mean(axis=0)
            ways = (way if way > STILL * size[far] else 0.0 for way in (-np.nanmin(up), np.nanmax(up)))
            row = [case.name, case.share, case.taut, *ways, size[far], *surface.vertices[far]]
            row += [np.nanmin(forces), np.nanmax(forces), *place, slack, slack / areas.sum()]
            rows.append([*row, *found.reactions.sum(axis=0), case.pressure, case.volume])
        table = pd.DataFrame(rows, columns=COLUMNS)
        return table if self.model.gas is not None else table.drop(columns=["pressure", "volume"])

    @cached_property
    def patches(self) -> pd.DataFrame:
        """A row per case and patch: ``least_force``, ``mean_force`` and ``largest_force`` of the principal
        membrane forces, force/length, and ``slack_area``."""
        rows, patch_of = list[list[object]](), self.model.surface.patch_of_face
        for case, (k, patch) in product(self.cases, enumerate(self.model.surface.patches)):
            forces = case.results.principal_forces
            mine = (patch_of == k) & np.isfinite(forces).all(axis=1)
            if mine.any():
                area, own = self._areas[mine], forces[mine]
                mean, slack = area @ own.mean(axis=1) / area.sum(), area[case.results.slack[mine]].sum()
                rows.append([case.name, patch.name, own.min(), mean, own.max(), slack])
        head = ["case", "patch", "least_force", "mean_force", "largest_force", "slack_area"]
        return pd.DataFrame(rows, columns=head)

    @cached_property
    def supports(self) -> pd.DataFrame:
        """A row per case and support, numbered as in ``Certificate.supports``: ``support``, ``name``,
        ``kind``, ``length``, ``x``, ``y``, ``z`` of its middle, and ``force_x``, …, which it exerts. M1, M2,
        … hold the ends of members; see ``supports_with_members``."""
        tables = [supports_with_members(case.results) for case in self.cases]
        for case, table in zip(self.cases, tables, strict=True):
            table.insert(0, "case", case.name)
        return pd.concat(tables, ignore_index=True)

    @cached_property
    def cables(self) -> pd.DataFrame:
        """A row per case and cable: the ``least`` and ``largest`` tension along it, force; below 0 it is
        slack, and counts as a strut."""
        pulls = [(case.name, *pull) for case in self.cases for pull in case.results.cable_tensions.items()]
        rows = [[case, cable, along.min(), along.max()] for case, cable, along in pulls]
        return pd.DataFrame(rows, columns=["case", "cable", "least", "largest"])

    @property
    def members(self) -> pd.DataFrame:
        """A row per case and beam; see ``member_tables``."""
        return member_tables((case.name, case.members) for case in self.cases)[0]

    @property
    def member_forces(self) -> pd.DataFrame:
        """A row per case and point of a beam; see ``member_tables``."""
        return member_tables((case.name, case.members) for case in self.cases)[1]

    @cached_property
    def columns(self) -> pd.DataFrame:
        """A row per case and column or stay; see ``column_table``."""
        return column_table(self.model, [(case.name, case.results.reactions) for case in self.cases])

    @property
    def tables(self) -> dict[str, pd.DataFrame]:
        """All tables by name; those of cables, members and columns only if there are any."""
        tables = {"cases": self.table, "patches": self.patches, "supports": self.supports}
        tables |= {"cables": self.cables, "members": self.members, "member-forces": self.member_forces}
        return {name: table for name, table in (tables | {"columns": self.columns}).items() if len(table)}

    def slackest(self, case: Case) -> int:
        """The triangle whose least principal force is the smallest."""
        return int(np.nanargmin(case.results.principal_forces[:, 0]))

    def sunk(self, case: Case) -> float:
        """How far a roof that stood above Π has come below it, length; 0 if it has not."""
        surface, moved = self.model.surface, np.nan_to_num(case.results.displacements)
        before, after = (surface.plane.height(surface.vertices + by) for by in (0.0, moved))
        above = before > THROUGH * surface.size
        depth = -float(after[above].min(initial=np.inf))
        return depth if depth > THROUGH * surface.size else 0.0

    def answers(self, units: Units | None = None) -> list[str]:
        """A sentence for each case that is not carried, or has slack parts, and what helps; for each cable
        that gets slack; what cables are made of, where they have no material of their own."""
        units, lines, surface = units or self.model.units, [], self.model.surface
        for case, row in zip(self.cases, self.table.to_dict("records"), strict=True):
            at, slack = np.array([row[f"least_{c}"] for c in "xyz"]), row["slack_area"] > 0.0
            patch = surface.patches[surface.patch_of_face[self.slackest(case)]].name
            state = f"slack from {100.0 * case.taut:.0f} % on, over {row['slack_area']:.3g}"
            state = f"{state}{units.behind('area')}" if slack else "nothing is slack yet"
            state += f", the least force {row['least_force']:.3g}{units.behind('tension')}"
            state += f" around {point_text(at, surface.size)} of {patch!r}"
            share = f"{100.0 * case.share:.0f} % of its loads" if case.share else "not its self-weight"
            if not case.carried:
                ended = "it gives way" if slack else "CalculiX finds no equilibrium"
                lines.append(f"{case.name}: {share} carried, then {ended}; {state}{UNCLEAR * (not slack)}")
            elif slack:
                lines.append(f"{case.name}: carried, but {state}: there it wrinkles")
            if (depth := self.sunk(case)) > 0.0:
                below = f"it hangs up to {depth:.3g}{units.behind('length')} below the plane"
                lines.append(f"{case.name}: {below}, as a bag that gathers water")
        lines += [*slack_cables(self.cables, units), *cable_notes(self.model)]
        lines += weak_members(self.model, ((case.name, case.members) for case in self.cases), units)
        if any(case.taut < case.share < 1.0 for case in self.cases):
            lines.append(MESH)
        if self.remedy:
            text = f"tried: with tensions, cables and pressures {self.remedy:.3g} times as large"
            lines.append(f"{text} the same shape carries all cases")
        elif self.remedy is not None:
            lines.append("tried: larger tensions and pressures in the same ratio; they are not enough")
        elif not self.carried:
            lines.append("what may help: larger tensions and pressures, or less load (not tried)")
        return lines

    def __str__(self) -> str:
        return f"{self.model.units.sentence}\n{self.text()}" if self.model.units else self.text()

    def text(self) -> str:
        """The main columns of the table, and the answers, without the units of the numbers."""
        model, units = self.model, self.model.units
        heads = {"least_force": "least force", "largest_force": "largest", "slack_area": "slack area"}
        shown = ["case", "share", "taut", "down", "up", *heads, "pressure"]
        table = self.table.filter(shown).rename(columns=heads)
        for name in ("share", "taut"):
            table[name] = [f"{100.0 * share:.0f} %" for share in table[name]]
        look: dict[str, Any] = {"index": False, "float_format": "{:.4g}".format, "na_rep": "-"}
        parts = [one.to_string(**look) for one in (table, self.members) if len(one)]
        parts += [*sentences(model, units), *cable_offers(model)]
        parts += [column_text(model, self.columns, units)] if model.bars else []
        return "\n".join([*parts, *self.answers()])

    @cached_property
    def _areas(self) -> Floats:
        surface = self.model.surface
        return face_areas(surface.vertices[surface.faces])


def analyse(
    model: StructuralModel,
    *,
    timeout: float | None = None,
    remedy: bool = True,
    progress: OnCase | None = None,
) -> Analysis:
    """Run CalculiX on a structural model: each case and combination on its own, as far as it is carried.

    A case starts from the form-finding load and self-weight. Its loads grow until all of them act, or no
    equilibrium is found: membranes whose prestress is used up carry nothing across. With an enclosed gas its
    pressure is found, too.

    Parameters
    ----------
    timeout : seconds for each run of the program; by default none.
    remedy : where a case is not carried, try the same shape with larger tensions and pressures.
    progress : called with a few words before each case.

    Raises
    ------
    CalculixError : the program is not installed, took too long, or finds the form not at rest.

    >>> from pcmc import Material, Patch, Snow, Surface
    >>> corners = [[1, 1, 0], [-1, 1, 0], [-1, -1, 0], [1, -1, 0], [0, 0, 0.125**0.5]]
    >>> roof = Surface(corners, [[0, 1, 4], [1, 2, 4], [2, 3, 4], [3, 0, 4]], [0] * 4,
    ...                [Patch("roof", 1.0)], fixed=range(4))
    >>> model = StructuralModel(roof, Material(young=1e6), thickness=0.001, loads=[Snow(0.5)])
    >>> print(analyse(model).table[["case", "share"]])  # doctest: +SKIP
                case  share
    0  form pressure    1.0
    1           snow    1.0
    """
    expect_model(model)
    expect_program()
    say = progress or (lambda words: None)
    permanent, others = _permanent(model)
    steps = [model.steps[0], *permanent]
    if model.gas is not None:  # whose pressure follows the volume under self-weight, too
        steps, others = steps[:1], [*permanent, *others]
    start = run_as_far(model, steps, timeout)
    cases = [_case_of(model, step.name, start[:k], k) for k, step in enumerate(steps, 1)]
    # as many cases at a time as there are cores
    with ThreadPoolExecutor(max_workers=max(1, min(len(others), os.cpu_count() or 1))) as pool:
        running = [pool.submit(analyse_step, model, permanent, step, timeout) for step in others]
        try:
            for k, (step, future) in enumerate(zip(others, running, strict=True), 1):
                say(f"{step.name}, case {k} of {len(others)}")
                cases.append(future.result())
        finally:  # after Ctrl-C or an error no other case begins
            pool.shutdown(wait=False, cancel_futures=True)
    analysis = Analysis(model, tuple(cases))
    if analysis.carried or not remedy or model.surface.heavy:  # with weights the form would be another one
        return analysis
    return replace(analysis, remedy=_remedy(analysis, timeout, say))


def analyse_step(
    model: StructuralModel, permanent: Sequence[Step], step: Step, timeout: float | None = None
) -> Case:
    """One case, after the form-finding load and the ``permanent`` steps; with the gas in balance."""
    form, gas = model.steps[0], model.gas
    before = list(takewhile(lambda other: other is not step, permanent))
    if gas is None:
        return _case_of(model, step.name, run_as_far(model, [form, *before, step], timeout), len(before) + 2)
    standing, outside = model.standing, gas.outside(model.units)
    first, volume = gas.pressure(standing), gas.enclosed(standing)
    factor = model.combinations.get(step.name, {}).get(FORM, 1.0)
    filled = factor * first
    if factor != 1.0:  # the roof moves while it is filled
        more = nothing(form).plus(form, nothing(form), factor)
        filling = _case_of(model, step.name, run_as_far(model, [form, more], timeout), 2, filled)
        if not filling.carried:
            return filling
        volume = filling.volume
    wanted = [(other, first) for other in before] + [(step, filled)]
    signs = gas.signs(standing)[standing.patch_of_face]

    def law(pressure: float) -> tuple[Case, float | None]:
        acting = [replace(one, pressures=one.pressures + (pressure - own) * signs) for one, own in wanted]
        found = run_as_far(model, [form, *acting], timeout)
        case = _case_of(model, step.name, found, len(acting) + 1, pressure)
        enclosed = case.carried and case.volume > 0.0
        return case, (outside + filled) * volume / case.volume - outside if enclosed else None

    case, _, agreed = balanced_pressure(first, law, outside)
    if case.carried and not agreed:
        text = f"{step.name}: the pressure of the gas does not settle, at {case.pressure:.4g} at last"
        raise CalculixError(f"{text}; is Gas.ambient in the model's units?", what="gas", where=step.name)
    return case


def _permanent(model: StructuralModel) -> tuple[list[Step], list[Step]]:
    """The steps of self-weight alone, which stay, and the others, combinations among them."""
    form, *others = model.steps
    same = [(o.forces == form.forces).all() and (o.pressures == form.pressures).all() for o in others]
    alone = [o for o, as_form in zip(others[: len(model.loads)], same, strict=False) if o.gravity and as_form]
    return alone, [step for step in others if step not in alone]


def _case_of(
    model: StructuralModel, name: str, found: Sequence[StepResults], wanted: int, p: float | None = None
) -> Case:
    """The case from the results of its steps: of the last one that was begun; ``p`` of a gas, by default the
    form's."""
    gas, form = model.gas, model.standing
    case = Case(name, found[-1], found[-1].share if len(found) == wanted else 0.0)
    if gas is None:
        return case
    volume = gas.enclosed(form, np.nan_to_num(found[-1].displacements))
    return replace(case, pressure=gas.pressure(form) if p is None else p, volume=volume)


def _remedy(analysis: Analysis, timeout: float | None, say: OnCase) -> float:
    """A factor on tensions and pressures with which what was not carried is; 0 if none of some is enough."""
    model, names = analysis.model, [case.name for case in analysis.cases if not case.carried]
    factor = STRONGER / max(min(case.share for case in analysis.cases), 0.1)
    for _ in range(TRIES):
        factor = float(f"{factor:.2g}")
        say(f"trying {factor:g} times the prestress")
        stronger = prestressed(model, factor)
        permanent, others = _permanent(stronger)
        failed = [step for step in others if step.name in names]
        cases = [analyse_step(stronger, permanent, step, timeout) for step in failed]
        if all(case.carried for case in cases):
            return factor
        factor *= FARTHER
    return 0.0


def prestressed(model: StructuralModel, factor: float) -> StructuralModel:
    """The same shape with all tensions and pressures ``factor`` times as large: it is at rest as before."""
    s = model.surface
    stronger = s.retensioned(
        {patch.name: factor * patch.tension for patch in s.patches},
        {patch.name: factor * (patch.pressure - patch.snow) + patch.snow for patch in s.patches},
        [patch.name for patch in s.patches if patch.wall],
        cables={cable.name: factor * cable.tension for cable in s.cables},
    )
    return replace(model, surface=stronger, anyway=True, certificate=None)
