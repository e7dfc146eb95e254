"""The tolerances that decide answers, in one table: value, unit, and what it decides.

Lengths are relative to the size of the surface or curve, and forces to those of its triangles, so that no
unit of a project matters. ``tests/base/test_tolerances.py`` varies each of them: verdict, status and index
of small surfaces stay. Numbers that steer how fast or where a method searches stay with the method.
"""

import numpy as np

EPS = float(np.finfo(float).eps)

# places: of the size of the surface or curve, unless stated otherwise
ON = 1e-9  # a point this near to a plane, line, circle, curve or place is on it; a shorter length is none
ON_CURVE = 1e-8  # a fixed vertex this near to the curve that it was drawn on follows it
SAME_PLACE = 1e-12  # places this near are one up to rounding: points on several planes, apices
RESTING = 1e-12  # height over Π up to which a vertex lies on it
RESTING_ROUNDED = 8.0 * EPS  # of the coordinates: the same, far from the origin
FAR = 30.0  # sizes: farther away, differences of coordinates and volumes lose three digits
NO_AREA = 1e-14  # of the squared longest edge: a smaller area vector has no direction
PARALLEL = 1e-9  # sine or cosine: directions this near are parallel, or at right angles
NO_DIRECTION = 1e-6  # sine: what a support leaves of a motion; a smaller part of it has no direction
ONLY_SLIDES = 0.05  # part of a rigid motion across the surface, below which it only slides along it

# forces
EXCESS = 1e-9  # of a capacity, tension or force: a smaller excess or remainder is rounding
SAME_PRESSURE = 1e-13  # of the largest pressure: a smaller difference is rounding
NO_CHANGE = 1e-13  # of the size, squared: a smaller gradient of a volume is rounding
FORCE_ROUNDING = 1e-14  # of the triangles' forces: what rounding leaves of them where they cancel
DIFFERENCE_ROUNDING = 1e3 * EPS  # of two values: their difference is rounding below

# rest: relative residuals, forces left over the triangles' own
AT_REST = 1e-8  # up to which a surface is at rest
ROUNDED_REST = 1e-10  # that counts as zero where rounding lets no step lower it
NOISE = 10.0  # times what rounding of the coordinates leaves: forces up to here may be rounding alone
WEAK = 1e3  # tolerances of its own forces that a patch may lack where stronger ones hide it
ROOM_VOLUME = 1e-10  # of a room's volume: a correction ends here

# second variation
NEUTRAL = 1e-2  # |λ| size²/α up to which a motion is neutral, α the tension of what it moves
# A mesh's own branch folds where the derivative of the forces left is singular, which is not quite the second
# variation: at reported folds of coarse caps, catenoids and pairs of caps |λ| is 0.003 to 0.55. A flat film
# over a disc has 46.
NEAR_NEUTRAL = 1.0  # |λ| size²/α up to which a certificate's detail names a fold
SAME_EIGENVALUE = 1e-7  # of the largest eigenvalue computed: equal ones differ by less
NULL_MODE = 0.05  # of the next eigenvalue: how far from 0 that of a mode at a branch point may be

# triangles: quality, 1 for equilateral ones and 0 without area
COLLAPSED = 1e-3  # up to which a mesh is degenerate
POOR = 0.15  # that explains why no step of the solver helps
FAILED = 0.05  # that shows where a solve failed, and up to which a plan's triangles are no start
BRANCH_END = 0.02  # below which no point of a branch is accepted
HOMOTOPY_END = 0.1  # at which a homotopy is given up
SOUND = 0.2  # from which a turn of a homotopy is the surface's, not the mesh's

# vanishing and pinching
PINCHED = 0.1  # of the held curves' length: a shorter neck has pinched off
SHRUNK = 5e-2  # of its first size: a surface that nothing holds has vanished
HARDLY = 0.99  # of the sum of the others: a tension at which two sheets meet at about 20°

# branches
EVENT_ACCURACY = 2e-5  # arclength to which events are located, and so λ relative to its scale
FOLD_ACCURACY = 1e-3  # of a segment's length, for folds: λ hardly changes there
GOAL_ACCURACY = 1e-12  # arclength to which goals are met
START_RESIDUAL = 1e-4  # relative residual up to which a surface is near enough to a branch to start
ON_BRANCH = 1e-9  # of λ or the constraint: smaller differences are none
