"""Closed forms of branches."""

AT_REST = 8**-0.5  # height of the pyramid at rest under tension 1 and pressure 1


def tension_of_height(h):
    """Of a cap over the unit disc: the sphere of radius 2α has α = (1 + h²) / 4h."""
    return (1.0 + h**2) / (4.0 * h)
