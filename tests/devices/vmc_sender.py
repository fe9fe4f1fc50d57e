"""What a VMC performer sends, encoded by python-osc: independent of our own reader and writer."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
from pythonosc.osc_bundle import OscBundle
from pythonosc.osc_bundle_builder import IMMEDIATELY, OscBundleBuilder
from pythonosc.osc_message import OscMessage
from pythonosc.osc_message_builder import OscMessageBuilder
from scipy.spatial.transform import Rotation

from devices.bodies.humanoid import humanoid_skeleton

MIRROR = np.diag([-1.0, 1.0, 1.0])
HUMAN = humanoid_skeleton()
IDENTITY = (0.0, 0.0, 0.0, 1.0)


def message(address: str, *arguments: object) -> OscMessage:
    builder = OscMessageBuilder(address)
    for argument in arguments:
        builder.add_arg(argument)
    return builder.build()


def built(messages: Sequence[OscMessage], timetag: float = IMMEDIATELY) -> OscBundle:
    """One bundle as python-osc's clients send it; its time tag in seconds since 1970."""
    builder = OscBundleBuilder(timetag)
    for one in messages:
        builder.add_content(one)
    return builder.build()


def bundle(messages: Sequence[OscMessage], timetag: float = IMMEDIATELY) -> bytes:
    """The bytes of one bundle; its time tag in seconds since 1970."""
    return built(messages, timetag).dgram


def unity(rotation: Rotation) -> list[float]:
    """A rotation of ours as Unity writes it, by reflecting the matrix and not by a formula."""
    return Rotation.from_matrix(MIRROR @ rotation.as_matrix() @ MIRROR).as_quat().tolist()


def bones(
    turns: Mapping[str, Rotation] | None = None,
    *,
    offsets: np.ndarray | None = None,
    only: Sequence[str] = HUMAN.names,
) -> list[OscMessage]:
    """Bone messages of a body with these local rotations, in our own space, and local offsets."""
    turns = turns or {}
    offsets = local_offsets() if offsets is None else offsets
    messages = []
    for joint, name in enumerate(HUMAN.names):
        if name in only:
            turn = unity(turns[name]) if name in turns else IDENTITY
            place = (MIRROR @ offsets[joint]).tolist()
            messages.append(message("/VMC/Ext/Bone/Pos", name, *place, *turn))
    return messages


def local_offsets() -> np.ndarray:
    """The offsets of the built-in body; of the hips from the world."""
    rest, parents = HUMAN.rest_positions, HUMAN.parents
    return rest - np.where(parents[:, None] >= 0, rest[parents], 0.0)


def root(position: Sequence[float] = (0.0, 0.0, 0.0), turn: Rotation | None = None) -> OscMessage:
    """The root at a place of ours."""
    place = (MIRROR @ np.array(position)).tolist()
    return message("/VMC/Ext/Root/Pos", "root", *place, *(unity(turn) if turn else IDENTITY))


def ok(*state: int) -> OscMessage:
    return message("/VMC/Ext/OK", *(state or (1,)))


def at(seconds: float) -> OscMessage:
    return message("/VMC/Ext/T", float(seconds))


def slime(seconds: float, turns: Mapping[str, Rotation] | None = None) -> bytes:
    """One frame as SlimeVR sends it: a single bundle that begins with the time."""
    return bundle([at(seconds), ok(), root(), *bones(turns)])


def expected(turns: Mapping[str, Rotation], offsets: np.ndarray | None = None) -> np.ndarray:
    """Where the joints are, bone by bone down the tree with SciPy."""
    offsets = local_offsets() if offsets is None else offsets
    world: dict[int, tuple[np.ndarray, Rotation]] = {}
    for joint in HUMAN.order:
        above = int(HUMAN.parents[joint])
        place, turn = world[above] if above >= 0 else (np.zeros(3), Rotation.identity())
        own = turns.get(HUMAN.names[joint], Rotation.identity())
        world[joint] = place + turn.apply(offsets[joint]), turn * own
    return np.array([world[joint][0] for joint in range(len(HUMAN.names))])
