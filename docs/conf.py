"""The documentation's settings, and the pages that are generated at each build.

Generated: the tutorial (copies of the notebooks), the keys of a project file, the command line, the gallery
(from the scripts in ``pictures``), and the reference. Each is written once, in its source.
"""

from __future__ import annotations

import ast
import base64
import importlib
import importlib.metadata
import inspect
import json
import pkgutil
import re
import shutil
from pathlib import Path
from types import ModuleType
from typing import Any

import typer
from docutils import nodes
from docutils.utils.math.latex2mathml import tex2mathml
from sphinx.application import Sphinx
from sphinx.util.docutils import SphinxTranslator

import pcmc
from pcmc.cli.app import app as command_line
from pcmc.project import reference

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
GALLERY = (  # scripts in ``pictures`` that the gallery shows, in this order
    "hall",
    "courtyard",
    "from_drawing",
    "canopy",
    "dome",
    "snow",
    "mirrored",
    "own_mesh",
    "remeshing",
    "error",
    "mesh_check",
    "curved",
    "fold",
    "equilibria",
    "sweep",
    "load_case",
    "under_load",
    "slack",
    "members",
    "cloth_strain",
    "cloth_sheet",
    "drawings",
    "report",
)
BAR = re.compile(r"<mo[^>]*>([|‖])</mo>")  # left and right alike: a browser draws one of them taller
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
html_sidebars = {"index": [], "installation": [], "gallery": [], "glossary": [], "bibliography": []}
html_theme_options = {
    "secondary_sidebar_items": ["page-toc"],
    "footer_end": [],
    "header_links_before_dropdown": 7,
}

nb_execution_mode = "off"
myst_enable_extensions = ["dollarmath", "amsmath", "deflist", "colon_fence"]
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
        text = text.replace(f"]({outside})", "](../comparison.md)")
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
    keys = "# The keys of a project file\n\n" + reference()
    (DOCS / "how-to" / "project-keys.md").write_text(keys, encoding="utf-8")
    (DOCS / "reference" / "command-line.md").write_text(commands(), encoding="utf-8")
    (DOCS / "gallery.md").write_text(gallery(), encoding="utf-8")
    write_reference(DOCS / "reference" / "generated")


def commands() -> str:
    """The page of the command line, from the command itself."""
    group = typer.main.get_command(command_line)
    lines = ["# The command line", "", *help_of(group), "", "| command | what it does |", "|---|---|"]
    listed = {name: command for name, command in group.commands.items() if not command.hidden}
    for name, command in listed.items():
        lines.append(f"| [`pcmc {name}`](#pcmc-{name}) | {command.short_help} |")
    for name, command in listed.items():
        lines += ["", f"## pcmc {name}", "", *help_of(command), ""]
        for title, kind in (("argument", "argument"), ("option", "option")):
            rows = [
                row(p)
                for p in command.params
                if p.param_type_name == kind and not getattr(p, "hidden", False)
            ]
            lines += [f"| {title} | meaning |", "|---|---|", *rows, ""] if rows else []
    return "\n".join(lines) + "\n"


def help_of(command: Any) -> list[str]:
    """The help of a command in Markdown; its indented examples become a block."""
    lines: list[str] = []
    for part in inspect.cleandoc(command.help or "").replace("\b\n", "").split("\n\n"):
        title, _, rest = part.partition("\n")
        examples = [line.strip() for line in rest.splitlines()]
        if title.strip() in ("Examples:", "Example:") and examples:
            lines += ["```sh", *examples, "```", ""]
        else:
            lines += [" ".join(part.split()), ""]
    return lines


def row(parameter: Any) -> str:
    """A row of the table of options: names, value, and meaning."""
    names = [*parameter.opts, *parameter.secondary_opts]
    if parameter.param_type_name == "argument":
        names = [parameter.metavar or parameter.name.upper()]
    value = (
        "" if parameter.param_type_name == "argument" or parameter.is_flag else f" {parameter.metavar or ''}"
    )
    meaning = " ".join(str(parameter.help or "").split()).replace("|", "\\|")
    return "| " + ", ".join(f"`{name}{value.rstrip()}`" for name in names) + f" | {meaning} |"


def gallery() -> str:
    """The page of thumbnails; behind each stand the picture and the script that draws it."""
    lines = ["# Gallery", "", "Each picture comes from the script beside it. Copy one and change it.", ""]
    lines += [":::::{container} thumbnails"]
    for name in GALLERY:
        lines += [":::{figure} pictures/" + name + ".png", f':target: "#{label(name)}"', ":::"]
    lines += [":::::", ""]
    for name in GALLERY:
        meaning = ast.get_docstring(ast.parse((DOCS / "pictures" / f"{name}.py").read_text(encoding="utf-8")))
        lines += [f"## {label(name).replace('-', ' ').capitalize()}", "", str(meaning), ""]
        lines += [f"```{{image}} pictures/{name}.png", f":alt: {meaning}", "```", ""]
        lines += [f"```{{literalinclude}} pictures/{name}.py", ":lines: 3-", "```", ""]
    return "\n".join(lines)


def label(name: str) -> str:
    """The name of a script as the anchor of its section."""
    return name.replace("_", "-")


def split_entries(*arguments: Any) -> None:
    """Put the meaning of ``name : meaning`` on a line of its own: to numpydoc it would be the type.

    An example that follows a section gets its heading: to numpydoc it would be an entry of the section.
    """
    lines = arguments[-1]
    section, out = "", []
    for line, following in zip(lines, [*lines[1:], ""], strict=False):
        if following and not following.strip("-"):
            section = line
        if section in ENTRIES and line.startswith(">>>"):
            section = "Examples"
            out += [section, "-" * len(section), ""]
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
    block = isinstance(node, nodes.math_block)
    formula = BAR.sub(
        r'<mo stretchy="false" lspace="0" rspace="0">\1</mo>', tex2mathml(node.astext(), as_block=block)
    )
    self.body.append(f'<div class="formula">{formula}</div>' if block else formula)
    raise nodes.SkipNode


def setup(app: Sphinx) -> None:
    """Generate the pages and choose MathML for formulas."""
    generate()
    app.connect("autodoc-process-docstring", split_entries, priority=100)  # before numpydoc
    app.connect("autodoc-process-docstring", escape_bars, priority=900)  # after numpydoc
    app.add_html_math_renderer("mathml", (visit_math, None), (visit_math, None))
    app.config.html_math_renderer = "mathml"
