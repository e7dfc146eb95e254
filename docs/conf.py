"""The documentation's settings, and the pages that are generated at each build.

Generated: the tutorial (copies of the notebooks), the picture of the page on drawings, the keys of a project
file, and the reference.
"""

from __future__ import annotations

import base64
import importlib
import importlib.metadata
import json
import pkgutil
import shutil
import sys
from pathlib import Path
from types import ModuleType
from typing import Any

from docutils import nodes
from docutils.utils.math.latex2mathml import tex2mathml
from sphinx.application import Sphinx
from sphinx.util.docutils import SphinxTranslator

import pcmc
from pcmc.project import reference

sys.path.insert(0, str(Path(__file__).resolve().parent))
from drawing_layers import picture

DOCS = Path(__file__).resolve().parent
HOME = DOCS.parent
MODULES = (  # modules with names that users need beside those of their package
    "pcmc.base.errors",
    "pcmc.meshing.local_refinement",
    "pcmc.meshing.refinement",
    "pcmc.meshing.remeshing",
    "pcmc.solvers.lbfgs",
    "pcmc.solvers.nesterov",
    "pcmc.solvers.newton",
    "pcmc.solvers.result",
)
ENTRIES = ("Parameters", "Attributes", "Returns", "Raises", "Warns")  # sections of docstrings

project = "pcmc"
author = "The pcmc developers"
release = importlib.metadata.version("pcmc-surfaces")
extensions = ["sphinx.ext.autodoc", "sphinx.ext.autosummary", "numpydoc", "myst_nb"]
exclude_patterns = ["_build"]
source_suffix = {".rst": "restructuredtext", ".md": "myst-nb", ".ipynb": "myst-nb"}

html_theme = "pydata_sphinx_theme"
html_title = "pcmc"
html_static_path = ["_static"]
html_css_files = ["pcmc.css"]
html_copy_source = False
html_show_sourcelink = False
html_sidebars = {"index": []}
html_theme_options = {"secondary_sidebar_items": ["page-toc"], "footer_end": []}

nb_execution_mode = "off"
myst_enable_extensions = ["dollarmath", "amsmath", "deflist"]
myst_heading_anchors = 3

autosummary_generate = False
autodoc_typehints = "none"  # numpydoc has the shapes and units
autodoc_member_order = "bysource"
numpydoc_show_class_members = False
numpydoc_class_members_toctree = False


def public_modules() -> list[ModuleType]:
    """pcmc, its packages with public names, some modules in them, and the generators."""
    packages = [f"pcmc.{m.name}" for m in pkgutil.iter_modules(pcmc.__path__) if m.name != "cli"]
    names = ["pcmc", *sorted([*packages, *MODULES]), "generators"]
    return [module for module in map(importlib.import_module, names) if public_names(module)]


def public_names(module: ModuleType) -> list[str]:
    """The module's ``__all__``; without one, the classes and functions that it defines."""
    if hasattr(module, "__all__"):
        return list(module.__all__)
    own = [n for n, v in vars(module).items() if getattr(v, "__module__", "") == module.__name__]
    return [n for n in own if not n.startswith("_")]


def write_reference(folder: Path) -> None:
    """Write a page for each public module, with all the names in its ``__all__``.

    A name that several modules export is documented on the first one's page.
    """
    shutil.rmtree(folder, ignore_errors=True)
    folder.mkdir()
    documented: dict[int, str] = {}
    for module in public_modules():
        name = module.__name__
        public = {n: getattr(module, n) for n in public_names(module)}
        public = {n: value for n, value in public.items() if not isinstance(value, ModuleType)}
        elsewhere = [documented[id(v)] for v in public.values() if id(v) in documented]
        here = {n: value for n, value in public.items() if id(value) not in documented}
        documented |= {id(value): f"{name}.{n}" for n, value in here.items()}
        lines = [name, "=" * len(name), "", f".. automodule:: {name}", "   :no-index:", ""]
        if elsewhere:
            roles = ", ".join(f":py:obj:`{full}`" for full in elsewhere)
            lines += [f"Also exported here: {roles}.", ""]
        if here:
            lines += [f".. currentmodule:: {name}", "", ".. autosummary::", "   :nosignatures:", ""]
            lines += [f"   {n}" for n in here]
        for n, value in here.items():
            kind = "class" if isinstance(value, type) else "function" if callable(value) else "data"
            lines += ["", f".. auto{kind}:: {name}.{n}"]
            lines += ["   :members:"] if kind == "class" else []
        (folder / f"{name}.rst").write_text("\n".join(lines) + "\n", encoding="utf-8")


def copy_notebook(path: Path, folder: Path) -> None:
    """Copy a notebook; attached pictures become files, and links out of the folder lead to the report."""
    text = path.read_text(encoding="utf-8")
    for outside in ("../README.md", "../results/REPORT.md"):
        text = text.replace(f"]({outside})", "](../report.md)")
    notebook = json.loads(text)
    for cell in notebook["cells"]:
        for name, data in cell.pop("attachments", {}).items():
            (folder / name).write_bytes(base64.b64decode(data["image/png"]))
            cell["source"] = "".join(cell["source"]).replace(f"attachment:{name}", name)
    (folder / path.name).write_text(json.dumps(notebook), encoding="utf-8")


def generate() -> None:
    """Write all generated pages; ``.gitignore`` leaves them out."""
    for path in sorted((HOME / "notebooks").glob("*.ipynb")):
        copy_notebook(path, DOCS / "tutorial")
    shutil.copy(HOME / "notebooks" / "roof.toml", DOCS / "tutorial")
    picture(DOCS / "how-to" / "drawing-layers.png")
    keys = "# The keys of a project file\n\n" + reference()
    (DOCS / "how-to" / "project-keys.md").write_text(keys, encoding="utf-8")
    write_reference(DOCS / "reference" / "generated")


def split_entries(*arguments: Any) -> None:
    """Put the meaning of ``name : meaning`` on a line of its own: to numpydoc it would be the type."""
    lines = arguments[-1]
    section, out = "", []
    for line, following in zip(lines, [*lines[1:], ""], strict=False):
        if following and not following.strip("-"):
            section = line
        name, colon, meaning = line.partition(" : ")
        if section in ENTRIES and colon and not line.startswith(" "):
            out += [name, f"    {meaning}"]
        else:
            out.append(line)
    lines[:] = out


def escape_bars(*arguments: Any) -> None:
    """Escape the bars of formulas such as ``|H - H̄|`` in docstrings: to reStructuredText they are links."""
    lines = arguments[-1]
    for number, line in enumerate(lines):
        parts = line.split("``")
        if not line.lstrip().startswith((">>>", "...")):
            parts[::2] = [part.replace("|", r"\|") for part in parts[::2]]
        lines[number] = "``".join(parts)


def visit_math(self: SphinxTranslator, node: nodes.math) -> None:
    """Write a formula as MathML, which a browser shows without any script or network."""
    self.body.append(tex2mathml(node.astext(), as_block=isinstance(node, nodes.math_block)))
    raise nodes.SkipNode


def setup(app: Sphinx) -> None:
    """Generate the pages and choose MathML for formulas."""
    generate()
    app.connect("autodoc-process-docstring", split_entries, priority=100)  # before numpydoc
    app.connect("autodoc-process-docstring", escape_bars, priority=900)  # after numpydoc
    app.add_html_math_renderer("mathml", (visit_math, None), (visit_math, None))
    app.config.html_math_renderer = "mathml"
