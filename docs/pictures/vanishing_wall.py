"""The walls below a roof of four rooms: as drawn, once one has vanished, and with that wall the other way."""

import pcmc
from pcmc.plan import Divider, Plan
from pcmc.plot import panel

rim = [[0, 0, 4], [6, 0, 4], [6, 12, 4], [0, 12, 4]]
lines = [([0, 0], [2, 6]), ([0, 12], [2, 6]), ([6, 0], [4, 6]), ([6, 12], [4, 6]), ([2, 6], [4, 6])]
walls = [Divider([*line], name=f"wall {k}", wall=4.0, bottom="sliding") for k, line in enumerate(lines, 1)]
hall = Plan(rim, walls, edge_length=1.2, tension=12.0).surface()
vanished = pcmc.solve(hall).surface
swapped = pcmc.swap_neighbours(vanished)
names = [wall.name for wall in walls]
titles = ["as drawn", "wall 5 vanishes", "and opens the other way"]
panel([hall, vanished, swapped.surface], "vanishing_wall.png", titles=titles, patches=names, supports=False)
