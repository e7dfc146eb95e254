"""Wrong first projects: the advice printed for each, typed as it is printed, gives a certified roof."""

import re
import tomllib
from dataclasses import replace

import numpy as np
import pytest
import tomlkit
from asking import Client
from explore_cases import followed
from nightly import at_night, night_but
from printed import words_of

from generators import two_squares
from pcmc import certify, cli, solve
from pcmc.accuracy import MeshVerdict, check_mesh
from pcmc.advice.advice import changes, firmer_walls, flatter, lower_lines
from pcmc.certificate.diagnosis import describe_saddle
from pcmc.explore.roof import ShownRoof
from pcmc.plan import Divider, PatchSpec, Plan
from pcmc.plan.plan import Chosen
from pcmc.project import firmer, load, run_project

HALL = "[plan]\nedge_length = 1.1\noutline = [[0, 0], [12, 0], [12, 6], [0, 6]]\n"
SEAM = "curve = [[6, 0], [6, 6]]\n"
CHANCEL = f'[[plan.dividers]]\nname = "chancel"\n{SEAM}'
WRONG = {
    "a wall too weak for its neighbours": f"{HALL}{CHANCEL}wall = 1.0\n"
    "[plan.patches]\nnave = {tension = 7.0}\napse = {tension = 4.0}\n",
    "tensions that cannot carry the load": f"{HALL}dividers = [[[6, 0], [6, 6]]]\n"
    "[plan.patches]\nnave = {tension = 1.0}\napse = {tension = 1.5}\n",
    "a bottom that slides away": f"{HALL}{CHANCEL}wall = 3.0\nbottom = 'sliding'\n"
    "[plan.patches]\nnave = {tension = 5.0}\napse = {tension = 4.0}\n",
    "a wall and a tension far from those that meet the target": f"{HALL}{CHANCEL}wall = 0.5\n"
    "[plan.patches]\nnave = {tension = 9.0}\napse = {tension = 5.0}\n"
    "[targets]\nmeet = [{quantity = 'apex', of = 'nave', value = 0.9}]\nvary = ['nave']\n",
    "cables too weak for their edges": "[plan]\nedge_length = 0.8\nedge = 'cable'\ncable = 15.0\n"
    "outline = [[0, 0, 0], [12, 0, 4], [12, 12, 0], [0, 12, 4]]\ntension = 2.0\npressure = 0.0\n"
    "supports = [[0, 0, 0], [12, 0, 4], [12, 12, 0], [0, 12, 4]]\n",
    "two mistakes at once": f"{HALL}{CHANCEL}wall = 3.0\n"
    "[plan.patches]\nnave = {tension = 5.0}\napse = {tension = 1.6}\n"
    "[targets]\nmeet = [{quantity = 'apex', of = 'nave', value = 0.9}]\nvary = ['nave']\n",
}
LINE = re.compile(r"(\[\[?)plan\.?(\w*)\]\]? (?:(?:number (\d+) \(.*\)|(\w+)): )?(\w+) = (.*)  \(now .*\)")


def typed(text, lines):
    """A project with the advised lines typed into it."""
    document = tomlkit.parse(text)
    for line in lines:
        _, table, number, name, key, value = LINE.fullmatch(line).groups()
        place = document["plan"][table] if table else document["plan"]
        place = place[int(number) - 1] if number else place[name] if name else place
        place[key] = tomlkit.value(value)
    return tomlkit.dumps(document)


def outcome_of(tmp_path, text):
    path = tmp_path / "roof.toml"
    path.write_text(text)
    return run_project(load(path), use_cache=False)


WEAK, HEAVY = "a wall too weak for its neighbours", "tensions that cannot carry the load"
LOOSE = "cables too weak for their edges"


