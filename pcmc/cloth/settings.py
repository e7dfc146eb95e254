"""What a cutting pattern is to be: the section [pattern] of a project."""

from __future__ import annotations

import warnings
from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, field, replace
from itertools import product
from typing import Any

import numpy as np

from ..base import validate
from ..base.arrays import Floats
from ..base.errors import LoadWarning, OptionError
from ..surface import Surface, unfolded
from ..surface.parts import image_names, with_images
from .cut_mesh import nearest_places

SAME = 1e-3  # of the size of a roof: drawn seams so near to each other all along are one

NUMBERS: dict[str, dict[str, Any]] = {  # keys of numbers, with their limits
    "width": {"above": 0.0},
    "direction": {},
    "compensation": {"least": -20.0, "most": 20.0},
    "stiffness": {"above": 0.0},
    "poisson": {"least": 0.0, "below": 1.0},
    **{key: {"least": 0.0} for key in ("allowance", "hem", "notches")},
}
PAIR = "two numbers, [warp, weft]"
PAIRS = ("compensation", "stiffness")  # keys of two numbers, [warp, weft]
TABLE = {"kind": "a number or a table"}  # of keys that may be tables, as messages call it
BY_PATCH = ("strips", "direction", "stiffness", "poisson")  # keys that may be tables


