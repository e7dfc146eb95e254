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


def changed(path, old, new):
    """The file with another text in place of ``old``, which it must have."""
    text = path.read_text(encoding="utf-8")
    assert old in text
    path.write_text(text.replace(old, new), encoding="utf-8")
    return path
