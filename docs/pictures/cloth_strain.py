"""The strips of an L-shaped roof with a courtyard, coloured by the strain of the cloth."""

import pcmc
from pcmc.plan import Divider, Plan
from pcmc.plot import strains

meeting = (7.5, 7.5)
ends = [(10, 10), (0, 9.5096189432), (9.5096189432, 0)]
plan = Plan(
    [[0, 0], [24, 0], [24, 10], [10, 10], [10, 24], [0, 24]],
    [Divider([meeting, end], wall=1.0) for end in ends],
    holes=[{"circle": {"centre": [17, 5], "radius": 2.0}}],
    edge_length=0.7,
    tension=6.0,
)
roof = pcmc.solve(plan.surface()).surface
strains(pcmc.cutting_pattern(roof, width=2.4), "cloth_strain.png")