@dataclass(frozen=True)
class CuttingOptions:
    """How the cloth of a roof is cut.

    Attributes
    ----------
    width : of the cloth, length: no strip with its allowances is wider.
    strips : number of strips of each sheet instead, or a table of numbers by patch.
    seams : lines that are drawn, lists of two or more points [x, y] in the plan or [x, y, z]: geodesics join
        them. Sheets with such seams have no others.
    direction : of the warp in the plan, degrees from x, or a table by patch; by default along the longer side
        of each sheet.
    compensation : [warp, weft], percent by which the cloth is cut shorter than it is on the roof.
    stiffness : [warp, weft] of the cloth, force per length (E t), or a table by patch, from which the
        compensation follows: the tension of the patch stretches the cloth back. In a project it is by
        default that of [structure].
    poisson : contraction of the weft where only the warp is pulled, 0 ≤ ν < 1, or a table by patch; with
        ``stiffness``; by default 0.3.
    allowance : cloth added outside of seams, length.
    hem : cloth added at rims, where no other strip follows, length; by default ``allowance``.
    notches : distance of the marks along seams, length; 0 for none; by default the mean width.
    """

    width: float | None = None
    strips: int | Mapping[str, int] | None = field(default=None, metadata=TABLE)
    seams: Sequence[Any] = field(default=(), metadata={"kind": "a list of lines"})
    direction: float | Mapping[str, float] | None = field(default=None, metadata=TABLE)
    compensation: Sequence[float] | None = field(default=None, metadata={"kind": "two numbers"})
    stiffness: Sequence[float] | Mapping[str, Sequence[float]] | None = field(
        default=None, metadata={"kind": "two numbers or a table"}
    )
    poisson: float | Mapping[str, float] = field(default=0.3, metadata=TABLE)
    allowance: float = 0.0
    hem: float | None = None
    notches: float | None = None

    def __post_init__(self) -> None:
        if self.width is not None and self.strips is not None:
            raise OptionError("strips: the width gives their number; leave out one of both", what="strips")
        if self.width is None and self.strips is None and not validate.sequence("seams", self.seams):
            text = "a cutting pattern needs the width of the cloth, a number of strips, or seams; give"
            raise OptionError(f"{text} --width or the key width of [pattern]", what="width")
        if self.compensation is not None and self.stiffness is not None:
            text = "stiffness: the compensation is given; leave out one of both"
            raise OptionError(text, what="stiffness")
        if not isinstance(self.poisson, Mapping):
            validate.number("poisson", self.poisson, **NUMBERS["poisson"])
        if self.stiffness is None and self.poisson != CuttingOptions.poisson:
            text = "poisson: it counts with the stiffness of the cloth alone; give stiffness, or leave it out"
            raise OptionError(text, what="poisson", found=self.poisson)
        for count in self._values("strips"):
            validate.integer("strips", count, least=1)
        for name, limits in NUMBERS.items():
            for value in self._values(name):
                if name in PAIRS and len(validate.sequence(name, value, PAIR)) != 2:
                    validate.refuse(name, value, PAIR)
                for number in value if name in PAIRS else [value]:
                    validate.number(name, number, **limits)
        self.lines  # noqa: B018 — refuses lines that are none
        if self.width is not None and self.net_width is not None and self.net_width <= 0.0:
            text = f"width: {self.width:g} leaves no cloth between two allowances of {self.allowance:g}"
            raise OptionError(text, what="width", found=self.width)

    def _values(self, key: str) -> Collection[Any]:
        """The values of a key, several of a table by patch; none where it is left out."""
        given = getattr(self, key)
        if isinstance(given, Mapping) and key in BY_PATCH:
            return given.values()
        return [] if given is None else [given]

    @property
    def net_width(self) -> float | None:
        """Largest width of a strip between its seams; None for any."""
        return None if self.width is None else self.width - 2.0 * max(self.allowance, self.rim_allowance)

    @property
    def rim_allowance(self) -> float:
        """Cloth added at rims, length."""
        return self.allowance if self.hem is None else self.hem

    @property
    def lines(self) -> list[Floats]:
        """The drawn seams as arrays (k,2) or (k,3)."""
        lines, expected = list[Floats](), "two or more points [x, y] or [x, y, z]"
        for number, line in enumerate(validate.sequence("seams", self.seams), 1):
            try:
                points = np.asarray(line, dtype=float)
            except (TypeError, ValueError):
                points = np.empty((0, 0))
            good = points.ndim == 2 and len(points) > 1 and points.shape[1] in (2, 3)
            if not (good and np.isfinite(points).all()):
                validate.refuse("seams", line, expected, str(number), "such as [[0, 0], [4, 2]]")
            lines.append(points)
        return lines

    def check(self, surface: Surface) -> None:
        """Refuse names of patches that the roof does not have, and a cloth that none is, before it is solved;
        warn of a direction that is another one behind a mirror plane."""
        names = [patch.name for patch in surface.patches]
        for key in BY_PATCH:
            given = getattr(self, key)
            for name in given if isinstance(given, Mapping) else ():
                validate.choice(f"patch in {key}", name, names)
        for name in names:
            warp, weft = self.of_patch("stiffness", name) or (1.0, 0.0)
            text = f"stiffness of {name!r}: the weft has to be less than warp/poisson²"
            validate.cloth("stiffness", text, warp, weft, self.of_patch("poisson", name))
        mirrors = [plane for plane, _ in surface.on_planes if plane.mirror]
        for name, mirror in product(np.array(names)[surface.roof].tolist(), mirrors):
            if (degrees := self.of_patch("direction", name)) is None:
                continue
            angle = np.radians(degrees)
            if mirror.oblique_to(np.array([np.cos(angle), np.sin(angle)]) @ surface.plane.axes[:2]):
                text = f"direction {degrees:g} of {name!r} is neither along the {mirror} nor square to it;"
                text += " behind it the part has the image of its strips, and the whole, --whole, the same"
                text += " direction"
                warnings.warn(text, LoadWarning, stacklevel=3)
                return

    def of_whole(self, piece: Surface, whole: Surface) -> CuttingOptions:
        """The same for the whole of a piece: patches and drawn seams hold for their images, too. OptionError
        for a seam that goes on behind a mirror plane, and is no image of itself there, and for points [x, y]
        where an image of the piece has another Π."""
        names, plane = image_names(piece, whole), piece.plane
        by_patch = {key: getattr(self, key) for key in BY_PATCH if isinstance(getattr(self, key), Mapping)}
        images, near = unfolded(piece).images if self.lines else (), SAME * whole.size
        seams: list[tuple[Floats, bool]] = []  # in space, and whether drawn in the plan
        for (R, t), (number, line) in product(images, enumerate(self.lines, 1)):
            plan = line.shape[1] == 2
            points = np.array(plane.point) + line @ plane.axes[:2] if plan else line
            for mirror in (mirror for mirror, _ in piece.on_planes if mirror.mirror):
                away = mirror.height(points)
                behind = points - 2.0 * away[:, None] * np.array(mirror.normal)
                if away.min() < -near and away.max() > near and not _alike(points, behind, near):
                    text = f"seam {number}: it goes on behind the {mirror}, and its image is another one"
                    text += " there; end it at the mirror"
                    raise OptionError(text, what="seams", found=line.tolist())
            image = points @ R.T + t
            if plan and (np.abs(plane.height(image)) > near).any():
                text = "seams: behind a mirror plane that leans the plan is another; give points [x, y, z]"
                raise OptionError(text, what="seams", found=line.tolist())
            if not any(_alike(image, other, near) for other, _ in seams):
                seams.append((image, plan))
        found = [plane.to_local(line)[:, :2] if plan else line for line, plan in seams]
        named: dict[str, Any] = {key: with_images(given, names) for key, given in by_patch.items()}
        return replace(self, seams=[line.tolist() for line in found], **named)

    def of_patch(self, key: str, name: str) -> Any:
        """The value of a key of ``BY_PATCH`` for a patch, by default that of the key."""
        given = getattr(self, key)
        return given.get(name, getattr(CuttingOptions, key)) if isinstance(given, Mapping) else given

    def stretch(self, tension: float, patch: str = "") -> tuple[float, float]:
        """Cut length over length on the roof of a patch, along warp and weft, under a tension, force/length.

        With the stiffnesses S and T of warp and weft, the strains of the cloth are α (1 - ν) / S and
        α (1 / T - ν / S), as the contraction of the one is that of the other times T / S.

        >>> cloth = CuttingOptions(width=2.0, stiffness=(500, 250), poisson=0.2)
        >>> [round(part, 6) for part in cloth.stretch(4.0)]
        [0.993641, 0.985804]
        >>> CuttingOptions(width=2.0, compensation=(0.5, 2.0)).stretch(4.0)
        (0.995, 0.98)
        """
        if (stiffness := self.of_patch("stiffness", patch)) is not None:
            (warp, weft), poisson = stiffness, self.of_patch("poisson", patch)
            along, across = tension * (1.0 - poisson) / warp, tension * (1.0 / weft - poisson / warp)
            cut = 1.0 / (1.0 + along), 1.0 / (1.0 + across)
            for part in cut:
                what = f"compensation of {patch!r}, from its stiffness"
                validate.number(what, 100.0 * (1.0 - part), **NUMBERS["compensation"])
            return cut
        warp, weft = self.compensation or (0.0, 0.0)
        return 1.0 - warp / 100.0, 1.0 - weft / 100.0


def _alike(one: Floats, other: Floats, near: float) -> bool:
    """Whether two lines, of points (k,3) and (l,3), are one, in either direction."""
    return all(
        nearest_places(np.stack([b[:-1], b[1:], b[1:]], axis=1), point)[1].min() <= near
        for a, b in ((one, other), (other, one))
        for point in a
    )
