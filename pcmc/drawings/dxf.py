"""A drawing set as a DXF document, and its sheets as SVG."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any, NamedTuple

import pandas as pd

from ..base.errors import MissingExtra
from ..base.units import TABLE
from ..surface import Surface
from .sections import Polyline
from .sheet import LAYERS, Sheet, Text
from .views import Curve, section_layer

VERSION = "R2018"
MODEL_TEXT = 0.004  # height of letters in the model, in its size


class Model(NamedTuple):
    """What is drawn in three dimensions: see ``DrawingSet``."""

    surface: Surface
    curves: Sequence[Curve]
    sections: Sequence[Polyline]
    points: pd.DataFrame


def _ezdxf() -> Any:
    try:
        import ezdxf
    except ImportError:
        raise MissingExtra("ezdxf", "cad") from None
    return ezdxf


def document(model: Model, units: str, sheets: Sequence[Sheet]) -> Any:
    """The model, in the surface's unit, and a layout per sheet, in millimetres.

    The model has ridges, rims, wall lines and sections as polylines, panels as 3D faces and the setting-out
    points, each on the layer of its kind.
    """
    ezdxf = _ezdxf()
    doc = ezdxf.new(VERSION)
    doc.units = TABLE[units].dxf
    doc.header["$MEASUREMENT"] = int(units not in ("ft", "in"))
    doc.styles.add("PCMC", font="LiberationSans-Regular.ttf")
    for name, layer in LAYERS.items():
        entry = doc.layers.add(name, color=layer.color, lineweight=layer.weight)
        entry.description = layer.about
    _add_model(doc.modelspace(), model)
    for number, sheet in enumerate(sheets, start=1):
        name = f"{number:03d}"
        if number == 1:
            doc.layouts.rename("Layout1", name)
            layout = doc.layouts.get(name)
        else:
            layout = doc.layouts.new(name)
        layout.page_setup(size=sheet.size, margins=(0, 0, 0, 0), units="mm")
        _add_sheet(layout, sheet)
    return doc


def _add_model(space: Any, model: Model) -> None:
    surface = model.surface
    roof = surface.roof[surface.patch_of_face]
    for corners in surface.vertices[surface.faces[roof]].tolist():
        space.add_3dface(corners, dxfattribs={"layer": "PCMC-PANEL"})
    for curve in model.curves:
        space.add_polyline3d(curve.points.tolist(), close=curve.closed, dxfattribs={"layer": curve.layer})
    for line in model.sections:
        layer = section_layer(surface, line)
        space.add_polyline3d(line.points.tolist(), close=line.closed, dxfattribs={"layer": layer})
    height = MODEL_TEXT * surface.size
    look = {"layer": "PCMC-POINT"}
    for name, x, y, z in model.points[["point", "x", "y", "z"]].to_numpy().tolist():
        space.add_point((x, y, z), dxfattribs=look)
        text = space.add_text(name, height=height, dxfattribs={**look, "style": "PCMC"})
        text.set_placement((x + 0.3 * height, y + 0.3 * height, z))


def _add_sheet(layout: Any, sheet: Sheet) -> None:
    for line in sheet.lines:
        layout.add_lwpolyline(line.points.tolist(), close=line.closed, dxfattribs={"layer": line.layer})
    for text in sheet.texts:
        _add_text(layout, text)


def _add_text(layout: Any, text: Text) -> None:
    from ezdxf.enums import TextEntityAlignment

    align = {"L": "MIDDLE_LEFT", "C": "MIDDLE_CENTER", "R": "MIDDLE_RIGHT"}[text.align]
    look = {"layer": text.layer, "style": "PCMC", "rotation": text.turn}
    entity = layout.add_text(text.text, height=text.height, dxfattribs=look)
    entity.set_placement(text.at, align=TextEntityAlignment[align])


def write_dxf(doc: Any, path: Path) -> None:
    """The document as a DXF file."""
    doc.saveas(path)


def write_svg(doc: Any, number: int, path: Path) -> None:
    """A sheet, counted from 0, as an SVG file of its true size."""
    from ezdxf.addons.drawing import Frontend, RenderContext, layout, svg

    backend = svg.SVGBackend()
    sheet = _layouts(doc)[number]
    Frontend(RenderContext(doc), backend, config=_configuration()).draw_layout(sheet)
    width, height = sheet.dxf.paper_width, sheet.dxf.paper_height
    page = layout.Page(width, height, layout.Units.mm, layout.Margins.all(0.0))
    text = backend.get_string(page, settings=layout.Settings(scale=1.0, fit_page=False))
    path.write_text(text, encoding="utf-8")


def _layouts(doc: Any) -> list[Any]:
    """The layouts of the sheets, in order."""
    return [doc.layouts.get(name) for name in doc.layouts.names_in_taborder() if name != "Model"]


def _configuration() -> Any:
    from ezdxf.addons.drawing.config import BackgroundPolicy, ColorPolicy, Configuration

    return Configuration(background_policy=BackgroundPolicy.WHITE, color_policy=ColorPolicy.COLOR)