@pytest.mark.filterwarnings("ignore::pcmc.base.errors.BalanceWarning")
@pytest.mark.parametrize("kind", night_but(WRONG, WEAK, HEAVY, LOOSE))
def test_the_advice_typed_as_it_is_printed_gives_a_roof(tmp_path, kind):
    text = WRONG[kind]
    first = outcome_of(tmp_path, text)
    assert not first.good
    heading, *lines = first.advice
    tried = "comes to rest and meets the targets" if "[targets]" in text else "and comes to rest"
    assert heading.startswith("type in roof.toml, which was tried")
    assert heading.endswith(f"{tried}:")
    assert lines
    assert outcome_of(tmp_path, typed(text, lines)).good


@pytest.mark.filterwarnings("ignore::pcmc.base.errors.BalanceWarning")
def test_of_a_roof_that_is_shown_whole_the_whole_is_tried(tmp_path, monkeypatch):
    """The part between the mirrors alone was."""
    half = HALL.replace("dividers", "") + "mirrors = [[[12, 0], [12, 6]]]\n" + f"{CHANCEL}wall = 1.0\n"
    text = half + "[plan.patches]\nnave = {tension = 7.0}\napse = {tension = 4.0}\n[output]\nwhole = true\n"
    assert "comes to rest" in outcome_of(tmp_path, text).advice[0]
    monkeypatch.setattr("pcmc.project.outcome.certify", lambda surface: certify(two_squares(2)))
    assert "comes to rest" not in "".join(outcome_of(tmp_path, text).advice)


def test_a_wall_that_is_balanced_as_it_is_is_no_change():
    line = Divider([[6, 0], [6, 6]])
    hall = Plan([[0, 0], [12, 0], [12, 6], [0, 6]], [line], edge_length=0.8, tension=5.0)
    wall = next(patch.tension for patch in hall.surface().patches if patch.wall)
    typed_in = replace(hall, dividers=[replace(line, wall=wall)])
    assert changes(typed_in, hall) == []
    assert changes(replace(hall, dividers=[replace(line, wall=2.0 * wall)]), hall)


def test_a_line_advised_for_a_name_with_a_quote_is_read_by_toml():
    line, name = Divider([[6, 0], [6, 6]]), 'the "west"'
    areas = [PatchSpec(name, 5.0, at=[1, 1]), PatchSpec("east", 5.0, at=[9, 1])]
    hall = Plan([[0, 0], [12, 0], [12, 6], [0, 6]], [line], edge_length=0.8, patches=areas)
    advised = changes(hall, replace(hall, patches=[replace(areas[0], tension=6.0), areas[1]]))[0]
    key = advised.removeprefix("[plan.patches] ").split(": tension")[0]
    assert tomllib.loads(f"{key} = 6") == {name: 6}
    key = Chosen({name: 5.0}).text.split("to change: ")[1].split(" under")[0]
    assert tomllib.loads(key.replace("...", "6")) == {name: {"tension": 6}}


def test_a_line_for_a_divider_that_may_be_a_curve_alone_says_what_that_becomes():
    lines = [Divider([[4, 0], [4, 6]]), Divider([[8, 0], [8, 6]], 2.0)]
    hall = Plan([[0, 0], [12, 0], [12, 6], [0, 6]], lines, edge_length=0.8, tension=5.0)
    upright = replace(hall, dividers=[replace(line, upright=True) for line in hall.dividers])
    alone, table = changes(hall, upright)
    named = replace(hall, dividers=[replace(line, name=f"seam {k}") for k, line in enumerate(hall.dividers)])
    other = replace(named, dividers=[replace(line, upright=True) for line in named.dividers])
    assert changes(named, other)[0].endswith("upright = true  (now false)")
    assert alone.endswith("(now false; a curve alone becomes {curve = ..., upright = true})")
    assert table.endswith("upright = true  (now false)")


def test_a_sail_is_neither_made_firmer_nor_flatter():
    """No patch of it has a pressure: it was the greatest tension of none."""
    sail = Plan([[0, 0], [4, 0], [4, 4], [0, 4]], tension=1.0, pressure=0.0, edge_length=1.0)
    assert [*firmer_walls(sail, sail.surface(), []), *flatter(sail, [])] == []


