"""Every class that remembers something between frames is listed here and can be put back.

The test compares everything that a show holds before and after frames. An object of ours whose own
attributes have changed belongs to a class that must be listed.
"""

from __future__ import annotations

import hashlib
from collections import deque
from collections.abc import Iterator
from dataclasses import is_dataclass, replace
from importlib import import_module
from typing import Any

import numpy as np

from devices.bodies.plan_by_names import plan_by_names
from replay.player import EveryFrame, Player
from runtime.conditioning.switches import SWITCHES
from runtime.control.actions import ACTIONS
from runtime.show.settings import CharacterSettings, ShowSettings
from runtime.show.show import Show
from tests.runtime.stick_figures import make_figure, record, waving

ROOMS = ("devices.", "replay.", "solvers.", "runtime.")

Done = list[tuple[str, float | None]]

REMEMBERS = {
    "replay.fill.Filler",
    "replay.player.Player",
    "runtime.conditioning.calibration_pose.CalibrationPose",
    "runtime.conditioning.conditioner.Conditioner",
    "runtime.conditioning.conditioner._PerformerMemory",
    "runtime.conditioning.faults.Faults",
    "runtime.conditioning.identities.Identities",
    "runtime.conditioning.levelling.Levelling",
    "runtime.conditioning.rejoining.Rejoining",
    "runtime.conditioning.silence.Silence",
    "runtime.conditioning.stature.Stature",
    "runtime.conditioning.timeline.Timeline",
    "runtime.driving.exaggeration.Exaggeration",
    "runtime.driving.limb_release.LimbRelease",
    "runtime.driving.match_session.MatchSession",
    "runtime.driving.performer.Performer",
    "runtime.driving.body.body_driver.BodyDriver",
    "runtime.driving.body.footing.Footing",
    "runtime.driving.body.steady_trunk.SteadyTrunk",
    "runtime.driving.polyline_driver.SkinnedPolylineDriver",
    "runtime.driving.matching.puppet_match.PuppetMatch",
    "runtime.driving.unfreeze_blend.UnfreezeBlend",
    "runtime.puppet.deformable_surface.DeformableSurface",
    "runtime.puppet.puppet.Puppet",
    "runtime.puppet.change_blend.ChangeBlend",
    "runtime.puppet.travel.Travel",
    "runtime.show.act_group.Act",
    "runtime.show.arrivals.Arrivals",
    "runtime.show.loop.FrameLoop",
    "runtime.show.performer_slots.PerformerSlots",
    "solvers.deform.creases.Creases",
    "solvers.deform.handle_influence.HandleInfluence",
    "solvers.retarget.chain_retargets.ChainRetargets",
    "solvers.retarget.foot_contacts.FootContacts",
    "solvers.retarget.foot_lock.FootLock",
    "solvers.retarget.hip_shift.HipShift",
    "solvers.retarget.limb_posing.LimbPoser",
    "solvers.retarget.sole_pitch.SolePitch",
    "solvers.retarget.steady_ends.SteadyEnds",
    "solvers.retarget.match_hysteresis.MatchHysteresis",
    "solvers.signal.floor_plane.FloorFit",
    "solvers.signal.one_euro.OneEuroFilter",
    "solvers.signal.prediction.Predictor",
    "solvers.signal.springs.Springs",
    "solvers.squash_stretch.SquashStretchSolver",
}
"""Classes with a state of their own."""

IN_ANOTHERS_STATE = {
    "solvers.linear.block_factor.BlockFactor": "solvers.squash_stretch.SquashStretchSolver",
    "solvers.linear.constrained_system.ConstrainedSystem": (
        "solvers.squash_stretch.SquashStretchSolver"
    ),
}
"""Classes whose memory can be computed again, and the class whose state holds what is needed."""

NO_MEMORY = {
    "replay.recorded_stream.RecordedStream": "keeps the newest frame for takes, not for the show",
    "runtime.show.clock.StageTimer": "measures; no frame depends on it",
    "runtime.status.stream_watch.StreamWatch": "watches the host's clock, not the stream's frames",
    "solvers.deform.skinning.SkinnedSurface": "scratch arrays, written before they are read",
    "solvers.deform.rotation_priors.RotationPriors": "scratch arrays, written before they are read",
}
"""Classes that change and remember nothing that a frame depends on, and why."""

