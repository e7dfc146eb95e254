"""A whole design in one TOML file: plan, solver, remeshing, targets, output.

Gives ``run`` and ``load`` to sweeps, the page and the command. May import ``plot`` and the rooms below it.

``sections()`` lists every section and key of a project file; ``reference()`` prints the list::

    [plan]
    edge_length = 1.0
    outline = [[0, 0], [8, 0], [8, 4], [0, 4]]
    patches = {roof = {tension = 3.0}}

    [solve]                   # the solver and its options
    target = "minimum"

    [remesh]                  # optional
    edge_length = 0.5
    when = "after"            # solved, remeshed, solved again; or "before" solving

    [targets]                 # optional
    meet = [{quantity = "apex", of = "roof", value = 1.0}]
    vary = ["roof"]

    [output]
    files = ["roof.obj", "roof.glb"]
    picture = "roof.png"
"""

from .file import Project, build, load, surface_of
from .keys import REQUIRED, Key, Section, reference, sections
from .output import COLOURS, OnStep, check_names, check_outputs, check_picture, paint, write_all
from .remeshing import Remeshing
from .running import Outcome, check_of, check_project_mesh, run, run_project, solve_project
from .varied import check_varied, digest, is_project, varied

__all__ = [
    "COLOURS",
    "REQUIRED",
    "Key",
    "OnStep",
    "Outcome",
    "Project",
    "Remeshing",
    "Section",
    "build",
    "check_names",
    "check_of",
    "check_outputs",
    "check_project_mesh",
    "check_picture",
    "check_varied",
    "digest",
    "is_project",
    "load",
    "paint",
    "reference",
    "run",
    "run_project",
    "sections",
    "solve_project",
    "surface_of",
    "varied",
    "write_all",
]
