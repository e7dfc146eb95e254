"""A whole design in one TOML file: plan, solver, remeshing, targets and what is written.

::

    [plan]                    # keys as of pcmc.plan.Plan
    edge_length = 1.0
    outline = [[0, 0], [8, 0], [8, 4], [0, 4]]
    patches = {roof = {tension = 3.0}}

    [solve]                   # method, and the options of the method
    target = "minimum"

    [remesh]                  # optional: keys as of pcmc.remesh.remesh, and when
    edge_length = 0.5
    when = "after"            # solved, remeshed, solved again; or "before" it is solved

    [targets]                 # optional
    meet = [{quantity = "apex", of = "roof", value = 1.0}]
    vary = ["roof"]

    [output]
    files = ["roof.obj", "roof.glb"]
    picture = "roof.png"
"""

from .file import Project, build, load, surface_of
from .output import COLOURS, check_names, check_outputs, check_picture, paint, save, write_all
from .remeshing import Remeshing
from .running import Outcome, carry_out, reporter, run, settle, uninterrupted
from .varied import check_varied, digest, is_project, varied

__all__ = [
    "COLOURS",
    "Outcome",
    "Project",
    "Remeshing",
    "build",
    "carry_out",
    "check_names",
    "check_outputs",
    "check_picture",
    "check_varied",
    "digest",
    "is_project",
    "load",
    "paint",
    "reporter",
    "run",
    "save",
    "settle",
    "surface_of",
    "uninterrupted",
    "varied",
    "write_all",
]
