"""A project whose numbers are swept."""

NUMBERS = ["west.apex", "east.apex", "rise", "area", "reaction per length"]
TEXT = """
[plan]
edge_length = 1.5                 # coarse: these are tests
outline = [[0, 0], [6, 0], [6, 4], [0, 4]]
dividers = [{curve = [[3, 0], [3, 4]], wall = 0.8, bottom = "held"}]
holes = [{name = "yard", curve = {circle = {centre = [1.5, 2], radius = 0.4}}}]

[plan.patches]
west = {tension = 3.0, at = [0.5, 0.5]}
east = {tension = 3.0, at = [5, 2]}

[solve]
tolerance = 1e-11
"""
