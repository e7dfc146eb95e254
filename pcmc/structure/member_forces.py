"""What members carry: the forces along them, at rest and in each case, from the pull of the sheets."""

from __future__ import annotations

import re
from collections.abc import Iterable
from dataclasses import dataclass, replace

import numpy as np
import pandas as pd
from scipy.linalg import orth
from scipy.spatial.distance import pdist

from ..base.arrays import Floats, Ints, kept_with_owner
from ..base.units import Units
from ..certificate.forces import Forces, cable_ends
from ..certificate.supports import FORCE, support_table, support_vertices
from ..forces.cables import directions, pull_along
from ..forces.pinching import standing_part
from ..surface.geometry import end_tangent, lengths_along, segment_lengths, vertex_sums
from .frames import BarFrame, balancing_force, corner_forces, turns
from .loads import Step
from .members import PlacedMember
from .model import StructuralModel
from .results import StepResults

COLUMNS = ("s", *"xyz", "N", "V", "V_across", "T", "M", "M_across", "pull", "pull_unbent", "moved")
ROUNDING = 1e-12  # of the largest force in a member: less of another is none
ALIKE = 1e-6  # sine of the angle of two directions that are one
LIMIT = 300.0  # the span over this is the deflection that members are asked to keep
STRAIGHT = 0.01  # share of a member's pull that bends it: below it needs no other line
MOST = 0.7  # share of it: above it no cable balances even a half of its square, and none is offered
LOOSE = 1e-3  # of the largest tension of a cable: a smaller thrust is rounding
HELPED = 0.2  # share of a member's pull: above it the sheets carry in place of one that is too weak alone


@dataclass(frozen=True, eq=False)
class MemberForces:
    """What a beam carries along its line, and how far it moves."""

    line: PlacedMember
    points: Floats  # (k,3) of the form
    within: Floats  # (r,6) N, V, V across, T, M, M across; see ``FrameForces.within``
    at: Ints  # (r,) the points of its line's path at which these are
    displacements: Floats  # (k,3)
    pulls: Floats  # (k,3) forces of the sheets and loads on it
    buckling: float  # the factor on N along it at which it buckles alone; see ``BarFrame.buckling``

    @property
    def span(self) -> float:
        """The distance of its ends, or of the two points farthest apart if it is closed."""
        return float(pdist(self.points if self.line.closed else self.points[[0, -1]]).max())

    @property
    def deflection(self) -> float:
        """The largest displacement of its points."""
        return float(np.linalg.norm(self.displacements, axis=1).max())

    @property
    def largest(self) -> dict[str, float]:
        """The extremes along it: ``least_N`` and ``largest_N``, and the largest shear force ``V`` and moment
        ``M``, in whichever direction; 0 for what is rounding beside the others."""
        N, (V, M) = self.within[:, 0], (np.linalg.norm(self.within[:, k], axis=1) for k in ([1, 2], [4, 5]))
        found, arms = np.array([N.min(), N.max(), V.max(), M.max()]), np.array([1.0, 1.0, 1.0, self.span])
        found[np.abs(found / arms) <= ROUNDING * np.abs(found / arms).max()] = 0.0
        return dict(zip(("least_N", "largest_N", "V", "M"), found.tolist(), strict=True))

    @property
    def balance(self) -> tuple[float, float]:
        """The one force N along it that balances its pulls best, and the share of these that is left."""
        return balancing_force(self.points, self.pulls, self.line.closed)

    @property
    def wall_tensions(self) -> Floats:
        """(k,2) force/length: the pull of the sheets, which a wall balances by its tension; and what it
        would balance, free along a line that does not bend: N κ, N of ``balance``. NaN at ends."""
        P, size = self.points, np.linalg.norm(self.pulls, axis=1)
        edges = np.linalg.norm(np.diff(P, axis=0, append=P[:1]), axis=1)
        across = (turns(P, self.line.closed) * self.pulls).sum(axis=1) / np.where(size > 0.0, size, 1.0)
        found = np.stack([size, -self.balance[0] * across], axis=1)
        found /= (0.5 * (edges + np.roll(edges, 1)))[:, None]
        if not self.line.closed:
            found[[0, -1]] = np.nan
        return found

    @property
    def enough(self) -> float:
        """The factor on E A and E I with which the deflection is a 300th of the span; linear, without the
        help of the sheets."""
        return self.deflection / (self.span / LIMIT)


