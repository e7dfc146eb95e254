"""The comparison with the paper as files: two tables and ``REPORT.md``."""

from __future__ import annotations

import math
import textwrap
from pathlib import Path

import pandas as pd

from .folder import Folder, write_bytes
from .paper import CONDITIONAL, HOLDS, NEAR, NOT, OWN, REPRODUCED, compare, paper, read_measured
from .questions import bench
from .report_tables import (
    bench_table,
    comparison_cells,
    figure_cells,
    jump_table,
    solver_table,
    speed_table,
    table,
)
from .words import fill, listed

HEADS = {
    "sentence": ["What the paper says", "Where", "Holds if", "Ours", "Verdict"],
    "number": ["What the paper prints", "Where", "Paper", "Ours", "Difference", "Verdict"],
}
FIGURES = ["Figure", "What it shows", "Label", "Claims that hold", "Why not fully"]

WIDTH = 110  # columns of a line of text

HEADER = """\
# The paper beside this package

<!-- `python -m studies reproduce` writes this file: do not edit it. -->

{headline}

Each thing that the paper's text says or prints about a figure is a claim, compared with what we measure.
`studies/paper.toml` lists all claims with their tolerances; `studies/paper.py` holds these rules:

- **reproduced**: every claim about the figure holds.
- **conditionally reproduced**: a claim holds only under the condition given beside it (another reading of
  the paper, or another mesh), or a number that depends on an unpublished mesh is near, or part of what
  the figure shows is not in the text.
- **not reproduced**: a claim fails.

A number is **near** within {near_example2.initial_gradient_squared:.0%} for ‖∇E‖² of an initial shape,
{near_example2.initial_curvature_small:.0%} for its mean curvature, {near_example4.best_iteration:.0%} for
Example 4's best iteration, and {near_example4.best_largest_error:.0%} for its errors and ‖∇E‖² on the
way. The paper's inputs and our additions do not count for a label. We did not compare the pictures
themselves."""

CHOSEN = """\
A number that is "chosen so" is no test of the method: of many meshes, or of a run's iterations, we took
one on which it holds."""

GIVEN = """\
The studies use {used} of the {inputs} inputs that the paper prints (tensions, lengths, steps) as
printed{rest}. They are constants of the studies, and no results."""

THRESHOLDS = """\
"(ours)" marks a threshold that we chose to stand for the paper's words: in {paper:.0f} of the paper's
{papers:.0f} statements, and in {own:.0f} of our {owns:.0f} additions."""

SOLVERS = """\
The study `solvers` runs each method from the same start on the paper's {solvers.examples} examples, on
{solvers.meshes} meshes each, from coarse to fine. It uses the paper's tensions, except for a wall of
{solvers.wall_of_example1} in Example 1, where {example1.alpha_aux_histories} is a saddle on fine meshes.
Residuals and errors are relative. With `target="stationary"` the geometric solver comes to rest in
{solvers.at_rest_newton} of {solvers.runs_newton} runs, {solvers.saddles_newton} of them on saddles; with the
default, `target="minimum"`, in {solvers.at_rest_newton_minimum} of {solvers.runs_newton_minimum},
{solvers.saddles_newton_minimum} on saddles. These are {saddles}: there `"minimum"` looks for a minimum, finds
none, and returns the saddle under that name. The worst triangle of its runs has quality
{solvers.worst_quality_newton_minimum:.2g}."""

