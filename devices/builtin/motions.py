"""The built-in motions: five single ones, and the show that joins them."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from functools import cache
from itertools import chain

import numpy as np
from numpy.typing import NDArray

from devices.builtin.body import FINGERS, SIDES, finger_direction, finger_joints
from devices.builtin.gestures import BuiltinMotion, Gesture, MotionClip, Turn, sample_motion
from devices.errors import InputError

_FORWARD = np.array([-0.66, -0.74, 0.0])  # turns the left forearm towards the front


def _mirrored(side: str, turn: Turn) -> Turn:
    """A rotation given for the left, converted to `side`."""
    return turn if side == "Left" else (turn[0], -turn[1], -turn[2])


def _limb(joint: str, side: str, turn: Turn, **when: float) -> Gesture:
    return Gesture(joint + side, _mirrored(side, turn), **when)


def _both(joint: str, turn: Turn, **when: float) -> Iterator[Gesture]:
    return (_limb(joint, side, turn, **when) for side in SIDES)


def _curl(side: str, by: float, lag: float = 0.0, **when: float) -> Iterator[Gesture]:
    """Bend every finger by `by` [rad] at each joint; each is `lag` [rad] behind the previous."""
    for number, finger in enumerate(FINGERS):
        along_x, along_y, _ = by * finger_direction(finger)
        turn = _mirrored(side, (along_y, -along_x, 0.0))  # along x front: towards the palm
        for joint in finger_joints(side, finger)[:-1]:
            gesture = Gesture(joint, turn, **when)
            yield replace(gesture, phase=gesture.phase - lag * number)


def _spread(side: str, by: float, **when: float) -> Iterator[Gesture]:
    """Spread the fingers, the outer ones by `by` [rad]."""
    for finger, share in zip(FINGERS, (1.0, 0.5, 0.0, -0.5, -1.0), strict=True):
        turn = _mirrored(side, (0.0, 0.0, share * by))
        yield Gesture(finger_joints(side, finger)[0], turn, **when)


def _knees(by: float, **when: float) -> Iterator[Gesture]:
    """Bend the knees; the trunk stays upright."""
    for joint, turn in (("Hip", -by), ("Knee", 2.0 * by), ("Ankle", -by)):
        yield from _both(joint, (turn, 0.0, 0.0), **when)


def _sway(by: float, **when: float) -> Iterator[Gesture]:
    """Tilt the hips sideways; the legs stay upright, chest and head compensate."""
    yield Gesture("SpineBase", (0.0, 0.0, by), **when)
    for side in SIDES:
        yield Gesture(f"Hip{side}", (0.0, 0.0, -by), **when)
    yield Gesture("SpineMid", (0.0, 0.0, -1.5 * by), **when)
    yield Gesture("Neck", (0.0, 0.0, 1.2 * by), **when)


def _wave() -> BuiltinMotion:
    """A wave of the right hand; head and trunk take part."""
    raised, waving = {"begin": 0.35, "end": 2.55}, {"begin": 0.75, "end": 2.35, "ease": 0.4}
    gestures = (
        _limb("Shoulder", "Right", (0.0, 0.0, 1.20), **raised, ease=0.55),
        _limb("Elbow", "Right", (0.0, 0.0, 0.85), begin=0.45, end=2.62, ease=0.55),
        _limb("Shoulder", "Right", (0.0, 0.0, 0.10), **waving, frequency=2.0),
        _limb("Elbow", "Right", (0.0, 0.0, 0.50), **waving, frequency=2.0, phase=-0.5),
        _limb("Wrist", "Right", (0.0, 0.0, 0.40), **waving, frequency=2.0, phase=-1.3),
        *_spread("Right", 0.16, begin=0.55, end=2.5, ease=0.5),
        *_curl("Right", -0.10, begin=0.55, end=2.5, ease=0.5),
        _limb("Shoulder", "Left", (0.0, 0.0, -0.16), **raised, ease=0.7),
        _limb("Elbow", "Left", (0.0, 0.0, 0.22), begin=0.45, end=2.6, ease=0.7),
        Gesture("SpineMid", (0.0, 0.0, -0.10), **raised, ease=0.7),
        Gesture("Neck", (0.0, 0.0, 0.20), begin=0.45, end=2.6, ease=0.6),
        Gesture("Neck", (0.0, 0.0, 0.06), **waving, frequency=1.0),
        *_sway(0.05, **raised, ease=0.8),
        *_knees(0.10, **waving, frequency=2.0, phase=-np.pi / 2, lift=1.0),
    )
    return BuiltinMotion(3.3, gestures)


def _arms() -> BuiltinMotion:
    """Both arms beat like wings, a wave runs from hand to hand, then both arms rise."""
    out = {"begin": 0.2, "end": 4.35}
    wings = {"begin": 0.45, "end": 1.85, "ease": 0.45, "frequency": 1.15}
    snake = {"begin": 2.0, "end": 3.35, "ease": 0.5, "frequency": 1.0}
    up = {"begin": 3.35, "end": 4.15}
    gestures: list[Gesture] = [
        *_both("Shoulder", (0.0, 0.0, 0.62), **out, ease=0.6),
        *_both("Shoulder", (0.0, 0.0, 0.66), **wings),
        *_both("Elbow", (0.0, 0.0, 0.46), **wings, phase=-0.75),
        *_both("Wrist", (0.0, 0.0, 0.50), **wings, phase=-1.5),
        *chain.from_iterable(_curl(side, 0.22, **wings, phase=-2.0) for side in SIDES),
        *_knees(0.17, **wings, phase=0.6, lift=1.0),
        Gesture("Neck", (-0.14, 0.0, 0.0), **wings, phase=-0.9),
        *_sway(0.07, **snake, phase=0.4),
        *_both("Shoulder", (0.0, 0.0, 1.05), **up, ease=0.5),
        *_both("Elbow", (0.0, 0.0, 0.32), begin=3.45, end=4.2, ease=0.5),
        *chain.from_iterable(_spread(side, 0.18, begin=3.5, end=4.2, ease=0.4) for side in SIDES),
        Gesture("Neck", (-0.28, 0.0, 0.0), **up, ease=0.5),
        Gesture("SpineMid", (-0.12, 0.0, 0.0), **up, ease=0.5),
        *_knees(0.26, begin=3.05, end=3.25, ease=0.35),
    ]
    for side, lag in (("Left", 0.0), ("Right", np.pi)):
        for joint, by, late in (("Shoulder", 0.42, 0.0), ("Elbow", 0.62, 0.9), ("Wrist", 0.6, 1.8)):
            gestures.append(_limb(joint, side, (0.0, 0.0, by), **snake, phase=-lag - late))
    return BuiltinMotion(5.0, tuple(gestures))


def _walk() -> BuiltinMotion:
    """Walk on the spot with high knees and swinging arms."""
    steps = {"begin": 0.25, "end": 3.05, "ease": 0.5, "frequency": 1.25}
    gestures: list[Gesture] = [
        *_both("Shoulder", (0.0, 0.0, -0.30), begin=0.15, end=3.1),
        *_both("Elbow", _turn(0.75 * _FORWARD), begin=0.2, end=3.1),
        *chain.from_iterable(_curl(side, 0.5, begin=0.2, end=3.1) for side in SIDES),
        *_sway(0.055, **steps, phase=np.pi),
        Gesture("SpineMid", (0.0, 0.16, 0.0), **steps, phase=-0.3),
        Gesture("Neck", (0.0, -0.12, 0.0), **steps, phase=-0.6),
        Gesture("SpineMid", (-0.05, 0.0, 0.0), begin=0.2, end=3.1),
    ]
    for side, phase in (("Left", 0.0), ("Right", np.pi)):
        lifted = {**steps, "phase": phase, "lift": 1.0}
        gestures += [
            _limb("Hip", side, (-1.05, 0.0, 0.16), **lifted),
            _limb("Knee", side, (1.60, 0.0, 0.0), **{**lifted, "phase": phase - 0.25}),
            _limb("Ankle", side, (0.45, 0.0, 0.0), **{**lifted, "phase": phase - 0.5}),
            _limb("Shoulder", side, (0.62, 0.0, 0.0), **{**steps, "phase": phase}),
            _limb("Elbow", side, _turn(-0.25 * _FORWARD), **{**steps, "phase": phase - 0.5}),
            _limb("Wrist", side, (0.20, 0.0, 0.0), **{**steps, "phase": phase - 0.9}),
        ]
    return BuiltinMotion(3.8, tuple(gestures))


def _fingers() -> BuiltinMotion:
    """Both hands up, with rippling fingers."""
    raised, play = {"begin": 0.2, "end": 2.55}, {"begin": 0.6, "end": 2.4, "ease": 0.4}
    roll = {**play, "frequency": 0.9}
    gestures: list[Gesture] = [
        *_both("Shoulder", (0.0, 0.0, 0.42), **raised, ease=0.55),
        *_both("Elbow", (0.0, 0.0, 1.45), begin=0.28, end=2.6, ease=0.55),
        *_both("Shoulder", (0.0, 0.0, 0.12), **roll, phase=0.8),
        *_sway(0.06, **roll),
        Gesture("Neck", (0.0, 0.0, 0.12), **roll, phase=-0.9),
        Gesture("Head", (-0.10, 0.0, 0.0), **raised),
        *_knees(0.07, **play, frequency=1.8, lift=1.0),
    ]
    for side, late in (("Left", 0.0), ("Right", 1.4)):
        gestures += _spread(side, 0.16, **raised, ease=0.5)
        gestures += _curl(side, 0.24, begin=0.35, end=2.5, ease=0.5)
        gestures += _curl(side, 0.30, 0.85, **play, frequency=2.3, phase=-late)
        gestures.append(_limb("Wrist", side, (0.0, 0.0, 0.28), **roll, phase=-late))
    return BuiltinMotion(3.3, tuple(gestures))


def _bow() -> BuiltinMotion:
    """A deep bow with a sweep of the arm."""
    down = {"begin": 0.35, "end": 1.45, "ease": 0.7}
    gestures = (
        Gesture("SpineBase", (0.42, 0.0, 0.0), **down),
        *_both("Hip", (-0.42, 0.0, 0.0), **down),
        Gesture("SpineMid", (0.42, 0.0, 0.0), begin=0.40, end=1.50, ease=0.7),
        Gesture("SpineShoulder", (0.20, 0.0, 0.0), begin=0.45, end=1.55, ease=0.7),
        Gesture("Neck", (0.30, 0.0, 0.0), begin=0.50, end=1.62, ease=0.7),
        *_knees(0.10, **down),
        _limb("Shoulder", "Left", (0.0, 0.0, 0.85), begin=0.2, end=1.6, ease=0.65),
        _limb("Elbow", "Left", (0.0, 0.0, 0.25), begin=0.3, end=1.7, ease=0.65),
        _limb("Wrist", "Left", (0.0, 0.0, 0.35), begin=0.45, end=1.75, ease=0.6),
        _limb("Shoulder", "Right", (-0.15, 0.0, -0.20), begin=0.25, end=1.5, ease=0.65),
        _limb("Elbow", "Right", _turn(1.75 * _FORWARD), begin=0.3, end=1.5, ease=0.65),
    )
    return BuiltinMotion(2.8, gestures)


def _turn(vector: NDArray[np.float64]) -> Turn:
    x, y, z = vector.tolist()
    return x, y, z


def _breathing(seconds: float) -> Iterator[Gesture]:
    """Breathing: whole breaths in the duration of the motion, so that it loops."""
    always = {"begin": -10.0 * seconds, "end": 10.0 * seconds}
    breath = {**always, "frequency": max(1, round(0.3 * seconds)) / seconds}
    yield Gesture("SpineMid", (-0.016, 0.0, 0.0), **breath)
    yield Gesture("Neck", (0.018, 0.0, 0.0), **breath, phase=-0.5)
    yield from _both("Shoulder", (0.0, 0.0, 0.022), **breath, phase=-0.4)
    yield from _both("Elbow", (0.0, 0.0, 0.03), **breath, phase=-0.9)


def _joined(motions: tuple[BuiltinMotion, ...], overlap: float) -> BuiltinMotion:
    """The motions in sequence; each starts `overlap` [s] before the previous one ends."""
    gestures: list[Gesture] = []
    start = 0.0
    for motion in motions:
        gestures += [
            replace(gesture, begin=gesture.begin + start, end=gesture.end + start)
            for gesture in motion.gestures
        ]
        start += motion.seconds - overlap
    return BuiltinMotion(start + overlap, tuple(gestures))


def _motions() -> dict[str, BuiltinMotion]:
    arms, walk, wave, fingers, bow = _arms(), _walk(), _wave(), _fingers(), _bow()
    show = _joined((wave, arms, walk, fingers, bow), overlap=0.4)
    return {"show": show, "arms": arms, "walk": walk, "wave": wave, "fingers": fingers, "bow": bow}


MOTIONS = tuple(_motions())
"""Names of the built-in motions; the first joins all others."""


@cache
def motion_clip(name: str) -> MotionClip:
    """Return one loop of the motion called `name`.

    Raises:
        InputError: no motion has that name; the message lists the known ones.
    """
    if name not in MOTIONS:
        raise InputError(f"no built-in motion is called {name!r}; known: {', '.join(MOTIONS)}")
    motion = _motions()[name]
    gestures = (*motion.gestures, *_breathing(motion.seconds))
    return sample_motion(replace(motion, gestures=gestures))
