"""A whole design in one TOML file: plan, solver, remeshing, targets, output.

A file becomes a ``Project`` (``load``, which meshes nothing), its ``Start``, an ``Outcome`` (``designed``),
and files (``run``); each is a value, made once. A drawing or a mesh alone is a project, too. Gives these to
sweep, page and command. May import ``plot`` and the subpackages below it.

``sections()`` lists every key of a project file; ``reference()`` prints the list; ``opened(path)`` is what is
in any file. A short one::

    units = "m"
    [plan]
    edge_length = 1.0
    outline = [[0, 0], [8, 0], [8, 4], [0, 4]]
    patches = {roof = {tension = 3.0}}
    [targets]
    meet = [{quantity = "apex", of = "roof", value = 1.0}]
    vary = ["roof"]
    [output]
    files = ["roof.obj", "roof.glb"]
"""

from .cache import cached_files
from .cache import clear as clear_cache
from .cache import folder as cache_folder
from .drawn import files_of, is_drawing
from .file import Project, is_project, load, project_of, read_data, with_rise
from .keys import json_schema, reference, sections
from .outcome import MOST_CHECKED, OnStep, Outcome
from .planning import drawing_reference, project_text, proposal_text
from .running import (
    analysis_jobs,
    check_outputs,
    designed,
    model_job,
    opened,
    paint,
    paint_families,
    run,
    run_project,
    schedule_jobs,
    surface_files,
    vertex_fields,
    write_all,
)
from .settings import (
    AccuracyWanted,
    Output,
    Remeshing,
    Structure,
    check_model,
    check_names,
    check_picture,
    schedule_paths,
)
from .solving import solve_project
from .start import Start, build, start_of, surface_of
from .varied import check_varied, digest, varied, with_loads

__all__ = ["AccuracyWanted", "MOST_CHECKED", "OnStep", "Outcome", "Output", "Project", "Remeshing", "Start"]
__all__ += ["Structure", "build", "cache_folder", "cached_files", "check_model", "check_names"]
__all__ += ["check_outputs", "check_picture", "check_varied", "clear_cache", "designed", "digest"]
__all__ += [
    "analysis_jobs",
    "drawing_reference",
    "files_of",
    "is_drawing",
    "is_project",
    "json_schema",
    "load",
    "model_job",
]
__all__ += ["opened", "paint", "paint_families", "project_of", "project_text", "proposal_text", "read_data"]
__all__ += ["reference", "run", "run_project", "schedule_jobs", "schedule_paths", "sections"]
__all__ += ["solve_project", "start_of", "surface_files", "surface_of", "varied", "vertex_fields"]
__all__ += ["with_loads", "with_rise", "write_all"]