@kept_with_owner
def members_at_rest(model: StructuralModel) -> tuple[MemberForces, ...]:
    """The beams of a model under the pull of the sheets at rest, with the displacements of beams alone."""
    return members_in(model, model.steps[0])


def members_in(
    model: StructuralModel, step: Step, results: StepResults | None = None
) -> tuple[MemberForces, ...]:
    """The beams at the end of a step of the analysis, in the shape that the roof has in its ``results``."""
    if not model.beams:
        return ()
    X, forces = model.standing.vertices, forces_on_members(model, step, results)
    moved = np.zeros_like(X) if results is None else np.nan_to_num(results.displacements)
    frame, vertices = frame_of(model, X + moved)
    # the motion along a bar, where it is now, is more than its elongation if it turns: the rest has no force
    (along, length), pairs = (frame.axes[0][:, 0], frame.axes[1]), vertices[frame.bars]
    turned = np.einsum("bi,bi->b", along, moved[pairs[:, 1]] - moved[pairs[:, 0]]) - length
    longer = (turned + segment_lengths(X, pairs)) / length
    solved = frame.solved(forces[vertices] / np.bincount(vertices)[vertices, None], longer)
    if results is None:
        moved[vertices] = solved.displacements
    found, first = list[MemberForces](), 0
    for line in model.beams:
        v, bars, N = line.vertices, first + np.arange(len(line.pairs)), np.zeros(len(frame.bars))
        N[bars] = 0.5 * (solved.ends[bars, 6] - solved.ends[bars, 0])
        within = solved.within(bars, line.closed)
        found.append(MemberForces(line, X[v], *within, moved[v], forces[v], frame.buckling(N)))
        first += len(bars)
    return tuple(found)


def forces_on_members(model: StructuralModel, step: Step, found: StepResults | None = None) -> Floats:
    """(n,3) the forces of sheets, cables and loads on the vertices under a step: on members what they carry,
    nothing at other vertices that no support holds. Without ``found``, its answer, the form is at rest."""
    s = model.standing
    X, faces, patch = s.vertices, s.faces[model.active], s.patch_of_face[model.active]
    thickness, tensors, pulls = model.thicknesses[patch], model.stresses, dict[str, Floats]()
    if found is not None:
        X = X + np.nan_to_num(found.displacements)
        thickness, tensors = found.thicknesses[model.faces], found.stresses[model.faces]
        pulls = dict(found.cable_tensions)
    forces = model.nodal_loads(step, X - s.vertices)
    forces += vertex_sums(corner_forces(X[faces], thickness[:, None, None] * tensors), faces, s.n)
    for cable in s.cables:
        pull = pulls[cable.name] if pulls else pull_along(s, cable, cable.edges)
        along = pull[:, None] * directions(X, cable.edges)[0]
        np.add.at(forces, cable.edges, np.stack([along, -along], axis=1))
    return forces


