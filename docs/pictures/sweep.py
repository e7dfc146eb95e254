"""A sweep over two tensions: the height of the roof for each pair."""

from pathlib import Path

from pcmc.cli import main

HALL = """
units = "m"
force = "kN"
[plan]
edge_length = 0.8
outline = [[0, 0], [12, 0], [12, 8], [0, 8]]
dividers = [{curve = [[6, 0], [6, 8]], wall = 1.5}]
[plan.patches]
west = {tension = 5.0}
east = {tension = 4.5}
"""
Path("sweep.toml").write_text(HALL, encoding="utf-8")
west, east = "west.tension=4,4.5,5,5.5,6", "east.tension=4,5,6"
main(["sweep", "sweep.toml", west, east, "--plot", "sweep.png"])
