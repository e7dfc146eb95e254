"""A small project of one patch, and changes of its text."""

WITH_UNITS = """
units = "m"
force = "kN"
[plan]
edge_length = 1.0
outline = [[0, 0], [4, 0], [4, 3], [0, 3]]
patches = {roof = {tension = 2.0}}
"""
SMALL = """
[plan]
edge_length = 1.0
outline = [[0, 0], [4, 0], [4, 3], [0, 3]]
patches = {roof = {tension = 2.0}}

[solve]
method = "newton"

[output]
files = ["roof.pcmc", "roof.obj"]
"""

HALL_WITH_ARCH = """
units = "m"
force = "kN"
[plan]
edge_length = 1.6
outline = [[0, 0], [12, 0], [12, 8], [0, 8]]
patches = {west = {tension = 1.5, pressure = 0.3}, east = {tension = 1.5, pressure = 0.3}}
dividers = [{curve = [[6, 0], [6, 8]], wall = 0.6, member = "arch"}]
[structure]
young = 5e5
thickness = 0.001
[structure.members.arch]
diameter = 0.1
thickness = 0.005
young = 2.1e8
[output]
files = ["hall.ifc", "hall.obj"]
drawings = ["hall.dxf"]
"""
PLACE = '[output.georeference]\ncrs = "EPSG:25832"\neastings = 691000.0\n'


def changed(path, old, new):
    """The file with another text in place of ``old``, which it must have."""
    text = path.read_text(encoding="utf-8")
    assert old in text
    path.write_text(text.replace(old, new), encoding="utf-8")
    return path