STEEP = """[plan]
outline = [[0, 0], [18, 0], [18, 12], [0, 12]]
holes = [{circle = {centre = [9, 6], radius = 1.5}}]
edge_length = 0.57
"""


WISHES = {"rise = 2.5": "12", "span_ratio = 3": "345", "tension = 3.91": "4567"}  # first digits advised


@pytest.mark.nightly
@pytest.mark.parametrize("wish", WISHES)
def test_a_roof_too_steep_at_a_hole_is_advised_to_be_flatter(tmp_path, wish):
    """It was "held by the mesh" without a word on what to type."""
    first = outcome_of(tmp_path, STEEP + wish)
    assert first.good
    assert first.check_mesh().verdict.name == "HELD_BY_MESH"
    heading, line = firmer(first).split("\n  ")
    assert heading == "type in roof.toml, which was tried and persists:"
    key, value = wish.split(" = ")
    assert re.fullmatch(rf"\[plan\] {key} = [{WISHES[wish]}](\.\d)?  \(now {value}\)", line)
    flatter = outcome_of(tmp_path, STEEP + line.removeprefix("[plan] ").split("  (")[0])
    assert flatter.good
    assert flatter.check_mesh().persists


def test_a_ridge_that_is_too_high_in_a_sail_is_advised_to_be_lower(tmp_path):
    """It was "held by the mesh" without a word on what to type."""
    sail = (
        "[plan]\noutline = [[0, 0], [12, 0], [12, 8], [0, 8]]\nedge_length = 0.7\ntension = 2\npressure = 0\n"
    )
    first = outcome_of(tmp_path, f"{sail}supports = [[[3, 4, 4], [9, 4, 4]]]\n")
    assert first.good
    first.check_mesh()
    heading, line = firmer(first).split("\n  ")
    assert heading == "type in roof.toml, which was tried and persists:"
    assert line == "[plan] supports number 1: 0.35 times its heights, up to 1.4  (now up to 4)"
    lower = outcome_of(tmp_path, f"{sail}supports = [[[3, 4, 1.4], [9, 4, 1.4]]]\n")
    assert lower.check_mesh().persists


def test_a_ridge_is_lowered_towards_the_level_of_its_outline():
    """Over an outline at 10 a ridge at 14 was to be at 9.8."""
    outline = [[0, 0, 10], [12, 0, 10], [12, 8, 10], [0, 8, 10]]
    arc = {"arc": [[3, 6, 12], [6, 6, 14], [9, 6, 12]]}
    lines = [[[3, 4, 14], [9, 4, 14]], [[3, 2, 10], [9, 2, 10]], arc]
    plan = Plan(outline, supports=lines, tension=2.0, pressure=0.0, edge_length=0.7)
    other, _, (first, last) = next(lower_lines(plan))
    assert first == "[plan] supports number 1: 0.7 times its heights over 10, up to 12.8  (now up to 14)"
    assert last.startswith("[plan] supports number 3: 0.7 times its heights over 10, up to 12.8 ")
    before, after = (p.supports[2].at([0.0, 0.5, 1.0]) for p in (plan, other))
    assert after == pytest.approx(before * [1, 1, 0.7] + [0, 0, 3])


@pytest.fixture
def lost(tmp_path):
    """A project of a roof that finer meshes lose, and that wants its mesh checked."""
    path = tmp_path / "roof.toml"
    path.write_text(f'units = "m"\n{STEEP}rise = 2.5\n[solve]\nmesh_check = true\n')
    return path


LOWER = "type in roof.toml, which was tried and persists: [plan] rise = 2.1 (now 2.5)"


@pytest.mark.parametrize("command", night_but(["certify", "report", "run"], "certify"))
def test_every_way_to_a_roof_says_what_to_type(lost, command, capsys):
    """``pcmc solve`` alone did."""
    pdf = lost.with_suffix(".pdf")
    if command == "run":
        print(run_project(load(lost), use_cache=False).mesh_check.advice)
    else:
        cli.main([command, str(lost), *(["-o", str(pdf)] if command == "report" else [])])
    said = [capsys.readouterr().out, *([" ".join(words_of(pdf))] if command == "report" else [])]
    assert all(LOWER in " ".join(text.split()) for text in said)