def frame_of(model: StructuralModel, X: Floats) -> tuple[BarFrame, Ints]:
    """The beams of a model as a frame at X (n,3), and the vertices (k,) that its points are, some of them
    several times: see ``StructuralModel.member_nodes``."""
    nodes, places = model.member_nodes
    used = np.unique(np.concatenate(places))
    vertices, pairs = nodes[used], [np.stack([of[:-1], of[1:]], axis=1) for of in places]
    stiffness = list[list[float]]()
    for line in model.beams:
        E, profile = line.member.material.young, line.member.profile
        shear = profile.torsion / (2.0 + 2.0 * line.member.material.poisson)
        stiffness.append([E * value for value in (profile.area, *profile.moments, shear)])
    of_bars = np.repeat(np.array(stiffness), list(map(len, pairs)), axis=0)
    rows, turns = list[Floats](), held_turns(model, X)
    for k in np.flatnonzero(model.held[vertices]).tolist():
        v = vertices[k]
        stopped = (slice(0, 3), slice(1, 3), slice(0, 1))[model.freedom[v]]
        for kind, held in enumerate((model.axes[v][stopped], turns.get(int(used[k]), ()))):
            for direction in held:
                row = np.zeros((len(vertices), 2, 3))  # the displacement and the turn of each
                row[k, kind] = direction
                rows.append(row.ravel())
    holds = np.array(rows).reshape(-1, 6 * len(vertices))
    normal = np.array(model.surface.plane.normal)
    return BarFrame(
        X[vertices], np.searchsorted(used, np.concatenate(pairs)), of_bars, holds, normal
    ), vertices


def held_turns(model: StructuralModel, X: Floats) -> dict[int, Floats]:
    """By the ``member_nodes`` at held ends of beams, the turns (k,3) that are held there, as unit vectors at
    right angles: the twist of hinged ends on X (n,3) if they are fixed, all of clamped ones."""
    given = dict[int, list[Floats]]()
    for line, places in zip(model.beams, model.member_nodes[1], strict=True):
        t, length = directions(X, line.pairs)
        for end, two in ((0, slice(2)), (-1, slice(None, -3, -1))):
            v = line.vertices[end]
            clamped = line.member.ends == "clamped"
            if not line.closed and model.held[v] and (clamped or model.freedom[v] == 0):
                turns = np.eye(3) if clamped else end_tangent(t[two], length[two])[None]
                given.setdefault(int(places[end]), []).extend(turns)
    return {node: orth(np.array(held).T, ALIKE).T for node, held in given.items()}


def supports_with_members(results: StepResults) -> pd.DataFrame:
    """The table of supports in a case, as in ``Certificate.supports``, with a row of the kind
    "member end" for each point that holds ends of members: all of the force there but that of cables. The
    rows of lines in whose place members are, such as the foot of a wall, are left out."""
    model, reactions, names = results.model, results.reactions, dict[int, list[str]]()
    standing, alone = standing_part(model.surface).surface, reactions.copy()
    moved = standing.vertices + np.nan_to_num(results.displacements)
    cables = cable_ends(standing, moved, results.cable_tensions)
    for line in model.lines:
        for v in [] if line.closed else line.vertices[[0, -1]].tolist():
            if model.held[v]:
                names.setdefault(v, []).append(line.name)
    ends = sorted(names)
    alone[ends] = 0.0
    for _, v, force in cables:
        alone[v] += force * (v in names)
    acting = Forces.of(standing, alone, at_ends=cables)
    table = support_table(acting)[["support", "name", "kind", "length", *"xyz", *FORCE]]
    beside = model.held.copy()
    beside[ends] = False
    there = np.array([beside[on].any() for on in support_vertices(acting).values()], dtype=bool)
    table = table[there | table[[*FORCE]].any(axis=1) | (not model.lines)].reset_index(drop=True)
    for k, v in enumerate(ends, 1):
        numbers = 0.0, *standing.vertices[v], *(reactions - alone)[v]
        table.loc[len(table)] = [f"M{k}", " + ".join(names[v]), "member end", *numbers]
    return table