CORNERS = """\
The study `corners` solves the examples on meshes that get finer only near the ends of their junctions, from
level to level. The energy should change less at each level. `corners/jumps.csv` has, for each example and
support, the largest step that is larger than the one before it, and what shows its cause.

In Example 1 vertices come to lie elsewhere along the same shape: where the solver fails on a level, that
level is solved anew from the initial shape, and where triangles get thin, the solver spreads their vertices.
The energy of flat triangles depends on where they lie. With a wall of 1 and held bottoms the energy steps by
{corners.example1-1_held_jump_step:.2g} at level {corners.example1-1_held_jump_level}, after a step of
{corners.example1-1_held_jump_step_before:.2g}. That level is solved anew, and the junction comes down on its
bottom; vertices are up to {corners.example1-1_held_jump_slid:.2g} from where they were. With every triangle
of both meshes cut into four the step is {corners.example1-1_held_jump_step_halved:.2g}. A step to another
equilibrium would stay; the mesh's error gets four times smaller, and on this mesh it is
{corners.example1-1_held_jump_mesh_error:.2g}. Cutting makes each of Example 1's steps smaller, {least} to
{most} times.

Example 3 and Fig. 4 are otherwise: no level is solved anew, and vertices move by
{corners.example3_sliding_jump_slid:.2g} and {corners.fig4_sliding_jump_slid:.2g}. There the outline is a
circle. Finer meshes put new vertices on it: the surface gets larger, which raises the energy, and its
triangles get smaller, which lowers it. On one level these two nearly cancel, so the next step is larger: with
sliding bottoms
{corners.example3_sliding_jump_step_before:.2g} and then {corners.example3_sliding_jump_step:.2g} in Example
3, {corners.fig4_sliding_jump_step_before:.2g} and then {corners.fig4_sliding_jump_step:.2g} in Fig. 4. If the
outline stays the polygon of the first mesh, only the triangles change. Then the same two steps are
{corners.example3_sliding_jump_polygon_step_before:.2g} and {corners.example3_sliding_jump_polygon_step:.2g},
and {corners.fig4_sliding_jump_polygon_step_before:.2g} and {corners.fig4_sliding_jump_polygon_step:.2g}."""


ACCURACY = """\
The study `accuracy` compares {accuracy.bars} error bars on uniform and on adaptive meshes. {worse} The table
`accuracy/savings.csv` also estimates how many triangles one would save if each had an equal share of the
error. This is no bound: {accuracy.above_estimate} of the {accuracy.bars_on_mesh} savings for a value on the
mesh exceed it, by up to {above:.0%}."""

CHECK = """\
The study `mesh_check` checks {mesh_check.quantities} quantities of {mesh_check.closed_forms} surfaces
with known values. {mesh_check.inside:.0%} of the bars of values on the mesh hold the true error; the
median bar is {mesh_check.width_median:.2f} times as wide as the error. {mesh_check.limit_inside:.0%} of the
bars of limits hold theirs; the median bar is {mesh_check.limit_width_median:.2g} times as wide, 1 in 20
more than {mesh_check.limit_width_95:.0f} times, and one {mesh_check.limit_width_largest:.0f} times: a
limit may happen to be nearly exact."""

CURVED = """\
The study `curved` measures how soon an energy is known to how many digits, all from the same flat meshes: by
flat triangles, extrapolated ones and curved elements here, and by Surface Evolver's linear, quadratic and
Lagrange elements (`curved/error-seconds.png`). `curved/ahead_times.csv` has the quickest run of each program
that is as accurate; the times differ from run to run. Of the {rows} accuracies of {surfaces} surfaces that a
run of either reaches, {alone} only one of ours does. Of the others ours is quicker in {quicker}, up to
{most} times, and Evolver in {slower}, up to {least} times: {where}.

The roof over an L has no closed form: its reference has elements of order 8 on a mesh graded towards the
re-entrant corner. There a height of r^(2/3), as of linear theory, gives even meshes the order 4/3. We find
{curved.order_ell_at_its_corner_even_order_2:.1f} in 1/√triangles with elements of order 2 and
{curved.order_ell_at_its_corner_even_order_4:.1f} with order 4, and on meshes graded there
{curved.order_ell_at_its_corner_graded_order_2:.1f} and
{curved.order_ell_at_its_corner_graded_order_4:.1f}."""

