"""Pictures that cannot be, and libraries that are missing."""

import sys

import numpy as np
import pandas as pd
import pytest
from refusals import refused
from tents import tent

from generators import double_bubble
from pcmc import plot
from pcmc.base.errors import FileError, MissingExtra, OptionError
from pcmc.plot import scene as raster

BAD = [
    (lambda s: plot.draw(s, view="diagnal"), {"what": "view", "found": "diagnal"}),
    (lambda s: plot.draw(s, renderer="povray"), {"what": "renderer", "found": "povray"}),
    (lambda s: plot.draw(s, scalars=np.zeros(s.n), cmap="virdis"), {"what": "cmap"}),
    (lambda s: plot.draw(s, scalars=np.zeros(s.n), limits=(1.0, 1.0)), {"what": "limits"}),
    (
        lambda s: plot.draw(s, scalars=[1, 2, 3]),
        {"what": "scalars", "found": (3,), "expected": "shape (10,) or (12,)"},
    ),
    (
        lambda s: plot.draw(s, numbers=np.zeros(s.m)),
        {"what": "numbers", "found": (12,), "expected": "shape (10,)"},
    ),
    (lambda s: plot.panel([]), {"what": "surfaces", "found": 0}),
    (
        lambda s: plot.panel([s, s], titles=["one"]),
        {"what": "titles", "found": 1, "expected": "2, one per surface"},
    ),
    (
        lambda s: plot.panel([s, s], views=["plan"]),
        {"what": "views", "found": 1, "expected": "2, one per surface"},
    ),
    (
        lambda s: plot.reactions(double_bubble()),
        {"what": "surface"},
    ),
    (lambda s: plot.vectors(s, np.zeros(10)), {"what": "field", "found": (10,)}),
    (
        lambda s: plot.histories({"a": pd.DataFrame({"energy": [1.0]})}, y="enrgy"),
        {"what": "history", "where": "a", "found": "enrgy"},
    ),
    (lambda s: plot.lines({"a": ([1], [1])}, xscale="cubic"), {"what": "scale", "found": "cubic"}),
    (lambda s: plot.lines({"a": ([1, 2], [1])}), {"what": "curves", "where": "a"}),
    (
        lambda s: plot.heatmap([1, 2], [1], {"a": [[1]]}),
        {"what": "tables", "where": "a", "found": (1, 1), "expected": "shape (1, 2), (len(y), len(x))"},
    ),
    (lambda s: plot.heatmap([1], [1], {}), {"what": "tables", "found": 0}),
    (lambda s: plot.heatmap([1], [1], {"a": [[1]]}, marks={"b": [[True]]}), {"what": "marks", "where": "b"}),
    (lambda s: plot.heatmap([1], [1], {"a": [[1]]}, cmap="no"), {"what": "cmap", "found": "no"}),
]


@pytest.mark.parametrize(("act", "fields"), BAD)
def test_bad_input_is_named(act, fields):
    with refused(OptionError, **fields):
        act(tent())


def test_a_misspelt_patch_or_colour_map_is_answered_with_the_nearest():
    with pytest.raises(OptionError, match="unknown patch 'wal'; did you mean 'wall'"):
        plot.draw(tent(), patches=["wal"])
    with pytest.raises(OptionError, match="unknown cmap 'virdis'; did you mean 'viridis'"):
        plot.draw(tent(), scalars=np.zeros(10), cmap="virdis")


def test_bad_paths_leave_nothing(tmp_path):
    with refused(FileError, what=str(tmp_path / "a.gif"), expected=(".png", ".svg", ".pdf")):
        plot.draw(tent(), tmp_path / "a.gif")
    with refused(FileError, what=str(tmp_path / "no folder" / "a.png")):
        plot.draw(tent(), tmp_path / "no folder" / "a.png")
    assert not list(tmp_path.iterdir())


def test_missing_libraries_are_named(monkeypatch):
    raster.opengl.cache_clear()
    monkeypatch.setitem(sys.modules, "pyvista", None)
    with pytest.raises(MissingExtra, match=r"pyvista is not installed.*pcmc-surfaces\[plot\]"):
        plot.draw(tent(), renderer="pyvista")
    monkeypatch.setitem(sys.modules, "matplotlib", None)
    monkeypatch.setitem(sys.modules, "matplotlib.backends.backend_agg", None)
    with pytest.raises(MissingExtra, match="matplotlib is not installed"):
        plot.lines({})


def test_without_opengl_matplotlib_paints(monkeypatch):
    monkeypatch.setattr(raster, "opengl", lambda: False)
    monkeypatch.setattr(raster, "_with_pyvista", lambda *_: pytest.fail("asked for OpenGL"))
    monkeypatch.setattr(raster, "MANY", 1)
    assert plot.draw(tent(), width=300).shape[1] == 300


def test_only_many_triangles_ask_for_opengl(monkeypatch):
    monkeypatch.setattr(raster, "opengl", lambda: pytest.fail("asked for OpenGL"))
    assert plot.draw(tent(), width=300).shape[1] == 300
    asked = []
    monkeypatch.setattr(raster, "opengl", lambda: asked.append(True))
    monkeypatch.setattr(raster, "MANY", 1)
    plot.draw(tent(), width=300)
    assert asked


def test_a_picture_of_one_surface_takes_no_titles():
    with pytest.raises(TypeError, match="multiple values for keyword argument 'titles'"):
        plot.draw(tent(), titles=["east"])
