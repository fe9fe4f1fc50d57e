"""Convergence from a cold start: the energies of our solvers and of the plain equations."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cache

import numpy as np
from PIL import Image, ImageDraw, ImageFont
from scipy.spatial.transform import Rotation

from runtime.figures.plain import PlainSolver
from runtime.figures.revolved import revolved
from solvers.arap import ArapSolver
from solvers.linear.laplacian import Floats, Ints
from solvers.squash_stretch import SquashStretchSolver

FRAMES = 60
SHARES = (0.30, 0.20, 0.10, 0.05)

_FINER = 2  # supersampling, for smooth edges
_SETTLED = 150  # iterations after which the plain equations count as converged
_INK, _PAPER, _GRID = (58, 48, 40), (250, 246, 238), (226, 218, 204)
_COLOURS = {
    "ARAP, plain": (196, 178, 150),
    "ARAP, ours": (61, 165, 160),
    "squash and stretch, plain": (224, 168, 148),
    "squash and stretch, ours": (196, 74, 44),
}


@dataclass(frozen=True, slots=True, eq=False)
class Curves:
    """The energies after each iteration under one constraint, as shares (K,) by method.

    1 is the energy of the cold start, 0 the lowest energy that either of the two methods with the
    same energy reaches.
    """

    name: str
    shares: dict[str, Floats]

    def iterations_to(self, method: str, share: float) -> int | None:
        """Return the number of iterations to a share; None if it is not reached."""
        below = np.flatnonzero(self.shares[method] <= share)
        return int(below[0]) if len(below) else None


@cache
def measure() -> tuple[Curves, ...]:
    """Return the curves of four constraints on a round bar with handles at both ends."""
    vertices, faces = revolved(np.linspace(0.0, 4.0, 32), np.full(32, 0.5), 14)
    x = vertices[:, 0]
    handles = np.flatnonzero((x < 0.3) | (x > 3.7))
    right = (x[handles] > 2.0)[:, None]
    ends = vertices[handles]
    middle, pull = np.array([2.0, 0.0, 0.0]), np.array([1.2, 0.0, 0.0])
    bend, twist = Rotation.from_rotvec([0, 0, 1.4]), Rotation.from_rotvec([1.6, 0, 0])
    constraints = {
        "bend": np.where(right, bend.apply(ends - middle) + middle, ends),
        "twist": np.where(right, twist.apply(ends), ends),
        "squash": ends - right * pull,
        "stretch": ends + right * pull,
    }
    return tuple(
        _curves(name, vertices, faces, handles, targets) for name, targets in constraints.items()
    )


def _curves(name: str, vertices: Floats, faces: Ints, handles: Ints, targets: Floats) -> Curves:
    plain = PlainSolver(vertices, faces, handles)
    groups = (vertices[handles, 0] > 2.0).astype(np.int64)
    rigid = ArapSolver(vertices, faces, handles, groups=groups)
    scaled = SquashStretchSolver(vertices, faces, handles, groups=groups)
    shares: dict[str, Floats] = {}
    for title, ours, iterations, cells in (
        ("ARAP", rigid, 1, plain.rigid_cells),
        ("squash and stretch", scaled, 2, plain.scaled_cells),
    ):
        slow = _plain_energies(plain, cells, plain.cold_start(targets))
        # Two iterations of ours are one of the shape state, which has this energy, and one pose.
        ours.solve(targets, 0)
        fast = [ours.energy]
        for _ in range(FRAMES):
            ours.solve(targets, iterations)
            fast.append(ours.energy)
        lowest = min(*slow, *fast)
        shares[f"{title}, plain"] = (slow[: FRAMES + 1] - lowest) / (slow[0] - lowest)
        shares[f"{title}, ours"] = (np.array(fast) - lowest) / (slow[0] - lowest)
    return Curves(name, shares)


def _plain_energies(plain: PlainSolver, cells: Callable[[Floats], Floats], x: Floats) -> Floats:
    """Energies of the start, of the first `FRAMES` iterations, and of the settled surface."""
    energies = []
    for iteration in range(_SETTLED + 1):
        matrices = cells(x)
        if iteration <= FRAMES or iteration == _SETTLED:
            energies.append(plain.energy(x, matrices))
        x = plain.global_step(x, matrices)
    return np.array(energies)


def draw(curves: Sequence[Curves], size: tuple[int, int]) -> Image.Image:
    """Draw the curves: a panel for each constraint, two in a row, and a legend below."""
    width, height = _FINER * size[0], _FINER * size[1]
    picture = Image.new("RGB", (width, height), _PAPER)
    pen = ImageDraw.Draw(picture)
    legend = height // 12
    rows = (len(curves) + 1) // 2
    for index, curve in enumerate(curves):
        left, top = (index % 2) * width // 2, index // 2 * (height - legend) // rows
        _draw_panel(pen, curve, (left, top, left + width // 2, top + (height - legend) // rows))
    font = ImageFont.load_default(max(height // 46, 8))
    for index, method in enumerate(_COLOURS):
        x = width // 20 + index * width // 4
        y = height - legend // 2
        _stroke(pen, [(x, y), (x + width // 30, y)], method, height // 150)
        pen.text((x + width // 26, y), method, fill=_INK, font=font, anchor="lm")
    return picture.resize(size, Image.Resampling.LANCZOS)


def _draw_panel(pen: ImageDraw.ImageDraw, curve: Curves, box: tuple[int, int, int, int]) -> None:
    left, top, right, bottom = box
    pad = (bottom - top) // 9
    left, top, right, bottom = left + int(1.6 * pad), top + pad, right - pad // 2, bottom - pad
    font = ImageFont.load_default(max(pad // 2, 8))

    def at(iteration: int, share: float) -> tuple[float, float]:
        return left + iteration / FRAMES * (right - left), bottom - min(share, 1.0) * (bottom - top)

    for share in (1.0, *SHARES):
        height = at(0, share)[1]
        pen.line([(left, height), (right, height)], fill=_GRID, width=_FINER)
        if share != SHARES[-1]:  # too close to the one above
            text = f"{share:.0%}"
            pen.text((left - pad // 4, height), text, fill=_INK, font=font, anchor="rm")
    for iteration in range(0, FRAMES + 1, 20):
        place = (at(iteration, 0.0)[0], bottom + pad // 4)
        pen.text(place, str(iteration), fill=_INK, font=font, anchor="mt")
    pen.text((right, top + pad // 3), curve.name, fill=_INK, font=font, anchor="rt")
    for method, shares in curve.shares.items():
        points = [at(k, float(share)) for k, share in enumerate(shares)]
        _stroke(pen, points, method, pad // 10)
        reached = curve.iterations_to(method, SHARES[-1])
        if reached is not None:
            x, y, r = *points[reached], pad // 6
            pen.ellipse([x - r, y - r, x + r, y + r], fill=_COLOURS[method])


def _stroke(
    pen: ImageDraw.ImageDraw, points: list[tuple[float, float]], method: str, width: int
) -> None:
    """Draw a line in a method's colour; the plain methods are wider, to show under ours."""
    wide = max(width, 2) * (2 if method.endswith("plain") else 1)
    pen.line(points, fill=_COLOURS[method], width=wide, joint="curve")


def table(curves: Sequence[Curves]) -> list[str]:
    """Return lines of text: the iterations of each method to each share."""
    heads = "".join(f"{f'{share:.0%}':>6}" for share in SHARES)
    lines = [f"{'iterations to':34}{heads}"]
    for curve in curves:
        for method in _COLOURS:
            counts = [curve.iterations_to(method, share) for share in SHARES]
            cells = "".join(f"{'-' if count is None else count:>6}" for count in counts)
            lines.append(f"{curve.name:8}{method:26}{cells}")
    return lines
