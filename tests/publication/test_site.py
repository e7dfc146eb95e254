"""The built site: no page is wider than a laptop's or a telephone's screen, and examples are examples."""

from __future__ import annotations

import re
import shutil
import subprocess
import sys
from pathlib import Path

import pytest
from browsing import browser, needs_browser

HOME = Path(__file__).resolve().parents[2]

# What is cut or has to be scrolled sideways: [what, its width, the width there is]. Tables, and those that a
# command prints, may scroll by themselves on a telephone.
TOO_WIDE = """
const narrow = window.innerWidth < 700, found = [];
const page = document.documentElement;
if (page.scrollWidth > page.clientWidth) found.push(["page", page.scrollWidth, page.clientWidth]);
for (const one of document.querySelectorAll("pre, .pst-scrollable-table-container, .output")) {
  if (narrow && (one.tagName !== "PRE" || one.closest(".highlight-text, .output"))) continue;
  if (one.scrollWidth > one.clientWidth + 1) {
    found.push([one.textContent.trim().slice(0, 60), one.scrollWidth, one.clientWidth]);
  }
}
for (const one of document.querySelectorAll("math")) {
  const right = one.getBoundingClientRect().right;
  if (right > window.innerWidth && !one.closest(".formula, .pst-scrollable-table-container")) {
    found.push(["formula " + one.textContent.trim().slice(0, 40), Math.round(right), window.innerWidth]);
  }
}
const without = [...document.images].filter((one) => one.complete && one.naturalWidth === 0);
return found.concat(without.map((one) => ["no picture " + one.src, 0, 0]));
"""


@pytest.fixture(scope="module")
def site(tmp_path_factory):
    """The site, built from a copy, because a build writes generated pages beside the others."""
    home = tmp_path_factory.mktemp("site")
    shutil.copytree(HOME / "docs", home / "docs", ignore=shutil.ignore_patterns("_build"))
    for folder in ("notebooks", "results", "pcmc", "generators"):
        (home / folder).symlink_to(HOME / folder)
    words = ["sphinx", "-q", "-W", "--keep-going", "-b", "html", home / "docs", home / "html"]
    subprocess.run([sys.executable, "-m", *words], check=True, cwd=HOME)
    return home / "html"


@pytest.mark.nightly
@needs_browser
@pytest.mark.parametrize("width", [1300, 400])
def test_no_page_scrolls_sideways_and_every_picture_is_there(width, site, tmp_path):
    driver = browser(tmp_path)
    try:
        size = {"width": width, "height": 900, "deviceScaleFactor": 1, "mobile": False}
        driver.execute_cdp_cmd("Emulation.setDeviceMetricsOverride", size)
        wide = {}
        for page in sorted(path for path in site.rglob("*.html") if "_static" not in path.parts):
            driver.get(page.as_uri())
            if found := driver.execute_script(TOO_WIDE):
                wide[str(page.relative_to(site))] = found
    finally:
        driver.quit()
    assert wide == {}


@pytest.mark.nightly
def test_notes_to_developers_are_not_on_the_pages(site):
    text = (site / "comparison.html").read_text(encoding="utf-8")
    assert "do not edit" in text
    assert "do not edit" not in re.sub(r"<!--.*?-->", "", text, flags=re.S)


@pytest.mark.nightly
def test_examples_of_docstrings_are_no_entries_of_their_parameters(site):
    pages = sorted((site / "reference").rglob("*.html"))
    assert pages
    assert not [page for page in pages if "<dt><strong>&gt;&gt;&gt;" in page.read_text(encoding="utf-8")]
