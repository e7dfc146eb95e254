"""What README and documentation print runs; their pictures and generated pages are there and of today."""

from __future__ import annotations

import ast
import importlib
import inspect
import re
import subprocess
import sys
from pathlib import Path

import pytest
from nightly import night_but
from pages import parts, run_page
from programs import expect_ccx

import pcmc
from pcmc.project import reference

HOME = Path(__file__).resolve().parents[2]
DOCS = HOME / "docs"
WRITTEN = subprocess.run(["git", "ls-files", "docs"], cwd=HOME, capture_output=True, text=True).stdout.split()
PAGES = sorted(["README.md", *(path for path in WRITTEN if path.endswith(".md") and "pictures" not in path)])
RUN = [page for page in PAGES if any(kind in ("python", "sh", "toml") for _, kind, _ in parts(HOME / page))]
SCRIPTS = sorted(path.stem for path in (DOCS / "pictures").glob("*.py") if path.stem != "draw")


@pytest.mark.parametrize("page", night_but(RUN))
@pytest.mark.filterwarnings("ignore")
def test_a_page_runs(page, tmp_path, monkeypatch):
    if page.endswith(("under-load.md", "members.md")):
        expect_ccx()
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("PCMC_CACHE", str(tmp_path / "cache"))
    assert run_page(HOME / page) > 0


def test_only_pages_for_researchers_need_the_checkout():
    """The wheel has neither generators nor studies."""
    for page in PAGES:
        code = "".join(text for _, kind, text in parts(HOME / page) if kind in ("python", "before"))
        if re.search(r"\b(import|from) (generators|studies)\b", code):
            text = " ".join((HOME / page).read_text(encoding="utf-8").split())
            assert "in the checkout" in text, page


@pytest.mark.parametrize("page", [page for page in PAGES if page.startswith("docs/how-to/")])
def test_a_recipe_has_a_picture(page):
    if page not in ("docs/how-to/index.md", "docs/how-to/project-keys.md"):
        assert "![" in (HOME / page).read_text(encoding="utf-8")


@pytest.mark.parametrize("name", SCRIPTS)
def test_a_picture_is_beside_its_script_and_light(name):
    assert (DOCS / "pictures" / f"{name}.png").stat().st_size < 100_000
    source = (DOCS / "pictures" / f"{name}.py").read_text(encoding="utf-8")
    assert str(ast.get_docstring(ast.parse(source))).endswith((".", ")."))
    assert not re.search(r"\b(import|from) (generators|studies)\b", source)


@pytest.mark.nightly
@pytest.mark.parametrize("name", [name for name in SCRIPTS if name not in ("page", "report", "drawings")])
def test_a_script_draws_its_picture_again(name, tmp_path):
    if name in ("load_case", "members", "under_load", "slack"):
        expect_ccx()
    subprocess.run([sys.executable, DOCS / "pictures" / f"{name}.py"], cwd=tmp_path, check=True)
    assert (tmp_path / f"{name}.png").stat().st_size > 1000
    table = DOCS / "pictures" / f"{name}.csv"
    if table.exists():
        assert (tmp_path / table.name).read_text(encoding="utf-8") == table.read_text(encoding="utf-8")


def test_the_stored_page_of_keys_is_of_today():
    stored = (DOCS / "how-to" / "project-keys.md").read_text(encoding="utf-8")
    assert stored == "# The keys of a project file\n\n" + reference(), "run: sphinx-build docs docs/_build"


# of which users call functions; the others are reached by the command or by pcmc itself
SUBPACKAGES = (
    "accuracy",
    "certificate",
    "compas",
    "design",
    "drawings",
    "equilibria",
    "forces",
    "io",
    "meshing",
    "panelling",
    "plan",
    "report",
    "solvers",
    "solvers.continuation",
    "stability",
    "structure",
    "surface",
    "sweep",
)


def test_every_public_function_of_the_subpackages_has_an_example():
    """In its docstring, or in a page that is run."""
    code = "".join(text for page in PAGES for _, kind, text in parts(HOME / page) if kind == "python")
    without = [
        f"{name}.{public}"
        for name in SUBPACKAGES
        for public in getattr(importlib.import_module(f"pcmc.{name}"), "__all__", ())
        if inspect.isfunction(value := getattr(importlib.import_module(f"pcmc.{name}"), public))
        and ">>>" not in (inspect.getdoc(value) or "")
        and not re.search(rf"\b{public}\b", code)
    ]
    assert without == []


def test_every_public_name_has_an_example():
    """In its docstring, or in a page that is run."""
    code = "".join(text for page in PAGES for _, kind, text in parts(HOME / page) if kind == "python")
    code += "".join(path.read_text(encoding="utf-8") for path in (DOCS / "pictures").glob("*.py"))
    without = [n for n in pcmc.__all__ if ">>>" not in (inspect.getdoc(getattr(pcmc, n)) or "")]
    assert [name for name in without if not re.search(rf"\b{name}\b", code)] == []


@pytest.mark.parametrize("page", PAGES)
def test_links_to_files_of_the_checkout_lead_somewhere(page):
    generated = ("gallery.md", "command-line.md", ".ipynb")
    text = re.sub(r"^```.*?^```", "", (HOME / page).read_text(encoding="utf-8"), flags=re.S | re.M)
    for target in re.findall(r"\]\(([^)#\s]+)[^)]*\)", text):
        if not target.startswith("http") and not (page != "README.md" and target.endswith(generated)):
            assert ((HOME / page).parent / target).exists(), target


def test_the_bibliography_has_what_is_cited_and_no_more():
    """Cited as "Name 1977", "Name and Name 1977" or "Name and others 1977"."""
    text = (DOCS / "bibliography.md").read_text(encoding="utf-8")
    entries = re.findall(r"^([A-Z][^\n]*) ((?:18|19|20)\d\d)$", text, re.M)
    files = [*HOME.glob("pcmc/**/*.py"), *(HOME / page for page in PAGES)]
    files = [path for path in files if path.stem not in ("bibliography", "history")]
    code = "".join(path.read_text(encoding="utf-8") for path in files)
    last = r"([A-Z][\w-]+)(?: and others| et al\.)?,?\s\(?((?:18|19|20)\d\d)\b"
    cited = {found for found in re.findall(last, code) if found[0] != "May"}  # a date
    assert {
        one for one in cited if not any(one[0] in names and one[1] == year for names, year in entries)
    } == set()
    assert [(n, y) for n, y in entries if not any(name in n and year == y for name, year in cited)] == []
