"""The discrete energy in many digits, and its equilibrium in frozen frames: an independent check of theorems.

Only E is written down, with flint; gradient and Hessian are central differences with a step of 1e-40 and 800
bits: more than 70 digits of them are right. Nothing of pcmc's derivatives or bounds is used.
"""

from __future__ import annotations

from itertools import product

from flint import arb, arb_mat, ctx

from pcmc import Surface
from pcmc.forces.flat_pieces import flat_pieces
from pcmc.forces.motion_space import motion_space
from pcmc.forces.pinching import standing_part
from pcmc.forces.rigid_motions import rigid_modes, rigid_motions
from pcmc.forces.rooms import closing_volumes

ctx.prec = 800
STEP = arb(10) ** -40
DIGITS = arb(10) ** -60


def mid(x: arb) -> arb:
    """The middle of a ball: rounding at 800 bits is far below what is asked."""
    return x.mid()


def cross(a, b):
    return [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]


def dot(a, b):
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


def sub(a, b):
    return [x - y for x, y in zip(a, b, strict=True)]


class Frozen:
    """E(X₀ + B₀ s) - Σ δ (V - V̄) of a surface, with the floats of its vertices and frames taken exactly."""

    def __init__(self, surface: Surface) -> None:
        part = standing_part(surface)
        self.surface, self.classes = part.surface, part.classes
        self.X = [[arb(x) for x in row] for row in part.surface.vertices.tolist()]
        self.space = motion_space(part.surface, part.classes, part.surface.vertices)
        free, _ = rigid_modes(self.space, rigid_motions(part.surface), part.surface.vertices)
        self.held = [[arb(x) for x in column] for column in free.T.tolist()]
        self.size, self.rooms = self.space.size, len(surface.rooms)
        self.borders = self.rooms + len(self.held)
        self.unknowns = [
            list(range(a, b)) for a, b in zip(self.space.start, self.space.start[1:], strict=False)
        ]
        self.elements = self._elements()

    def place(self, v: int, s) -> list[arb]:
        """X₀ + B₀ s of vertex v."""
        x = list(self.X[v])
        for c, k in enumerate(self.unknowns[v]):
            b = self.space.basis[v, c].tolist()
            x = [x[d] + arb(b[d]) * s[k] for d in range(3)]
        return x

    def _elements(self):
        """Pairs of the vertices that a part of the energy depends on and that part, of their places and δ."""
        S, N = self.surface, self.size
        o, P, n = ([arb(x) for x in vector] for vector in (S.origin.tolist(), S.plane.point, S.plane.normal))
        pieces = flat_pieces(S)

        def pressure(k, s):
            rooms = sum((arb(S.room_signs[r, k]) * s[N + r] for r in range(self.rooms)), arb(0))
            return arb(S.net_pressures[k]) + rooms

        def triangle(k):
            alpha, w = arb(S.tensions[k]), arb(S.weights[k])

            def energy(x, s):
                m = cross(sub(x[1], x[0]), sub(x[2], x[0]))
                z = sum((dot(sub(p, P), n) for p in x), arb(0)) / 3
                a, b, c = (sub(p, o) for p in x)
                area = (alpha + w * z) * dot(m, m).sqrt() / 2 if alpha != 0 or w != 0 else arb(0)
                return area - pressure(k, s) * dot(a, cross(b, c)) / 6

            return energy

        def cable(pull):
            return lambda x, s: arb(pull) * dot(sub(x[1], x[0]), sub(x[1], x[0])).sqrt()

        def side(apex, k):
            return lambda x, s: pressure(k, s) * dot(apex, cross(sub(x[0], o), sub(x[1], o))) / 6

        def end(normal, k):
            return lambda x, s: -pressure(k, s) * dot(normal, sub(x[0], o))

        parts = [(F, triangle(k)) for F, k in zip(S.faces.tolist(), S.patch_of_face.tolist(), strict=True)]
        parts += [
            (e, cable(t))
            for e, t in zip(S.cable_edges.ends.tolist(), S.cable_edges.tension.tolist(), strict=True)
        ]
        for f, i, apex in zip(
            pieces.face.tolist(), pieces.corner.tolist(), pieces.apex.tolist(), strict=True
        ):
            ab = [int(S.faces[f, i]), int(S.faces[f, (i + 1) % 3])]
            parts.append((ab, side([arb(x) for x in apex], int(S.patch_of_face[f]))))
        for v, k, normal in zip(
            pieces.end.tolist(), pieces.end_patch.tolist(), pieces.normal.tolist(), strict=True
        ):
            parts.append(([v], end([arb(x) for x in normal], k)))
        wanted = (
            [arb(room.volume) - arb(c) for room, c in zip(S.rooms, closing_volumes(S), strict=True)]
            if S.rooms
            else []
        )
        for r, volume in enumerate(wanted):
            parts.append(([], lambda x, s, r=r, volume=volume: s[N + r] * volume))
        return parts

    def derivatives(self, s):
        """∇ and ∇² with respect to (s, δ), of E - Σ δ (V - V̄)."""
        total = self.size + self.borders
        gradient, hessian = [arb(0)] * total, [[arb(0)] * total for _ in range(total)]
        for vertices, energy in self.elements:
            own = [k for v in vertices for k in self.unknowns[v]]
            own += list(range(self.size, self.size + self.rooms))

            def value(moves, vertices=vertices, energy=energy):
                t = {k: s[k] for v in vertices for k in self.unknowns[v]}
                t |= {k: s[k] for k in range(self.size, self.size + self.rooms)}
                for k, amount in moves:
                    t[k] = t[k] + amount
                return energy([self.place(v, t) for v in vertices], t)

            here = value([])
            ahead = {k: value([(k, STEP)]) for k in own}
            behind = {k: value([(k, -STEP)]) for k in own}
            for k in own:
                gradient[k] = mid(gradient[k] + (ahead[k] - behind[k]) / (2 * STEP))
            for a, b in product(range(len(own)), repeat=2):
                if a > b:
                    continue
                i, j = own[a], own[b]
                both = value([(i, STEP), (j, STEP)]) + value([(i, -STEP), (j, -STEP)])
                both = both - ahead[i] - behind[i] - ahead[j] - behind[j] + 2 * here
                entry = both / (2 * STEP * STEP)
                hessian[i][j] = mid(hessian[i][j] + entry)
                if i != j:
                    hessian[j][i] = hessian[i][j]
        for j, column in enumerate(self.held, self.size + self.rooms):  # + μ ⟨q, s⟩: it stays where it is
            for k, q in enumerate(column):
                gradient[k] = mid(gradient[k] + s[j] * q)
                gradient[j] = mid(gradient[j] + s[k] * q)
                hessian[j][k] = hessian[k][j] = q
        return gradient, hessian

    def equilibrium(self):
        """(s, δ) of the exact equilibrium to 50 digits, by Newton from (0, 0), and the matrix there."""
        s = [arb(0)] * (self.size + self.borders)
        for _ in range(9):
            gradient, hessian = self.derivatives(s)
            if max(abs(g) for g in gradient) < DIGITS:
                return s, hessian
            step = arb_mat(hessian).solve(arb_mat([[g] for g in gradient]))
            s = [mid(x - step[k, 0]) for k, x in enumerate(s)]
        raise AssertionError("Newton does not come to rest in many digits")


def negative(matrix, shift: float = 0.0, borders: int = 0) -> int:
    """How many eigenvalues of a symmetric matrix of flint's numbers are below ``shift``, by elimination.

    Of a matrix bordered by gradients of volumes and rigid motions: those among motions across them.
    """
    own = len(matrix) - borders
    A = [[x - (arb(shift) if i == j < own else 0) for j, x in enumerate(row)] for i, row in enumerate(matrix)]
    count = 0
    for k in range(len(A)):
        assert A[k][k] != 0
        count += A[k][k] < 0
        for i in range(k + 1, len(A)):
            if A[i][k] != 0:
                f = mid(A[i][k] / A[k][k])
                A[i] = [
                    mid(x - f * y) if j > k else x for j, (x, y) in enumerate(zip(A[i], A[k], strict=True))
                ]
    return count - borders
