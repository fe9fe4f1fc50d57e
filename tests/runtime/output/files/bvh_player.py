"""Plays a .bvh with nothing of ours: the tokens of its text, and matrices."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from numpy.typing import NDArray

AXES = {"X": 0, "Y": 1, "Z": 2}


class BvhPlayer:
    """Poses the joints of a .bvh, end sites left out.

    Attributes:
        names: of the joints.
        step: [s] between two frames.
    """

    def __init__(self, path: Path) -> None:
        hierarchy, motion = path.read_text().split("MOTION")
        words, stack = hierarchy.split(), []
        self.names: list[str] = []
        self.parents: list[int] = []
        self.offsets: list[NDArray[np.float64]] = []
        self.channels: list[list[str]] = []
        for at, word in enumerate(words):
            if word in ("ROOT", "JOINT", "End"):
                self.parents.append(stack[-1] if stack else -1)
                self.names.append("" if word == "End" else words[at + 1])
                self.channels.append([])
                stack.append(len(self.names) - 1)
            elif word == "OFFSET":
                self.offsets.append(np.array(words[at + 1 : at + 4], float))
            elif word == "CHANNELS":
                self.channels[stack[-1]] = words[at + 2 : at + 2 + int(words[at + 1])]
            elif word == "}":
                stack.pop()
        head, _, rows = motion.strip().partition("Frame Time:")
        step, _, rows = rows.partition("\n")
        self.step = float(step)
        self.rows = np.array([row.split() for row in rows.strip().split("\n")], float)
        assert int(head.split()[1]) == len(self.rows)

    def positions(self, frame: int) -> dict[str, NDArray[np.float64]]:
        """Where each joint (3,) is in a frame, in the file's unit."""
        values = iter(self.rows[frame])
        worlds: list[NDArray[np.float64]] = []
        for parent, offset, channels in zip(self.parents, self.offsets, self.channels, strict=True):
            local = np.eye(4)
            local[:3, 3] = offset
            for channel in channels:
                axis, value = AXES[channel[0]], next(values)
                if channel.endswith("position"):
                    local[axis, 3] = value
                else:
                    first, second = (axis + 1) % 3, (axis + 2) % 3
                    turn, angle = np.eye(4), np.radians(value)
                    turn[first, first] = turn[second, second] = np.cos(angle)
                    turn[second, first], turn[first, second] = np.sin(angle), -np.sin(angle)
                    local = local @ turn
            worlds.append(local if parent < 0 else worlds[parent] @ local)
        assert not list(values)
        return {name: world[:3, 3] for name, world in zip(self.names, worlds, strict=True) if name}