@pytest.mark.nightly
def test_the_page_says_what_to_type_too(lost):
    with followed(lost) as page:
        client = Client(page)
        about, _ = client.ask("api/open")
        told = client.ask(f"api/{about['session']}/check")[0]["check"]["detail"]
        client.ask(f"api/{about['session']}/settle", {"tensions": {"patch 1": 4.0}})
        moved = client.ask(f"api/{about['session']}/check")[0]["check"]["detail"]
    assert LOWER in " ".join(told.split())
    assert moved.endswith(
        "save the roof shown as a project: pcmc solve looks for a change of it that persists"
    )


def test_a_page_promises_advice_of_a_project_only_where_it_is_looked_for(tmp_path):
    """Of a roof that changes, too, it said that ``pcmc solve`` looks for a change."""
    roof = ShownRoof(outcome_of(tmp_path, HALL + "tension = 5.0\n"))
    moved = solve(roof.surface.retensioned({"patch 1": 6.0}))
    check = replace(check_mesh(moved, meshes=2), advice="")
    for verdict, promised in ((MeshVerdict.CHANGES, False), (MeshVerdict.HELD_BY_MESH, True)):
        told = roof.advised(replace(check, verdict=verdict), print)
        assert told.advice.startswith("save the roof shown as a project") is promised


CORNERED = """[plan]
edge_length = 1.1
outline = [[0, 0], [20, 0], [10, 17]]
dividers = [{curve = [[10, 6], [0, 0]]}, {curve = [[10, 6], [20, 0]]}, {curve = [[10, 6], [10, 17]]}]
[plan.patches]
south = {apex = 3, at = [10, 1]}
west = {apex = 3, at = [5, 7]}
east = {apex = 2.5, at = [15, 7]}
"""


HALF = """[plan]
edge_length = 1.1
outline = [[0, 0], [9, 0], [9, 10], [0, 10]]
mirrors = [[[9, 0], [9, 10]]]
dividers = [{curve = [[4, 0], [4, 10]], wall = 3.5}]
[plan.patches]
a = {tension = 7.6}
b = {tension = 5.8}
[targets]
meet = [{quantity = "apex", of = "a", value = 1.6}, {quantity = "apex", of = "b", value = 2.2}]
vary = ["a", "b"]
"""


def test_walls_are_advised_to_stay_upright_where_heights_are_missed(tmp_path):
    """The wall leans by 56 degrees, and the roof was "not met" without advice."""
    first = outcome_of(tmp_path, HALF)
    assert first.certified
    assert first.check_mesh().persists
    assert not first.good
    heading, line = firmer(first).split("\n  ")
    assert heading == "type in roof.toml, which was tried and persists:"
    assert ": upright = true  (now false" in line
    assert outcome_of(tmp_path, typed(HALF, [line])).good


def test_no_tension_is_advised_for_a_tent_whose_ring_is_too_small(tmp_path):
    """Without loads its shape is the same with any tension."""
    ring = "holes = [{curve = {circle = {centre = [5, 5, 4], radius = 0.6}}}]\n"
    square = "[plan]\nedge_length = 1.0\noutline = [[0, 0], [10, 0], [10, 10], [0, 10]]\n"
    outcome = outcome_of(tmp_path, f"{square}tension = 1.234\npressure = 0.0\n{ring}")
    assert "distance" in [attempt.way for attempt in outcome.certificate.tried]
    assert not outcome.good
    assert not outcome.advice


