"""Plans with cables, volumes and mirrors that several test files start from."""

SQUARE = [[0, 0], [10, 0], [10, 10], [0, 10]]
MASTS = [[0, 0, 4], [10, 0, 0], [10, 10, 4], [0, 10, 0]]
SAIL = {"edge": "cable", "cable": 9.0, "supports": MASTS, "tension": 1.0, "pressure": 0.0, "edge_length": 1.5}
HALL = [[0, 0], [10, 0], [10, 6], [0, 6]]

BUBBLE_TOML = """
[plan]
edge_length = 1.0
outline = {circle = {centre = [0, 0], radius = 3}}

[plan.patches]
dome = {tension = 2.0, volume = 40.0}

[output]
files = ["bubble.pcmc"]
"""


def cables(surface):
    """Tension and number of edges of each cable, by name."""
    return {cable.name: (cable.tension, len(cable.edges)) for cable in surface.cables}
