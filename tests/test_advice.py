"""Wrong first projects: the advice printed for each, typed as it is printed, gives a certified roof."""

import re

import pytest
import tomlkit

from pcmc.project import load, run_project

HALL = "[plan]\nedge_length = 0.8\noutline = [[0, 0], [12, 0], [12, 6], [0, 6]]\n"
SEAM = "curve = [[6, 0], [6, 6]]\n"
CHANCEL = f'[[plan.dividers]]\nname = "chancel"\n{SEAM}'
WRONG = {
    "a wall too weak for its neighbours": f"{HALL}{CHANCEL}wall = 1.0\n"
    "[plan.patches]\nnave = {tension = 7.0}\napse = {tension = 4.0}\n",
    "tensions that cannot carry the load": f"{HALL}dividers = [[[6, 0], [6, 6]]]\n"
    "[plan.patches]\nnave = {tension = 1.0}\napse = {tension = 1.5}\n",
    "a bottom that slides away": f"{HALL}{CHANCEL}wall = 3.0\nbottom = 'sliding'\n"
    "[plan.patches]\nnave = {tension = 5.0}\napse = {tension = 4.0}\n",
    "two mistakes at once": f"{HALL}{CHANCEL}wall = 3.0\n"
    "[plan.patches]\nnave = {tension = 5.0}\napse = {tension = 1.6}\n"
    "[targets]\nmeet = [{quantity = 'apex', of = 'nave', value = 0.9}]\nvary = ['nave']\n",
}
LINE = re.compile(r"(\[\[?)plan\.?(\w*)\]\]? ?(?:number (\d+) \(.*\)|(\w+))?:? ?(\w+) = (.*)  \(now .*\)")


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


@pytest.mark.filterwarnings("ignore::pcmc.base.errors.BalanceWarning")
@pytest.mark.parametrize("text", WRONG.values(), ids=WRONG)
def test_the_advice_typed_as_it_is_printed_gives_a_roof(tmp_path, text):
    first = outcome_of(tmp_path, text)
    assert not first.good
    heading, *lines = first.advice
    assert heading == "type in roof.toml, which was tried and comes to rest:"
    assert lines
    assert outcome_of(tmp_path, typed(text, lines)).certificate.certified
