"""How far from the edge: the height of a roof as its pressure grows, up to the fold."""

import pcmc
from pcmc.plan import Plan
from pcmc.plot import diagram

plan = Plan({"circle": {"centre": [0, 0], "radius": 5}}, edge_length=1.0, patches={"dome": {"tension": 4.0}})
roof = pcmc.solve(plan.surface()).surface
branch = pcmc.follow(roof, pcmc.Direction(pressures={"dome": 1.0}), folds=1)
diagram({"equilibria": branch}, "fold.png", xlabel="pressure", ylabel="height", width=700, height=420)
