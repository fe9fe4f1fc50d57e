"""The built-in sheet of paper: a page from an exercise book with a face drawn on it."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from runtime.characters.builtin.face import Face, paints
from runtime.characters.builtin.sculpture import Array, Limb, Paint, Sculpture
from runtime.characters.builtin.signed_distance import (
    Field,
    curve,
    tube,
    union,
)

_COLUMNS, _ROWS = 46, 66
_STEP = 0.02
_HALF_WIDTH, _HEIGHT = 0.5 * _COLUMNS * _STEP, _ROWS * _STEP
_HALF_THICKNESS, _CORNER = 0.007, 0.075


def _bend(points: Array) -> Array:
    """How far the page bulges to the front (n,) [m]: a little S, and one corner turned up."""
    across, up = points[:, 0] / _HALF_WIDTH, points[:, 1] / _HEIGHT
    wave = 0.030 * np.cos(1.5 * across) + 0.022 * np.sin(2.0 * np.pi * up)
    corner = np.clip(0.5 * (across + 2.0 * up - 1.0) - 0.62, 0.0, None)
    bulge: Array = wave + 0.85 * corner**2
    return bulge


def _page(points: Array) -> Array:
    """Grid points (n, 2) of the full rectangle, drawn in to one with rounded corners."""
    middle = np.array([0.0, 0.5 * _HEIGHT])
    square = np.array([_HALF_WIDTH, 0.5 * _HEIGHT]) - _CORNER
    offset = points - middle
    over = np.maximum(np.abs(offset) - square, 0.0)
    shrink = over.max(axis=1) / np.maximum(np.hypot(*over.T), 1e-12)
    drawn: Array = middle + np.sign(offset) * (
        np.minimum(np.abs(offset), square) + over * shrink[:, None]
    )
    return drawn


def _mesh() -> tuple[Array, NDArray[np.int64]]:
    """The page's two sides and a rim between them; quads are split towards the corners."""
    across, up = np.meshgrid(np.arange(_COLUMNS + 1), np.arange(_ROWS + 1))
    grid = np.column_stack([across.ravel() - 0.5 * _COLUMNS, up.ravel()]) * _STEP
    flat = _page(grid)
    side = np.column_stack([flat, np.full(len(flat), _HALF_THICKNESS)])
    vertices = np.concatenate([side, side * [1, 1, -1]])
    vertices[:, 2] += _bend(vertices)
    index = np.arange(len(flat)).reshape(_ROWS + 1, _COLUMNS + 1)
    a, b = index[:-1, :-1].ravel(), index[:-1, 1:].ravel()
    c, d = index[1:, 1:].ravel(), index[1:, :-1].ravel()
    center = 0.25 * (grid[a] + grid[b] + grid[c] + grid[d]) - [0.0, 0.5 * _HEIGHT]
    rising = (center[:, 0] * center[:, 1] > 0.0)[:, None]
    first = np.where(rising, np.column_stack([a, b, c]), np.column_stack([a, b, d]))
    second = np.where(rising, np.column_stack([a, c, d]), np.column_stack([b, c, d]))
    front = np.concatenate([first, second])
    loop = np.concatenate([index[0, :-1], index[:-1, -1], index[-1, :0:-1], index[:0:-1, 0]])
    onward, back = np.roll(loop, -1), len(flat)
    rim = np.concatenate(
        [
            np.column_stack([loop, loop + back, onward]),
            np.column_stack([onward, loop + back, onward + back]),
        ]
    )
    return vertices, np.concatenate([front, front[:, ::-1] + back, rim])


def _between_sides(points: Array) -> Array:
    distance: Array = np.abs(points[:, 2] - _bend(points)) - _HALF_THICKNESS
    return distance


def _on_front(field: Field) -> Field:
    def drawn(points: Array) -> Array:
        return np.maximum(field(points * [1, 1, 0]), _bend(points) - points[:, 2])

    return drawn


def _line(axis: int, place: int) -> Field:
    """One row or column of vertices, on both sides."""
    at = place * _STEP
    return lambda points: np.abs(points[:, axis] - at) - 0.004


def sculpt() -> Sculpture:
    """The sheet of paper, 1.3 m tall."""
    face = Face(
        y=0.88,
        apart=0.135,
        eye=(0.050, 0.072),
        pupil=(0.050, 0.072),
        smile=(0.150, 0.105, 0.745, 0.017),
        cheek=(0.255, 0.735, 0.060),
    )
    ruled = [_line(1, row) for row in (7, 12, 17, 22, 58)]
    brows = [
        tube(curve([(s * 0.19, 1.0, 0), (s * 0.14, 1.028, 0), (s * 0.085, 1.01, 0)], 9), 0.012)
        for s in (1, -1)
    ]
    layers = (
        Paint(union(*ruled), "#8fbdf0", softness=0.004),
        Paint(_line(0, -18), "#f07f8c", softness=0.004),
        *paints(face, _on_front, white=None, dark="#2b3a8c"),
        Paint(_on_front(union(*brows)), "#2b3a8c"),
    )
    return Sculpture(
        _between_sides,
        (-0.52, -0.06, -0.16),
        (0.52, 1.36, 0.26),
        _STEP,
        "#fdf8ea",
        layers,
        _skeleton(),
        mesh=_mesh(),
    )


def _skeleton() -> tuple[Limb, ...]:
    def on_page(path: list[tuple[float, float]], count: int) -> Array:
        nodes = curve([(x, y, 0.0) for x, y in path], count)
        nodes[:, 2] = _bend(nodes)
        return nodes

    limbs = [
        Limb("spine", on_page([(0, 0.42), (0, 0.86)], 5)),
        Limb("top", on_page([(0, 0.95), (0, 1.265)], 5), "spine4"),
    ]
    for side, name in ((1, "left"), (-1, "right")):
        arm = on_page([(side * 0.08, 0.92), (side * 0.41, 1.245)], 6)
        leg = on_page([(side * 0.07, 0.36), (side * 0.41, 0.055)], 6)
        limbs += [Limb(f"{name}_arm", arm, "spine4"), Limb(f"{name}_leg", leg, "spine0")]
    return tuple(limbs)
