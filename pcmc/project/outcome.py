"""A roof that was opened or designed, with all that other parts of pcmc ask about it, each computed once."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import partial
from pathlib import Path
from typing import Any, NamedTuple, TypeVar, cast

from ..accuracy import AccurateResult, Margin, MeshCheck, check_mesh, margin
from ..base.errors import OptionError, PcmcError
from ..base.units import NO_UNITS, Units
from ..certificate.balance import strained_junction
from ..certificate.certificate import Certificate, certify
from ..certificate.quantities import Figure, figures
from ..certificate.theorem import Theorem, verify
from ..cloth import CuttingOptions, CuttingPattern, cutting_pattern_of
from ..design import Design
from ..drawings import DrawingSet, drawing_set
from ..drawings.sheet import MISSED
from ..io.mesh_data import MeshData
from ..panelling import FewerFamilies, PanelNet, Panels, fewer_families, panel_net, panels
from ..report import RoofReport, roof_report
from ..solvers.result import Progress, Result
from ..structure import Analysis, StructuralModel, analyse
from ..structure.section import Structure
from ..surface import Surface, mirrored
from .file import Project
from .members import members_drawn, model_with_members, warn_of_members
from .settings import Output, of_material

MOST_CHECKED = 20_000  # triangles up to which the mesh is checked by default
EXTENSIVE = ("area", "volume", "length")  # targets of a part that are not those of the whole
OnStep = Callable[[str], object]  # called with a few words at each step of a project
Finding = TypeVar("Finding")


def ignore(step: str) -> None:
    """An ``OnStep`` that shows nothing."""


class WholeRoof(NamedTuple):
    """A surface with its certificate."""

    surface: Surface
    certificate: Certificate


@dataclass(frozen=True, eq=False)
class Outcome:
    """A roof: the designed one of a project, its start shape, or the surface in a file.

    Attributes
    ----------
    result : of the last solve; None for a surface that is shown as it is, which is ``start``.
    files : the files written.
    design : the search for the targets; None without targets.
    accurate : the search for an accuracy; None where the project asks for none.
    units : in which all numbers are.
    cached : whether the roof was solved before and comes from the cache. Then ``accurate`` is None, and the
        histories of ``result`` and ``design`` are empty.
    notes : what was chosen where the project does not say it, and what happened on the way.
    advice : where the roof is not good, what to type, a line each; empty if no remedy is known.
    project : that it belongs to; None for a surface from a program.
    start : the surface as it is; None where there is a result.
    unfold : whether the whole roof is shown that ``surface`` is the part of between its mirror planes.
    data : all that the file of ``start`` holds, such as scalars; None without a file.

    ``certificate``, ``whole``, ``figures``, ``theorem``, ``panels``, ``check_mesh``, ``margin`` and
    ``analysis`` are computed when first asked for, and kept.
    """

    result: Result | None
    files: Sequence[Path] = ()
    design: Design | None = None
    accurate: AccurateResult | None = None
    units: Units = NO_UNITS
    cached: bool = False
    notes: Sequence[str] = ()
    advice: Sequence[str] = ()
    project: Project | None = None
    start: Surface | None = None
    unfold: bool = False
    data: MeshData | None = None
    _known: dict[Any, Any] = field(default_factory=dict, repr=False)  # copies of an outcome share it

    @classmethod
    def of(
        cls, surface: Surface, units: Units, project: Project | None = None, data: MeshData | None = None
    ) -> Outcome:
        """A surface that is shown as it is, such as the start shape of a project."""
        unfold = project is not None and project.output.whole
        return cls(None, units=units, project=project, start=surface, unfold=unfold, data=data)

    def changed(self, change: Callable[[Surface], Surface] | None) -> Outcome:
        """The same with another surface, which has nothing of what the file holds besides the first one."""
        return self if change is None else replace(self, start=change(self.surface), data=None, _known={})

    def __repr__(self) -> str:
        """The verdict, what the targets reached, what was written, and the advice, above the surface."""
        (surface, certificate), design, units = self.shown, self.design, self.units
        lines = [certificate.verdict.value]
        lines += [certificate.cuts_itself if certificate.certified else certificate.detail]
        lines += [f"targets {design.text(units)}"] if design is not None else []
        lines += [f"written: {', '.join(map(str, self.files))}"] if self.files else []
        lines += ["\n  ".join(self.advice), units.sentence if units else "", repr(surface)]
        return "\n".join(filter(None, lines))

    @property
    def solved(self) -> Result:
        """``result`` of a roof that was solved."""
        return cast(Result, self.result)

    @property
    def surface(self) -> Surface:
        """The surface reached, or the one that is shown as it is."""
        return cast(Surface, self.start) if self.result is None else self.result.surface

    @property
    def certificate(self) -> Certificate:
        """The certificate of ``surface``."""
        if self.result is not None:
            return self.result.certificate
        return self._once("certificate", lambda: certify(self.surface))

    @property
    def whole(self) -> WholeRoof | None:
        """The whole roof with its certificate, which counts motions that are not symmetric, too; None unless
        ``unfold``."""

        def unfold() -> WholeRoof:
            whole = mirrored(self.surface)
            return WholeRoof(whole, certify(whole))

        return self._once("whole", unfold) if self.unfold else None

    @property
    def shown(self) -> WholeRoof:
        """What is written, drawn and listed: the whole roof if it is asked for, with its certificate."""
        return self.whole or WholeRoof(self.surface, self.certificate)

    @property
    def figures(self) -> list[Figure]:
        """The key figures of what is shown."""
        return self._once("figures", lambda: figures(*self.shown))

    @property
    def theorem(self) -> Theorem:
        """What ``pcmc.verify`` proves of what is shown."""
        return self._once("theorem", lambda: verify(self.shown.surface))

    @property
    def ending(self) -> tuple[str, str]:
        """How the solver ended, and the verdict's detail; without the hint for a strained junction that the
        advice takes the place of."""
        message, detail = self.solved.message, self.certificate.detail
        if self.advice and (strained := strained_junction(self.surface)) is not None:
            message, detail = (text.replace(strained.hint, "") for text in (message, detail))
        return message, detail

    @property
    def remarks(self) -> list[str]:
        """The notes, and whose the targets are where the whole is shown."""
        part = "targets of areas, volumes and lengths are those of the part between the mirror planes"
        return [*self.notes, *([part] if self._of_the_part else [])]

    @property
    def _of_the_part(self) -> list[str]:
        """The labels of targets that are not those of the whole, where that is shown."""
        targets = self.project.targets if self.unfold and self.project is not None else ()
        return [target.label for target in targets if target.quantity in EXTENSIVE]

    @property
    def mark(self) -> str:
        """What files, pictures and documents are marked with; empty where all is in order, and where
        nothing is known, as of a surface that another program wrote."""
        if self.result is None:
            return str(self.data.certificate.get("mark", "")) if self.data else ""
        return self.shown.certificate.mark or ("" if self.design is None or self.design.met else MISSED)

    @property
    def certified(self) -> bool:
        """Whether the surface, and the whole if that is asked for, is certified."""
        return self.certificate.certified and (self.whole is None or self.whole.certificate.certified)

    @property
    def good(self) -> bool:
        """Whether the surface is certified, every target is met, and every accuracy reached."""
        met = self.design is None or self.design.met
        return self.certified and met and (self.accurate is None or self.accurate.reached)

    @property
    def name(self) -> str:
        """The name of its file, without suffix."""
        return "" if self.project is None else self.project.path.stem

    @property
    def output(self) -> Output:
        """What the project writes, and how its documents are made."""
        return Output() if self.project is None else self.project.output

    def _once(self, key: Any, compute: Callable[[], Finding]) -> Finding:
        key = (self.unfold, key)
        if key not in self._known:
            self._known[key] = compute()
        return cast(Finding, self._known[key])

    def panels(
        self, tolerance: float, *, mirror_images: str = "alike", walls: bool = False, anyway: bool = False
    ) -> Panels:
        """The schedule of the panels of what is shown; see ``pcmc.panels``."""
        surface, certificate = self.shown
        how: dict[str, Any] = {"mirror_images": mirror_images, "walls": walls}
        sort = partial(panels, surface, tolerance, **how, anyway=anyway, certificate=certificate)
        return self._once(("panels", tolerance, *how.values()), sort)

    def fewer_families(self, tolerance: float, change: float, **options: Any) -> FewerFamilies:
        """What is shown with fewer families of panels; see ``pcmc.fewer_families``."""
        return fewer_families(self.shown.surface, tolerance, change, **options)

    def panel_net(self, size: float, pattern: str, direction: float, anyway: bool = False) -> PanelNet:
        """Quads or hexagons on what is shown; see ``pcmc.panel_net``."""
        surface, certificate = self.shown
        return panel_net(surface, size, pattern, direction=direction, anyway=anyway, certificate=certificate)

    def drawing_set(self, output: Output, *, anyway: bool = False, **options: Any) -> DrawingSet:
        """The drawings of what is shown, as ``output`` says; ``options`` as of ``pcmc.drawing_set``."""
        warn_of_members(self, "drawings", held=True)
        options |= {"sheet": output.sheet, "panel_sheets": output.panel_sheets}
        options |= {"members": members_drawn(self), "mark": self.mark}
        return drawing_set(self.shown.surface, self.units, **self._about(output, anyway), **options)

    def report(self, output: Output, *, files: Mapping[str, str], anyway: bool = False) -> RoofReport:
        """The report on what is shown, with the mesh check if it was made."""
        about, project = self._about(output, anyway), self.project
        about |= {"mesh_check": self.mesh_check, "mesh_failure": self.mesh_failure, "margins": self.margins}
        about |= {"files": files, "date": output.date, "figures": self.figures}
        if self.design is not None:
            names = {label: f"{label} (of the part)" for label in self._of_the_part}
            about["targets"] = self.design.targets.rename(names)
        if project is not None and project.verify:
            about["theorem"] = self.theorem
        if project is not None and project.pattern is not None:
            about["pattern"] = self.cutting_pattern(project.pattern, anyway)
        if (analysis := self.analysis(anyway)) is None:
            warn_of_members(self, "report", held=True)
            about["model"] = model_with_members(self)
        return roof_report(self.shown.surface, self.units, **about, analysis=analysis)

    def _about(self, output: Output, anyway: bool) -> dict[str, Any]:
        tolerance, certificate = output.tolerance, self.shown.certificate
        about = {"name": self.name, "tolerance": tolerance, "certificate": certificate, "anyway": anyway}
        return about | ({} if tolerance is None else {"schedule": self.panels(tolerance, anyway=anyway)})

    def model(self, structure: Structure, anyway: bool = False) -> StructuralModel:
        """The structural model of what is shown."""
        plan = None if self.project is None else self.project.plan
        surface, certificate = self.shown
        if self.unfold:
            structure = structure.of_whole(self.surface, surface, plan)
        model = structure.model(surface, plan, anyway=anyway, certificate=certificate, units=self.units)
        if self.unfold and (model.bars or any(not line.wall for line in model.lines)):
            text = "a member at an edge or a point is known for the part of the plan alone, not for its"
            text += " images; draw the whole plan, without mirrors, or leave out whole"
            raise OptionError(text, what="whole")
        return model

    def cutting_pattern(self, wanted: CuttingOptions, anyway: bool = False) -> CuttingPattern:
        """The cutting pattern of what is shown, of the cloth in [structure]; made once for [pattern]."""
        surface, certificate = self.shown
        project, cloth = self.project, wanted
        structure = None if project is None else project.structure
        if self.unfold:
            cloth = wanted.of_whole(self.surface, surface)
            structure = structure and structure.of_whole(self.surface, surface, None)
        cloth = of_material(cloth, structure, surface)
        cut = partial(cutting_pattern_of, surface, cloth, anyway, certificate)
        own = project is not None and wanted is project.pattern
        return self._once("cutting pattern", cut) if own else cut()

    def analysis(self, anyway: bool = False, progress: OnStep | None = None) -> Analysis | None:
        """What is shown under load, found once by CalculiX; None where the project does not run it."""
        structure = None if self.project is None else self.project.structure
        if structure is None or not structure.run:
            return None

        return self._once("analysis", lambda: analyse(self.model(structure, anyway), progress=progress))

    @property
    def under_load(self) -> Analysis | None:
        """The analysis, if it was made."""
        return cast("Analysis | None", self._known.get((self.unfold, "analysis")))

    @property
    def mesh_check(self) -> MeshCheck | None:
        """The mesh check, if it was made; see ``check_mesh``."""
        return cast("MeshCheck | None", self._known.get((self.unfold, "mesh check")))

    @property
    def mesh_failure(self) -> str:
        """Why a mesh check that was asked for failed; empty if it did not."""
        return str(self._known.get((self.unfold, "mesh failure"), ""))

    def mesh_check_wanted(self, wanted: bool | None = None) -> bool | None:
        """Whether the mesh is to be checked, as ``wanted`` or the project says; None where neither does."""
        return self.project.mesh_check if wanted is None and self.project is not None else wanted

    def wants_mesh_check(self, wanted: bool | None = None) -> bool:
        """The same, with a default: surfaces of up to 20 000 triangles. Only surfaces at rest are checked."""
        asked = self.mesh_check_wanted(wanted)
        small = self.shown.surface.m <= MOST_CHECKED
        return self.certificate.index is not None and (small if asked is None else asked)

    def check_mesh(self, progress: OnStep | None = None, meshes: int | None = None) -> MeshCheck | None:
        """The mesh check of what is shown, made once, by default on three ``meshes``; None where it fails,
        see ``mesh_failure``. With a number of ``meshes`` an error is raised."""

        def check() -> MeshCheck | None:
            found = None if self.unfold else self.accurate
            if found is not None and found.check is not None and found.surface is self.surface and not meshes:
                return found.check
            given = self.result if self.result is not None and not self.unfold else self.shown.surface
            try:
                return check_mesh(given, meshes or 3, callback=_reporter("mesh check", progress))
            except PcmcError as error:  # the roof is good without it
                if meshes is not None:
                    raise
                self._known[self.unfold, "mesh failure"] = str(error)
                return None

        return self._once("mesh check", check)

    def advise(self, look: Callable[[], str]) -> str:
        """What ``look`` finds to type, once; the mesh check has it as its advice from then on."""

        def found() -> str:
            if advice := look():
                check = cast("MeshCheck", self.mesh_check)
                self._known[self.unfold, "mesh check"] = replace(check, advice=advice)
            return advice

        return self._once("advice", found)

    def margin(self, what: str, progress: OnStep | None = None) -> Margin:
        """How far what is shown is from the edge, found once; see ``pcmc.margin``, also for the errors."""
        surface, certificate = self.shown
        callback = _reporter(f"margin of {what}", progress)
        find = partial(margin, surface, what, callback=callback, certificate=certificate)
        return self._once(("margin", what), find)

    @property
    def margins(self) -> list[Margin]:
        """The margins that were found, in the order in which they were asked for."""
        return [m for (unfold, key), m in self._known.items() if unfold == self.unfold and key[0] == "margin"]


def _reporter(what: str, progress: OnStep | None) -> Callable[[Progress], None]:
    def callback(state: Progress) -> None:
        if progress is not None:
            progress(f"{what}: {state.surface().m} triangles, step {state.iteration}")

    return callback
