"""A whole design in one TOML file: plan, solver, remeshing, targets, output.

A file becomes a ``Project`` (``load``, which meshes nothing), an ``Outcome`` (``start_of``, ``designed``),
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

from .cache import cache_folder, cached_files, clear_cache
from .drawn import files_of, is_drawing
from .file import Project, is_project, load, project_of, read_data, with_rise
from .keys import json_schema, reference, sections
from .outcome import MOST_CHECKED, OnStep, Outcome
from .planning import drawing_reference, project_text, proposal_text
from .running import designed, opened, run, run_project
from .settings import (
    AccuracyWanted,
    Output,
    Remeshing,
    Structure,
    check_names,
    of_material,
    schedule_paths,
)
from .solving import solve_project
from .start import build, start_of, surface_of
from .varied import check_varied, digest, varied, with_loads
from .writing import (
    analysis_jobs,
    certified_files,
    check_outputs,
    draw_picture,
    model_job,
    paint_families,
    paint_strain,
    schedule_jobs,
    surface_files,
    write_all,
)

__all__ = ["AccuracyWanted", "MOST_CHECKED", "OnStep", "Outcome", "Output", "Project", "Remeshing"]
__all__ += ["Structure", "analysis_jobs", "build", "cache_folder", "cached_files", "certified_files"]
__all__ += ["check_names", "check_outputs", "check_varied", "clear_cache", "designed", "digest"]
__all__ += ["draw_picture", "drawing_reference", "files_of", "is_drawing", "is_project", "json_schema"]
__all__ += [
    "load",
    "model_job",
    "of_material",
    "opened",
    "paint_families",
    "paint_strain",
    "project_of",
    "project_text",
    "proposal_text",
]
__all__ += ["read_data", "reference", "run", "run_project", "schedule_jobs", "schedule_paths", "sections"]
__all__ += ["solve_project", "start_of", "surface_files", "surface_of", "varied", "with_loads", "with_rise"]
__all__ += ["write_all"]
