"""Surfaces from files and to files, by suffix: a file here per format.

Gives ``read``, ``write``, ``load`` and ``Georeference``. May import ``meshing`` and the subpackages below it.
"""

from .formats import FORMATS, READ_ONLY, metres_note
from .georeference import Georeference
from .reading import load, read, read_bare
from .writing import write

__all__ = ["FORMATS", "READ_ONLY", "Georeference", "load", "metres_note", "read", "read_bare", "write"]