@pytest.mark.nightly
@pytest.mark.filterwarnings("ignore::pcmc.base.errors.BalanceWarning")
def test_a_failed_target_keeps_the_diagnosis_of_a_plain_solve(tmp_path, capsys):
    text = WRONG["a wall too weak for its neighbours"]
    targets = "[targets]\nmeet = [{quantity = 'apex', of = 'nave', value = 1.0}]\nvary = ['nave']\n"
    plain, aimed = outcome_of(tmp_path, text), outcome_of(tmp_path, text + targets)
    assert aimed.certificate.detail == plain.certificate.detail
    assert cli.main(["solve", str(tmp_path / "roof.toml"), "--no-mesh-check"]) == 1
    said = capsys.readouterr().out
    assert said.count("cannot balance: 7 > 1 + 4") == 1
    assert "targets not tried: without them there is no stable roof, either" in said
    assert plain.advice[1:] == ["[[plan.dividers]] number 1 ('chancel'): wall = 4.2  (now 1)"]


@pytest.mark.filterwarnings("error::pcmc.base.errors.FileWarning")
def test_one_remedy_is_printed_the_one_that_was_tried(tmp_path, capsys):
    text = f"{HALL}{CHANCEL}wall = 2.0\n[plan.patches]\nnave = {{tension = 6.0}}\napse = {{tension = 1.0}}\n"
    (tmp_path / "roof.toml").write_text(text)
    assert cli.main(["solve", str(tmp_path / "roof.toml"), "--no-mesh-check", "--no-cache"]) == 1
    printed = capsys.readouterr()
    assert "try a tension" not in printed.out + printed.err
    assert printed.out.count("chancel'): wall = ") == 1
    assert printed.err.count("cannot balance: 6 > 1 + 2") == 1


@pytest.mark.nightly
@pytest.mark.filterwarnings("ignore::pcmc.base.errors.BalanceWarning")
def test_advice_that_misses_the_targets_says_so(tmp_path, monkeypatch):
    """A roof that comes to rest and misses the targets is advised in these words."""
    monkeypatch.setattr("pcmc.project.advising.loosened", lambda plan, vary: None)
    targets = "[targets]\nmeet = [{quantity = 'apex', of = 'nave', value = 5.0}]\nvary = ['nave']\n"
    outcome = outcome_of(tmp_path, WRONG["a wall too weak for its neighbours"] + targets)
    heading, line, *_, last = outcome.advice
    assert heading == "type in roof.toml, which was tried without the targets and comes to rest:"
    assert "wall = 4.2" in line
    assert last.startswith("with them, the targets are ")
    assert "wanted 5" in last


def test_a_target_that_needs_a_further_start_is_met(tmp_path, monkeypatch):
    """Where the search finds nothing to start from, the roof of a plain solve is its start."""
    from pcmc.design import NoStart, meet

    def fails_once(surface, *args, **options):
        tried.append(surface)
        if len(tried) == 1:
            raise NoStart("no equilibrium")
        return meet(surface, *args, **options)

    tried = []
    monkeypatch.setattr("pcmc.project.solving.meet", fails_once)
    targets = "[targets]\nmeet = [{quantity = 'apex', value = 1.0}]\nvary = ['patch 1']\n"
    outcome = outcome_of(tmp_path, f"{HALL}tension = 5.0\n{targets}")
    assert outcome.good
    assert len(tried) == 2


def test_a_library_search_says_why_it_cannot_start(tmp_path):
    from pcmc import Target, meet
    from pcmc.design import NoStart

    path = tmp_path / "roof.toml"
    path.write_text(WRONG["a wall too weak for its neighbours"])
    with pytest.raises(NoStart, match=r"cannot balance: 7 > 1 [+] 4; try a tension of 4.2 for 'chancel'"):
        meet(load(path).plan.surface(), Target("apex", "apse", 1.0), "chancel")


REMESHED = f"""{HALL}tension = 4.0
[targets]
meet = [{{quantity = "apex", value = 1.0}}]
vary = ["patch 1"]
[remesh]
edge_length = 0.6
"""