PANELS = """\
The study `panels` moves vertices of roofs at rest so that fewer different panels are needed. In
{panels.same_verdict_after:.0%} of its runs the roof keeps its verdict: in {panels.stable_after:.0%} it is
stable, in the others a saddle."""

NETS = """\
The study `nets` lays planar quads along lines of curvature, smaller and smaller. On pieces of Delaunay's
surfaces all are planar, and whole panels leave the surface with the size to the power
{nets.order_panel_distance_nodoid:.1f} to {nets.order_panel_distance_unduloid:.1f}, on Example 1
{nets.order_panel_distance_example_1:.1f}. There {nets.not_planar_example_1:.0f} panels of the finest net
stay warped, by up to {nets.planarity_example_1:.1%} of their diagonals, at the ends of the ridge.
On two halls with a wall between them the power is {nets.order_panel_distance_two_halls:.1f}, and
{nets.not_planar_two_halls:.0f} panels beside the ridge stay warped; on an L-shaped roof it is
{nets.order_panel_distance_l_roof:.1f}, and none.
`nets/places.csv` has the umbilics and the warped panels."""

SPEED = """\
Surface Evolver solves the same mesh of Example 1, and the same cap, in the same run. `python -m studies
benchmark` writes this table, and `benchmark/scaling.csv` and `scaling.png`, which show how time and
memory grow with the number of triangles. Unlike all others here, they differ from run to run."""

BENCH = """\
The study `bench` takes the same surfaces from the same start to rest through other programs, each asked in
its own way (see the first lines of `studies/questions/bench.py`). A program that left more than {near:g} of
the forces, or took more than {limit:.0f} s, was not asked for finer meshes; at rest is {rest:g}. The column,
the catenoid, the drop, inflation and evaporation are of the stress suite of pySurfaceEvolver
(<https://github.com/gautelinga/pySurfaceEvolver>, `docs/stress_cases.md`), on our meshes. Its bridge
between spheres, drop on a fibre, puddle and drained slit are left out: pcmc has no supports on spheres and
cylinders and no weight of a liquid, and does not remesh on its way. `bench/bench.png` shows the times; they
differ from run to run."""

FAIR_PAIRS = {  # rows of the benchmark: theirs, ours
    "step": ("Newton step, evolver", "Newton step, pardiso"),
    "plain": ("evolver, linear", "height of one mesh"),
    "extrapolated": ("evolver, linear, extrapolated by us", "height, extrapolated"),
}
FAIR = """\
Fair pairs do the same work to the same end. A Newton step on the same mesh takes Evolver {step:.1f} times
as long as ours. The height of the cap by flat triangles of one mesh takes it {plain:.1f} times as long;
both extrapolated, {extrapolated:.2g} times, {faster}. The row "its linear elements over ours" puts plain
values beside extrapolated ones, and "its script over ours" a run that has not converged beside one that
has: neither compares the programs."""


def write_comparison(results: Path) -> tuple[pd.DataFrame, pd.DataFrame]:
    """Write ``comparison.csv``, ``figures.csv`` and ``REPORT.md`` from what the studies measured."""
    comparison, figures = compare(read_measured(results))
    Folder(results).write_table("comparison", comparison)
    Folder(results).write_table("figures", figures)
    write_report(results)
    return comparison, figures


def write_report(results: Path) -> None:
    """Write ``REPORT.md`` from the tables in ``results``."""
    write_bytes(results / "REPORT.md", report(results).encode())