def member_tables(cases: Iterable[tuple[str, tuple[MemberForces, ...]]]) -> tuple[pd.DataFrame, pd.DataFrame]:
    """A row per case and beam: ``least_N`` and ``largest_N``, tension above 0; the largest shear force ``V``
    and moment ``M``, in whichever direction; the largest displacement ``moved``, and ``span_over``, the span
    over it; ``buckling``, the factor on N at which it buckles, held by no sheets, else NaN. And a row per
    case and place of each, as of ``FrameForces.within``: ``s`` along it, ``x``, ``y``, ``z``, ``N``, …,
    ``moved``; ``pull`` and ``pull_unbent``, force/length, as of ``MemberForces.wall_tensions``."""
    rows, along = list[dict[str, object]](), [pd.DataFrame()]
    for case, beam in ((case, beam) for case, beams in cases for beam in beams):
        about, moved = {"case": case, "member": beam.line.name}, np.linalg.norm(beam.displacements, axis=1)
        over = beam.span / moved.max() if moved.any() else np.inf
        rows.append({**about, **beam.largest, "moved": beam.deflection, "span_over": over})
        rows[-1]["buckling"] = beam.buckling if beam.buckling < np.inf else np.nan
        at, s = beam.at % len(beam.points), lengths_along(beam.line.path)[beam.at, None]
        columns = [s, beam.points[at], beam.within, beam.wall_tensions[at], moved[at, None]]
        along.append(pd.DataFrame(about | dict(zip(COLUMNS, np.hstack(columns).T, strict=True))))
    return pd.DataFrame(rows), pd.concat(along[1:] or along, ignore_index=True)


def sentences(model: StructuralModel, units: Units) -> list[str]:
    """For each beam in a line: what it carries at rest, how stiff it must be, and what would not bend. Equal
    beams share a line."""
    told, force, length = dict[str, list[str]](), units.behind("force"), units.behind("length")
    moment = f"{force}·{units.length}" if units else ""
    for beam in members_at_rest(model):
        (N, share), most = beam.balance, beam.largest
        M, far = most["M"], max(most["least_N"], most["largest_N"], key=abs)
        about = f"at rest N = {far:.3g}{force}, M up to {M:.3g}{moment}"
        about += f", M/N = {M / abs(far):.2g}{length}" if far else ""
        stiff = f"{beam.enough:.3g} times its E A and E I keep the deflection below 1/{LIMIT:.0f} of the span"
        if not beam.line.member.profile.shape:
            about += f"; its torsion constant is taken as {beam.line.member.profile.torsion:.3g}{length}"
            about += "⁴" * bool(length) + ", an ellipse's: an open section's is hundreds of times smaller"
        about += f"; {floating(model, beam, units) or f'{stiff} (the member alone)'}"
        about += f"; alone it buckles at {beam.buckling:.3g} times this" if beam.buckling < np.inf else ""
        if beam.line.wall:
            about += f"; N = {N:.3g}{force} all along would leave {100.0 * share:.0f} % of the sheets' pull"
            low, high = np.nanmin(beam.wall_tensions[:, 1]), np.nanmax(beam.wall_tensions[:, 1])
            about += f"; without bending a wall would pull with {low:.3g} to {high:.3g}"
            about += units.behind("tension") + "; N is a thrust, which no cable has" * (N <= 0.0)
        told.setdefault(about, []).append(beam.line.name)
    return [f"{', '.join(names)}: {about}" for about, names in told.items()]


def floating(model: StructuralModel, beam: MemberForces, units: Units) -> str:
    """Why no stiffness helps a ring that nothing but the sheets holds along Π's normal; empty for others."""
    line, v, up = beam.line, beam.line.vertices, np.array(model.surface.plane.normal)
    pull = abs(float(beam.pulls.sum(axis=0) @ up))
    alone = line.closed and not line.wall and not line.member.propped and not model.held[v].any()
    alone = alone and sum(np.isin(v, other.vertices).any() for other in model.beams) == 1
    if not alone or pull <= STRAIGHT * np.linalg.norm(beam.pulls, axis=1).sum():
        return ""
    text = f"nothing but the sheets holds {line.name} upright, and at rest they pull it up or down with"
    return f"{text} {pull:.3g}{units.behind('force')}: add propped = true to it, for columns or a wall below"