def test_targets_met_on_the_first_mesh_are_told_with_their_tensions(tmp_path):
    outcome = outcome_of(tmp_path, REMESHED)
    assert outcome.good
    (note,) = outcome.notes
    assert re.fullmatch(r"targets met on the first mesh, \d+ triangles, with tension of patch 1 [\d.]+", note)


def test_a_finer_mesh_that_is_not_at_rest_says_what_it_reaches(tmp_path, monkeypatch):
    from pcmc.project import solving

    def again(project, surface, report):
        return solving._solve_or_meet(
            replace(project, targets=(), options={"iterations": 1, "levels": 0}), surface, report
        )

    monkeypatch.setattr(solving, "_again", again)
    outcome = outcome_of(tmp_path, REMESHED)
    assert not outcome.good
    (note,) = outcome.notes
    assert re.search(
        r"on the new one, \d+ triangles, the surface does not come to rest with them; it has apex \d", note
    )


def test_a_slipping_end_names_its_wall_and_the_key():
    seam = Divider([[6, 0], [6, 6]], 1.0, name="chancel", bottom="sliding")
    surface = Plan([[0, 0], [12, 0], [12, 6], [0, 6]], [seam], tension=5.0, edge_length=1.0).surface()
    curve = next(curve for curve in surface.topology.junctions if len(curve.sheets) == 3)
    mode = np.zeros((surface.n, 3))
    mode[curve.vertices[1:-1], 0] = 1.0
    text = describe_saddle(surface, 1, mode)
    assert text.endswith(
        "only the mesh holds it there; hold the bottom of 'chancel' (in a plan, bottom = \"held\")"
    )


FLUSH = """[plan]
edge_length = 0.8
outline = [[0, 0], [14, 0], [14, 9], [8, 9], [8, 14], [0, 14]]
dividers = [{curve = [[0, 9], [8, 9]], wall = 1.9}]
[plan.patches]
low = {tension = 5.1, at = [10, 3]}
high = {tension = 4.6, at = [3, 11]}
[targets]
meet = [{quantity = "apex", of = "low", value = 2.2}, {quantity = "apex", of = "high", value = 2.5}]
vary = ["low", "high"]
"""
UPRIGHT = "upright = true  (now false; a curve alone becomes {curve = ..., upright = true})"


@pytest.mark.parametrize(
    ("text", "changed"), [(CORNERED, [UPRIGHT] * 3), *at_night((FLUSH, ["wall = 5.2  (now 1.9)"]))]
)
def test_a_roof_that_finer_meshes_lose_gets_a_wall_with_which_they_hold_it(tmp_path, text, changed, capsys):
    path = tmp_path / "roof.toml"
    path.write_text(text)
    cli.main(["solve", str(path), "--no-cache"])
    _, held, after = capsys.readouterr().out.partition("held by the mesh: ")
    assert held
    head, *lines = after[after.index("type in") :].splitlines()
    assert head == "type in roof.toml, which was tried and persists:"
    assert lines == [f"  [[plan.dividers]] number {k} ('wall {k}'): {c}" for k, c in enumerate(changed, 1)]
    path.write_text(typed(text, [line.strip() for line in lines]))
    assert cli.main(["solve", str(path), "--no-cache"]) == cli.OK
    printed = capsys.readouterr().out
    assert "persists: finer meshes have the same surface" in printed
    assert "type in" not in printed


def test_advice_that_has_no_mesh_is_left_out(monkeypatch):
    """Here an upright wall along a bent line; the wall that is stronger is proposed all the same."""
    outline = [[0, 0], [12, 0], [12, 8], [0, 8]]
    plan = Plan(outline, [Divider([[6, 0], [6, 8]], wall=1.0)], edge_length=2.0, tension=5.0)
    bent = Divider([[6, 0], [7, 4], [6, 8]], wall=1.0, upright=True)
    monkeypatch.setattr("pcmc.advice.advice.with_upright", lambda plan: replace(plan, dividers=[bent]))
    found = list(firmer_walls(plan, plan.surface(), ()))
    assert found
    assert not any(divider.upright for plan, _, _ in found for divider in plan.dividers)
