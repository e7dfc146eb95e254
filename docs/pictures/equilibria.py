"""The equilibria of a dome: the branch in its pressure, both domes on it, and the barrier between them."""

import pcmc
from pcmc.plan import Plan
from pcmc.plot import equilibria

plan = Plan({"circle": {"centre": [0, 0], "radius": 5}}, edge_length=1.0, patches={"dome": {"tension": 3.5}})
found = pcmc.find_equilibria(plan.surface(), "pressure", starts=2)
equilibria(found, "equilibria.png", width=900)