def slack_cables(table: pd.DataFrame, units: Units) -> list[str]:
    """A line for each cable that is pressed in cases, of the table ``Analysis.cables``."""
    lines = list[str]()
    for name, own in table.groupby("cable", sort=False):
        pressed = own[1:][own["least"][1:] < -LOOSE * own["largest"].max()]
        if len(pressed):
            text = f"{', '.join(pressed['case'])}: {name} is slack, but counts as a strut, pressed with"
            text += f" {-pressed['least'].min():.3g}{units.behind('force')}: without it the roof moves more"
            lines.append(f"{text}; give it a larger tension")
    return lines


def cable_notes(model: StructuralModel) -> list[str]:
    """That cables are as soft as the cloth, where they have the material of a patch; and that they do not
    bend, where their member is a beam."""
    own = [cable.name for cable in model.surface.cables]
    bent = ", ".join(f'"{one.on}"' for one in model.members if one.kind == "beam" and one.on in own)
    lines = [f"the members on the cables {bent} count as their sections: cables do not bend"] if bent else []
    patches = [replace(material, weft=None, shear=None) for material in model.materials]
    soft = {cable.name: of.young for cable, _, of, *_ in model.cable_edges() if of in patches}
    if not soft:
        return lines
    names = ", ".join(f'"{name}"' for name in soft)
    text = f"cables have the material of the patches, E = {next(iter(soft.values())):.4g}"
    text += f'{model.units.behind("pressure")}; in a project a member of kind = "cable" with on = [{names}]'
    return [*lines, f"{text} gives them their own"]


def cable_offers(model: StructuralModel) -> list[str]:
    """The lines of a project with which a cable takes the place of a wall whose member bends, and finds the
    shape that does not; none for a thrust, and for a divider with several walls."""
    lines, beams = list[str](), members_at_rest(model)
    for beam in beams:
        (N, share), on = beam.balance, str(beam.line.member.on)
        alone = sum(other.line.member is beam.line.member for other in beams) == 1
        if beam.line.wall and alone and N > 0.0 and STRAIGHT < share < MOST:
            text = f"{on}: with these lines of its divider a cable finds the shape that does not bend:"
            lines += [text, "wall = false", f"cable = {N:.4g}"]
            lines += [f'name = "{on}"'] if re.fullmatch(r"wall \d+", on) else []
    return lines


def weak_members(
    model: StructuralModel, cases: Iterable[tuple[str, tuple[MemberForces, ...]]], units: Units
) -> list[str]:
    """A line for each beam that buckles in its worst case if no sheets hold it; and for each that moves by
    more than a 300th of its span, or would without the sheets, which carry a good part in its place; with the
    stiffness that it would need to carry all alone."""
    lines, listed = list[str](), list(cases)
    for k, rest in enumerate(members_at_rest(model)):
        own = [(name, beams[k]) for name, beams in listed]
        case, worst = min(own, key=lambda one: one[1].buckling)
        if worst.buckling < 1.0:
            text = f"{case}: {rest.line.name} buckles at {100.0 * worst.buckling:.2g} % of its thrust, if no"
            text += f" sheets hold it; {1.0 / worst.buckling:.2g} times its E I carries it alone, without any"
            lines.append(f"{text} safety")
        if unheld := floating(model, rest, units):
            lines.append(unheld)
            continue
        case, worst = max(own, key=lambda one: one[1].deflection)
        inner = slice(None) if rest.line.closed else slice(1, -1)
        pulls = [np.linalg.norm(beam.pulls[inner], axis=1).sum() for beam in (own[0][1], rest)]
        share = max(0.0, 1.0 - pulls[0] / pulls[1])
        if worst.enough > 1.0 or (rest.enough > 1.0 and share > HELPED):
            text = f"{rest.line.name} is too weak: under {case} it moves {worst.deflection:.3g}"
            text += f"{units.behind('length')}, span/{worst.span / worst.deflection:.0f}, and at rest the"
            text += f" sheets carry {100.0 * share:.0f} % of what it should; without them it would need"
            lines.append(f"{text} {max(rest.enough, worst.enough):.3g} times its E A and E I")
    return lines