MEASURES = ("runtime.output.",)
"""Rooms that only look at what was performed."""


def is_ours(value: object) -> bool:
    return type(value).__module__.startswith(ROOMS) and not isinstance(value, type)


def is_value(value: object) -> bool:
    """Whether it never changes, so that whoever holds it changes by holding another."""
    return is_dataclass(value) and value.__dataclass_params__.frozen and not owns_mutable(value)


def owns_mutable(value: object) -> bool:
    return any(is_ours(each) and not is_dataclass(each) for _, each in attributes(value))


def attributes(value: object) -> Iterator[tuple[str, Any]]:
    yield from getattr(value, "__dict__", {}).items()
    for base in type(value).__mro__:
        for name in getattr(base, "__slots__", ()):
            if hasattr(value, name):
                yield name, getattr(value, name)


def items(value: object) -> list[Any] | None:
    """What a container holds; None for anything else."""
    if isinstance(value, dict):
        return [*value.keys(), *value.values()]
    return list(value) if isinstance(value, list | tuple | set | frozenset | deque) else None


def objects(root: object) -> dict[int, object]:
    """Everything of our classes that a show holds, by identity."""
    found: dict[int, object] = {}
    seen: set[int] = set()
    waiting = [root]
    while waiting:
        value = waiting.pop()
        if id(value) in seen:
            continue
        seen.add(id(value))
        if type(value).__module__.startswith(MEASURES):
            continue
        if is_ours(value):
            found[id(value)] = value
            waiting += [each for _, each in attributes(value)]
        elif (inside := items(value)) is not None:
            waiting += inside
    return found


def shape(value: object, depth: int = 0) -> str:
    """What an attribute is, as text: arrays by their bytes, objects of ours by identity."""
    if isinstance(value, np.ndarray):
        fields = value.dtype.names or [()]
        return "".join(hashlib.sha256(value[field].tobytes()).hexdigest() for field in fields)
    if (inside := items(value)) is not None and depth < 4:
        return f"{type(value).__name__}({','.join(shape(each, depth + 1) for each in inside)})"
    return repr(value) if isinstance(value, bool | int | float | str | None) else str(id(value))


def own(value: object) -> dict[str, str]:
    return {name: shape(each) for name, each in attributes(value)}


def changed(show: Show, acts: Done) -> set[str]:
    """The classes whose objects change while a few frames are performed, after these actions."""
    loop = show.controls.loop
    before = objects(loop)
    was = {key: own(value) for key, value in before.items() if not is_value(value)}
    for name, value in acts:
        action = ACTIONS[name]
        action.press(show.controls) if value is None else action.write(show.controls, value)
    for _ in range(3):
        show.tick()
        show.settle()
    out = set()
    for key, value in before.items():
        if key in was and own(value) != was[key]:
            out.add(f"{type(value).__module__}.{type(value).__qualname__}")
    return out


def test_every_class_that_remembers_is_known_and_can_be_put_back() -> None:
    recording = record(waving(90))
    recording.positions[20:60, :8] = np.nan
    recording.confidence[20:60, :8] = 0.0
    own_settings = CharacterSettings(energy="smooth-rotations", cartoon=0.6)
    done: dict[int, Done] = {
        8: [("freeze", 1.0)],
        11: [("freeze", 0.0)],
        14: [("next-match", None)],
        18: [("accept", None)],
        22: [("match-again", None)],
        25: [("accept", None)],
    }
    settings = ShowSettings(characters=(own_settings,))
    found: set[str] = set()
    figure = make_figure()
    body = replace(figure, plan=plan_by_names(figure.skeleton))
    for character in (figure, body):
        with Show(Player(recording, EveryFrame()), [character], settings) as show:
            for name in SWITCHES:
                ACTIONS[name].write(show.controls, float(name != "mirror"))
            for step in range(28 if character is figure else 13):
                found |= changed(show, done.get(step, []))
    assert found == REMEMBERS | IN_ANOTHERS_STATE.keys() | NO_MEMORY.keys()
    for name in REMEMBERS:
        module, _, class_name = name.rpartition(".")
        methods = dir(getattr(import_module(module), class_name))
        assert {"snapshot", "restore"} <= set(methods), name
    assert set(IN_ANOTHERS_STATE.values()) <= REMEMBERS
