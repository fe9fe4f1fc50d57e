"""Sequences of modelling and animation turns (M A): composed, undone, and shortened."""

from __future__ import annotations

from dataclasses import replace

from solvers.editing.motion import UNTURNED, Quaternion
from solvers.editing.part import Turn

NOTHING = 1e-12
"""A modelling turn by less than this [rad, about] is rounding, and none."""


def product(p: Quaternion, q: Quaternion) -> Quaternion:
    """Return the rotation q followed by p; exact if one of them is the identity."""
    if p == UNTURNED:
        return q
    if q == UNTURNED:
        return p
    px, py, pz, pw = p
    qx, qy, qz, qw = q
    return (
        pw * qx + px * qw + py * qz - pz * qy,
        pw * qy - px * qz + py * qw + pz * qx,
        pw * qz + px * qy - py * qx + pz * qw,
        pw * qw - px * qx - py * qy - pz * qz,
    )


def inverse(q: Quaternion) -> Quaternion:
    """Return the rotation that undoes q."""
    return q if q == UNTURNED else (-q[0], -q[1], -q[2], q[3])


def snapped(q: Quaternion) -> Quaternion:
    """Return q, or exactly the identity if q differs from it only by rounding."""
    return UNTURNED if max(abs(q[0]), abs(q[1]), abs(q[2])) < NOTHING else q


def led(first: Quaternion, turns: tuple[Turn, ...]) -> tuple[Turn, ...]:
    """Return turns that begin with another modelling turn."""
    return (replace(turns[0], model=product(first, turns[0].model)), *turns[1:])


def led_by(before: tuple[Turn, ...], turns: tuple[Turn, ...], start: float) -> tuple[Turn, ...]:
    """Return turns with others before them, which take no length: they end at `start`."""
    led = (*(replace(turn, end=start) for turn in before), turns[0])
    return (*compacted(led), *turns[1:])


def undone(turns: tuple[Turn, ...]) -> tuple[Turn, ...]:
    """Return the turns that undo others: (M_1 A_1 ... M_n A_n)^-1, whose `end`s mean nothing."""
    back = []
    model = UNTURNED
    for turn in reversed(turns):
        layers = tuple(layer.reversed for layer in turn.layers)
        back.append(Turn(1.0, model, layers))
        model = inverse(turn.model)
    return (*back, Turn(1.0, model))


def compacted(turns: tuple[Turn, ...]) -> tuple[Turn, ...]:
    """Return turns that do the same, without those that do nothing or undo the one before.

    What is taken away gives its length to the turn that follows, or else precedes.
    """
    kept: list[Turn] = []
    for turn in turns:
        here = replace(turn, model=snapped(turn.model))
        if kept and not kept[-1].layers:
            before = kept.pop()
            here = replace(here, model=snapped(product(before.model, here.model)))
        elif kept and here.model == UNTURNED and here.layers == _reversed(kept[-1]):
            before = kept.pop()
            here = Turn(here.end, before.model)
        elif kept and here.model == UNTURNED and not here.layers:
            here = replace(kept.pop(), end=here.end)
        kept.append(here)
    return tuple(kept)


def _reversed(turn: Turn) -> object:
    return tuple(layer.reversed for layer in turn.layers) if turn.layers else None