def report(results: Path) -> str:
    """The text of ``REPORT.md``; a section is left out if its study has not run."""
    comparison, figures = (Folder(results).read_table(name) for name in ("comparison", "figures"))
    measured = read_measured(results)
    near = {f"near_{claim.ours}": claim.near for claim in paper()[0]}
    header = fill(HEADER, near, {"headline": headline(comparison, figures)})
    sections = {
        "Figures": table(FIGURES, figure_cells(figures)),
        "Printed numbers": [
            *table(HEADS["number"], comparison_cells(comparison, "number")),
            "",
            CHOSEN,
            "",
            given_sentence(comparison),
        ],
        "Statements": [fill(THRESHOLDS, thresholds(comparison)), ""],
    }
    sections["Statements"] += table(HEADS["sentence"], comparison_cells(comparison, "sentence"))
    if (results / "solvers" / "summary.csv").is_file():
        words = {"saddles": _saddles(results)}
        sections["Solvers"] = [fill(SOLVERS, measured, words), "", *solver_table(results)]
    if (results / "corners" / "jumps.csv").is_file():
        sections["Ends of junctions"] = [
            fill(CORNERS, measured, _cut_steps(results)),
            "",
            *jump_table(results),
        ]
    if (results / "accuracy" / "savings.csv").is_file():
        above = {"above": measured["accuracy.most_over_estimate"] - 1.0}
        sections["Adaptive meshes"] = [fill(ACCURACY, measured | above, {"worse": _worse(results)})]
    texts = ("Mesh check", "mesh_check", CHECK), ("Panels", "panels", PANELS), ("Nets", "nets", NETS)
    for title, study, text in texts:
        if (results / study / "measured.csv").is_file():
            sections[title] = [fill(text, measured)]
    if (results / "curved" / "ahead_times.csv").is_file():
        sections["Curved elements"] = fill(CURVED, measured, _ahead(results)).split("\n")
    if (results / "benchmark" / "full.csv").is_file():
        sections["Speed"] = [SPEED, "", *fair_pairs(results), *speed_table(results)]
    if (results / "bench" / "runs_times.csv").is_file():
        about = BENCH.format(limit=bench.LIMIT, rest=bench.REST, near=bench.NEAR)
        sections["Beside other programs"] = [about, "", *bench_table(results)]
    parts = ["\n".join([f"## {title}", "", *lines]) for title, lines in sections.items()]
    return "\n\n".join(map(wrapped, "\n\n".join([header, *parts]).split("\n\n"))) + "\n"


def wrapped(paragraph: str) -> str:
    """A paragraph in lines of WIDTH; headings, lists and tables as they are.

    >>> len(wrapped("a word, " * 20).splitlines())
    2
    """
    if paragraph.startswith(("#", "- ", "|")):
        return paragraph
    return textwrap.fill(" ".join(paragraph.split()), WIDTH, break_on_hyphens=False, break_long_words=False)


def headline(comparison: pd.DataFrame, figures: pd.DataFrame) -> str:
    """One sentence: how many figures, numbers and statements are reproduced, and how many by choice."""
    figure = [int((figures.label == label).sum()) for label in (REPRODUCED, CONDITIONAL, NOT)]
    numbers, sentences = (of_the_paper(comparison, kind) for kind in ("number", "sentence"))
    hold, near = (int((numbers.verdict == verdict).sum()) for verdict in (HOLDS, NEAR))
    chosen = [str(what) for what in numbers.chosen[numbers.verdict == HOLDS].fillna("") if what]
    why = f" ({len(chosen)} of them because we chose {listed(chosen)} so)" if chosen else ""
    held = sentences[sentences.verdict == HOLDS]
    return (
        f"Of the paper's {len(figures)} figures, {figure[0]} is reproduced, {figure[1]} are reproduced"
        f" conditionally and {figure[2]} is not; of its {len(numbers)} printed numbers, {hold} hold{why},"
        f" {near} are near and {len(numbers) - hold - near} differ; {len(held)} of its {len(sentences)}"
        f" statements hold, {(held.threshold == 'ours').sum()} of them by a threshold of ours."
    )


def of_the_paper(comparison: pd.DataFrame, kind: str) -> pd.DataFrame:
    """The paper's own claims of a kind, without our additions."""
    return comparison[(comparison.kind == kind) & ~comparison["where"].str.endswith(OWN)]


