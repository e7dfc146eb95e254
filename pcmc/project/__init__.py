from .advising import firmer
from .cache import cached_files, clear_cache
from .designing import designed, opened, run, run_project
from .drawn import is_drawing
from .file import Project, load
from .keys import json_schema, reference, sections
from .outcome import Outcome
from .planning import project_text
from .settings import AccuracyWanted, Output, Remeshing, Structure
from .solving import solve_project
from .start import build, start_of, surface_of
from .varied import check_varied, digest, varied

__all__ = ["AccuracyWanted", "Outcome", "Output", "Project", "Remeshing", "Structure", "build"]
__all__ += ["cached_files", "check_varied", "clear_cache", "designed", "digest", "firmer", "is_drawing"]
__all__ += ["json_schema", "load", "opened", "project_text", "reference", "run", "run_project", "sections"]
__all__ += ["solve_project", "start_of", "surface_of", "varied"]
