"""A drawing set as a DXF document, and its sheets as SVG."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

import numpy as np

from ..base.arrays import Floats
from ..base.libraries import load_library
from ..base.units import TABLE, length_factor
from .sheet import LAYERS, MEMBERS, SMALL, Sheet

VERSION = "R2018"
MODEL_TEXT, MODEL_MARK = 0.004, 0.02  # heights of letters in the model, in its size
DIMENSION = {"dimtxt": SMALL, "dimtxsty": "PCMC", "dimtad": 1, "dimgap": 0.6, "dimtsz": 0.8, "dimexo": 1.0}
DIMENSION |= {"dimexe": 1.0, "dimtix": 1, "dimtoh": 0, "dimtih": 0, "dimdsep": ord("."), "dimzin": 0}


def document(drawings: Any) -> Any:
    """The model of a ``DrawingSet``, in its unit, and a layout per sheet, in mm, with its title as name.

    The model has ridges, rims, wall lines, cables and sections as polylines with the names of their patches
    or cable (XDATA of "PCMC"), members on layers of their own, with section and force, panels as 3D faces,
    setting-out points and supports of one point; beside the roof the panels flat at true size.
    """
    doc = load_library("ezdxf", "cad").new(VERSION)
    units = drawings.units
    doc.units = TABLE[units].dxf
    doc.header["$MEASUREMENT"] = int(units not in ("ft", "in"))
    doc.styles.add("PCMC", font="LiberationSans-Regular.ttf")
    doc.dimstyles.new("PCMC", dxfattribs=DIMENSION)
    doc.appids.add("PCMC")
    for name, layer in LAYERS.items():
        doc.layers.add(name, color=layer.color, lineweight=layer.weight).description = layer.about
    _add_model(doc.modelspace(), drawings)
    taken = {"model"}
    for number, sheet in enumerate(drawings.sheets):
        name = layout_name(sheet.title, taken)
        if number == 0:  # the one that every document has
            doc.layouts.rename("Layout1", name)
        layout = doc.layouts.new(name) if number else doc.layouts.get(name)
        layout.page_setup(size=sheet.size, margins=(0, 0, 0, 0), units="mm")
        _add_sheet(layout, sheet)
    return doc


def layout_name(title: str, taken: set[str]) -> str:
    """A name for a layout that no other in ``taken`` has; it is added to these.

    >>> taken = set()
    >>> [layout_name(title, taken) for title in ("Plan", "Panels 1 to 9 at true size, outside up", "Plan")]
    ['Plan', 'Panels 1 to 9', 'Plan 2']
    """
    short = layer_name(re.split(" at true size|:", title)[0])
    names = (short if k == 1 else f"{short} {k}" for k in range(1, len(taken) + 2))
    name = next(name for name in names if name.lower() not in taken)
    taken.add(name.lower())
    return name


def layer_name(text: str) -> str:
    """The text without the signs that names in a DXF file cannot have.

    >>> layer_name("wall: 1/2")
    'wall  1 2'
    """
    return re.sub(r'[<>/\\":;?*|,=`\']', " ", text)[:200].strip()


def _add_model(space: Any, model: Any) -> None:
    surface = model.surface
    low, high = surface.vertices.min(axis=0), surface.vertices.max(axis=0)
    for corners in surface.vertices[surface.faces[surface.roof[surface.patch_of_face]]].tolist():
        space.add_3dface(corners, dxfattribs={"layer": "PCMC-PANEL"})
    for line in (*model.curves, *model.sections):
        layer, about = line.layer, model.members.get(line.name, {}) if line.layer == MEMBERS else {}
        if about:  # a layer of its own, like that of all members
            layer = layer_name(f"{MEMBERS}-{line.name}")
            if layer not in space.doc.layers:
                space.doc.layers.add(layer, color=LAYERS[MEMBERS].color, lineweight=LAYERS[MEMBERS].weight)
        entity = space.add_polyline3d(line.points.tolist(), close=line.closed, dxfattribs={"layer": layer})
        texts = [line.name, *(f"{key}: {text}" for key, text in about.items() if key != "member")]
        entity.set_xdata("PCMC", [(1000, text[:250]) for text in texts])
    height = MODEL_TEXT * surface.size
    labels = [(name, at, "PCMC-POINT") for name, *at in model.points[["point", *"xyz"]].to_numpy().tolist()]
    labels += [(name, at.tolist(), "PCMC-SUPPORT") for name, at in model.marks]
    for name, at, layer in labels:
        space.add_point(at, dxfattribs={"layer": layer})
        text = space.add_text(name, height=height, dxfattribs={"layer": layer, "style": "PCMC"})
        text.set_placement((at[0] + 0.3 * height, at[1] + 0.3 * height, at[2]))
    if mark := model.certificate.mark or model.mark:
        at = MODEL_MARK * surface.size
        text = space.add_text(mark, height=at, dxfattribs={"layer": "PCMC-MARK", "style": "PCMC"})
        text.set_placement((low[0], low[1] - 2.0 * at, low[2]))
    if model.flat is not None:
        millimetres = length_factor(model.units, "mm")
        every = np.concatenate([line.points for line in model.flat.lines]) / millimetres
        place = np.array([high[0] + 0.1 * surface.size, low[1]]) - every.min(axis=0)
        _add_sheet(space, model.flat, 1.0 / millimetres, place)


def _add_sheet(space: Any, sheet: Sheet, scale: float = 1.0, shift: Floats | float = 0.0) -> None:
    """What is on a sheet, in millimetres, in a layout, or scaled and shifted in the model."""
    from ezdxf.enums import TextEntityAlignment

    for line in sheet.lines:
        points = (scale * line.points + shift).tolist()
        space.add_lwpolyline(points, close=line.closed, dxfattribs={"layer": line.layer})
    for text in sheet.texts:
        align = {"L": "MIDDLE_LEFT", "C": "MIDDLE_CENTER", "R": "MIDDLE_RIGHT"}[text.align]
        look = {"layer": text.layer, "style": "PCMC", "rotation": text.turn}
        plain = text.text.replace("%%", 2 * "%%%").replace("^", "^ ")  # else %%c is ⌀, and ^J a line break
        entity = space.add_text(plain, height=scale * text.height, dxfattribs=look)
        entity.set_placement((scale * np.array(text.at) + shift).tolist(), align=TextEntityAlignment[align])
    for start, end, axis, at, unit, decimals in sheet.dimensions:  # they measure in the unit of the roof
        style = {"dimstyle": "PCMC", "override": {"dimlfac": unit, "dimdec": decimals}}
        look = {"angle": 90.0 * axis, "dxfattribs": {"layer": "PCMC-DIM"}}
        space.add_linear_dim([at, at], start.tolist(), end.tolist(), **style, **look).render()


def write_svg(doc: Any, number: int, path: Path) -> None:
    """A sheet, counted from 0, as an SVG file of its true size."""
    from ezdxf.addons.drawing import Frontend, RenderContext, layout, svg
    from ezdxf.addons.drawing.config import BackgroundPolicy, ColorPolicy, Configuration

    backend, sheet = svg.SVGBackend(), doc.layouts.get(doc.layouts.names_in_taborder()[number + 1])
    look = Configuration(background_policy=BackgroundPolicy.WHITE, color_policy=ColorPolicy.COLOR)
    Frontend(RenderContext(doc), backend, config=look).draw_layout(sheet)
    size, none = (sheet.dxf.paper_width, sheet.dxf.paper_height), layout.Margins.all(0.0)
    page = layout.Page(*size, layout.Units.mm, none)
    text = backend.get_string(page, settings=layout.Settings(scale=1.0, fit_page=False))
    path.write_text(text, encoding="utf-8")