def thresholds(comparison: pd.DataFrame) -> dict[str, float]:
    """How many statements, the paper's and our additions, there are, and rest on a threshold of ours."""
    every = comparison[comparison.kind == "sentence"]
    papers = of_the_paper(comparison, "sentence")
    ours, added = (float((rows.threshold == "ours").sum()) for rows in (papers, every))
    rest = float(len(every) - len(papers))
    return {"paper": ours, "papers": float(len(papers)), "own": added - ours, "owns": rest}


def _saddles(results: Path) -> str:
    """The examples in which the geometric solver ends on saddles."""
    records = Folder(results / "solvers").read_table("records")
    examples = sorted(records.example[records.verdict == "saddle"].unique())
    return f"all in Example{'s' if len(examples) > 1 else ''} " + listed(
        [str(name).removeprefix("example") for name in examples]
    )


def _ahead(results: Path) -> dict[str, str]:
    """Where which program is the quicker one to an energy."""
    ahead = Folder(results / "curved").read_table("ahead_times")
    both = ahead[ahead.theirs_over_ours.notna()]
    slower = both[both.theirs_over_ours < 1.0]
    last = slower.groupby(slower.case.str.replace("_", " "), sort=False).accuracy.min()
    return {
        "rows": str(len(ahead)),
        "surfaces": str(ahead.case.nunique()),
        "alone": str(int(ahead.evolver.isna().sum())),
        "quicker": str(len(both) - len(slower)),
        "most": f"{both.theirs_over_ours.max():.1f}",
        "slower": str(len(slower)),
        "least": f"{1.0 / both.theirs_over_ours.min():.1f}",
        "where": listed([f"the {case} down to {least:.0e}" for case, least in last.items()] or ["nowhere"]),
    }


def _worse(results: Path) -> str:
    """The error bars for which adaptive meshes need more triangles than uniform ones."""
    savings = Folder(results / "accuracy").read_table("savings")
    worse = savings[savings.saving < 1.0]
    rows = zip(worse.quantity, worse.family, worse.bar_of, 1.0 / worse.saving, strict=True)
    words = [f"for the {what} in `{of}` ({bar}) {times:.2f} times as many" for what, of, bar, times in rows]
    if not words:
        return "For none of them do adaptive meshes need more triangles."
    return f"For {len(words)} of them adaptive meshes need more triangles: {listed(words)}."


def _cut_steps(results: Path) -> dict[str, str]:
    """How much smaller Example 1's steps of the energy are with every triangle cut into four."""
    jumps = Folder(results / "corners").read_table("jumps")
    ratios = (jumps.step / jumps.step_halved)[jumps.case.str.startswith("example1")]
    return {"least": f"{ratios.min():.1f}", "most": f"{ratios.max():.1f}"}


def fair_pairs(results: Path) -> list[str]:
    """The benchmark's rows in which both programs do the same work; no line where one of them is missing."""
    rows = Folder(results / "benchmark").read_table("full").drop_duplicates("what")
    # of rows with one name the first: of Newton steps that on the smaller mesh
    seconds = {str(what): float(median) for what, median in zip(rows["what"], rows["median"], strict=True)}
    ratios = {
        key: seconds.get(theirs, math.nan) / seconds.get(ours, math.nan)
        for key, (theirs, ours) in FAIR_PAIRS.items()
    }
    if any(map(math.isnan, ratios.values())):
        return []
    faster = f"so {'Evolver' if ratios['extrapolated'] < 1.0 else 'pcmc'} is the faster one"
    return [fill(FAIR, ratios, {"faster": faster}), ""]


def given_sentence(comparison: pd.DataFrame) -> str:
    """How many of the paper's inputs (tensions, lengths, steps) the studies use as printed."""
    given = comparison[comparison.kind == "input"]
    differ = given[given.verdict != HOLDS].what.tolist()
    rest = f"; not so: {', '.join(differ)}" if differ else ""
    used = {"used": float(len(given) - len(differ)), "inputs": float(len(given))}
    return " ".join(fill(GIVEN, used, {"rest": rest}).split())
