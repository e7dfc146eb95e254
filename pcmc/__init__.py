"""Piecewise constant-mean-curvature surfaces: triangle meshes of patches in equilibrium.

The subpackages, from the ground up; each imports only from those above it in this list.

=========================  ==========================================================================
base                       errors, arrays, files, units, checks of input
surface                    lines, arcs, Béziers and planes as objects; what a surface is
forces                     E with its derivatives, its curvature, and walls that pinch
meshing                    triangulation, walls of a mesh, better and finer triangles
io plan                    surfaces from and to files; surfaces from the lines of a plan
stability certificate      lowest modes, Morse index; the verdict on a finished surface, a proof, its figures
solvers                    the paper's flow, L-BFGS, the geometric Newton solver; branches; further starts
accuracy                   error bars from finer meshes, meshes for an accuracy, margins to the edge
equilibria                 the other equilibria of a roof, and the barriers to them; cells of free size
design                     tensions that meet targets
compas                     meshes of COMPAS, and a server for them
panelling structure        families of panels; structural models
drawings cloth             sheets for those who build; cutting patterns of cloth
plot report                pictures, and pages for those who build
advice                     first tensions for a rise, and what to type where a roof fails
project                    a whole design in one file
sweep explore cli          many cases; the page; the command
=========================  ==========================================================================
"""

import sys
from importlib import import_module
from typing import TYPE_CHECKING

from .base import errors

if TYPE_CHECKING:
    from . import explore
    from .accuracy import Margin, MeshCheck, MeshVerdict, check_mesh, margin, solve_to_accuracy
    from .certificate import Certificate, Verdict, certify
    from .certificate.theorem import Theorem, verify
    from .cloth import CuttingPattern, cutting_pattern
    from .design import Design, Parameter, Target, meet, sensitivities
    from .equilibria import Equilibria, cell_stress, find_equilibria, free_cell
    from .forces.curvature import curvature_error, mean_curvature, target_curvature
    from .forces.functional import energy, gradient
    from .forces.rooms import room_volume_gradients, room_volumes
    from .forces.second_variation import hessian
    from .io import read, write
    from .io.repairing import Repaired, repair
    from .panelling import FewerFamilies, PanelNet, Panels, fewer_families, panel_net, panels
    from .solvers import solve
    from .solvers.continuation import BoundaryMotion, Direction, follow
    from .solvers.neighbours import NeighbourSwap, swap_neighbours
    from .structure import Material, Member, Profile, StructuralModel, analyse, read_results, write_structure
    from .structure.gas import Gas
    from .structure.loads import SelfWeight, Snow, Wind
    from .surface import Cable, Circle, Line, Patch, Plane, Room, Surface, cut, images_in, mirrored

__all__ = ["BoundaryMotion", "Cable", "Certificate", "Circle", "CuttingPattern", "Design", "Direction"]
__all__ += ["Equilibria", "FewerFamilies", "Gas", "Line", "Margin", "Material", "Member", "MeshCheck"]
__all__ += ["MeshVerdict", "NeighbourSwap", "PanelNet", "Panels", "Parameter", "Patch", "Plane", "Profile"]
__all__ += ["Repaired", "Room", "SelfWeight", "Snow", "StructuralModel", "Surface", "Target", "Theorem"]
__all__ += ["Verdict", "Wind", "analyse", "cell_stress", "certify", "check_mesh", "curvature_error", "cut"]
__all__ += ["cutting_pattern", "energy", "errors", "explore", "fewer_families", "find_equilibria", "follow"]
__all__ += ["free_cell", "gradient", "hessian", "images_in", "margin", "mean_curvature", "meet", "mirrored"]
__all__ += ["panel_net", "panels", "read", "repair", "read_results", "room_volume_gradients", "room_volumes"]
__all__ += ["sensitivities", "solve", "solve_to_accuracy", "swap_neighbours", "target_curvature", "verify"]
__all__ += ["write", "write_structure"]

# Each name is imported at its first use. So ``import pcmc`` takes milliseconds, and the command can
# handle Ctrl-C before numpy and scipy are imported.
_NAMES = {
    "accuracy": "Margin MeshCheck MeshVerdict check_mesh margin solve_to_accuracy",
    "certificate": "Certificate Verdict certify",
    "cloth": "CuttingPattern cutting_pattern",
    "design": "Design Parameter Target meet sensitivities",
    "forces.curvature": "curvature_error mean_curvature target_curvature",
    "forces.functional": "energy gradient",
    "forces.second_variation": "hessian",
    "forces.rooms": "room_volume_gradients room_volumes",
    "equilibria": "Equilibria cell_stress find_equilibria free_cell",
    "io": "read write",
    "io.repairing": "Repaired repair",
    "structure": "Material Member Profile StructuralModel analyse read_results",
    "structure.inp": "write_structure",
    "structure.gas": "Gas",
    "structure.loads": "SelfWeight Snow Wind",
    "solvers": "solve",
    "solvers.continuation": "BoundaryMotion Direction follow",
    "solvers.neighbours": "NeighbourSwap swap_neighbours",
    "panelling": "FewerFamilies PanelNet Panels fewer_families panel_net panels",
    "surface": "Cable Circle Line Patch Plane Room Surface cut images_in mirrored",
    "certificate.theorem": "Theorem verify",
}


if not TYPE_CHECKING:

    def __getattr__(name: str) -> object:
        for module, names in _NAMES.items():
            if name in names.split():
                globals()[name] = value = getattr(import_module(f".{module}", __name__), name)
                return value
        from importlib.util import find_spec

        if find_spec(f"{__name__}.{name}") is not None:
            return import_module(f".{name}", __name__)
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")

    def _cell_html(value: object) -> str:
        return import_module(".plot.pictures", __name__).cell_html(value)

    if "IPython" in sys.modules:  # a notebook: its cells show surfaces as pictures
        _shell = sys.modules["IPython"].get_ipython()
        if _shell is not None:
            _html = _shell.display_formatter.formatters["text/html"]
            _html.for_type_by_name("pcmc.surface.surface", "Surface", _cell_html)
            _html.for_type_by_name("pcmc.solvers.result", "Result", _cell_html)
            _html.for_type_by_name("pcmc.design.outcome", "Design", _cell_html)
            _html.for_type_by_name("pcmc.project.outcome", "Outcome", _cell_html)
            _html.for_type_by_name("pcmc.accuracy.adaptive", "AccurateResult", _cell_html)

    def __dir__() -> list[str]:
        return sorted({*globals(), *__all__})
