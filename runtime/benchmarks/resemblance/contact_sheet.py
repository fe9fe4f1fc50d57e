"""A contact sheet: moments of a performance, the performer's stick figure above the character."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from PIL import Image, ImageDraw, ImageFont

from devices.bodies.body_plan import BodyPlan, Limb
from devices.bodies.joint_names import Side
from devices.bodies.plan_by_names import plan_by_names
from devices.skeleton import Skeleton
from replay.recording import Recording
from runtime.benchmarks.resemblance.body_track import off_body
from runtime.output.files.whole_file import whole_file
from runtime.output.pictures import on_black
from runtime.show.show import Show

Array = NDArray[np.float64]
Picture = NDArray[np.uint8]

MOMENTS = 7
SIZE = (240, 240)  # pixels of each picture
_LETTERS = 12  # pixels
_PAPER, _INK = "white", "black"
_COLOURS = {Side.LEFT: (200, 60, 40), Side.RIGHT: (30, 90, 200), Side.CENTRE: (110, 110, 110)}
_MARGIN = 0.1


class ContactSheet:
    """Collects pictures while a show runs, and lays them out.

    Args:
        recording: of one performer; some evenly spaced moments of it are pictured.
    """

    def __init__(self, recording: Recording) -> None:
        last = len(recording) - 1
        moments = np.linspace(0, last, MOMENTS + 2)[1:-1].round().astype(int)
        self._moments = tuple(dict.fromkeys(moments.tolist()))
        self._recording = recording
        self._pictures: list[Picture] = []

    def add(self, frame: int, show: Show) -> None:
        """Take a picture of a show at a frame, if it is one of the moments.

        The camera looks at where the character is, from the front of the stage.
        """
        scene = show.controls.scene
        if frame not in self._moments or scene is None:
            return
        vertices = show.motions[0].vertices
        box = np.array([vertices.min(axis=0), vertices.max(axis=0)])
        scene.look_at(box)
        self._pictures.append(on_black(show.picture))

    def write(self, path: Path, caption: Sequence[str]) -> None:
        """Write the sheet as a PNG, with lines of text on top.

        Raises:
            InputError: the disk fails.
        """
        width, height = SIZE
        font = ImageFont.load_default(_LETTERS)
        top = len(caption) * (_LETTERS + 4) + 4
        size = (width * max(len(self._pictures), 1), top + 2 * height)
        sheet = Image.new("RGB", size, _PAPER)
        pen = ImageDraw.Draw(sheet)
        for number, line in enumerate(caption):
            pen.text((4, 2 + number * (_LETTERS + 4)), line, fill=_INK, font=font)
        recording = self._recording
        sticks = recording.positions[list(self._moments)].copy()
        sticks[:, off_body(recording.skeleton)] = np.nan
        reach = _reach(sticks)
        moments = list(zip(self._moments, sticks, self._pictures, strict=False))
        for column, (frame, stick, picture) in enumerate(moments):
            place = (column * width, top)
            figure = draw_performer(recording.skeleton, stick, reach)
            sheet.paste(figure, place)
            text = f"{recording.times[frame]:.2f} s"
            pen.text((place[0] + 4, top + 2), text, fill=_INK, font=font)
            sheet.paste(Image.fromarray(picture), (place[0], top + height))
        with whole_file(path) as partial:
            sheet.save(partial, format="PNG")


def draw_performer(skeleton: Skeleton, joints: Array, reach: float) -> Image.Image:
    """Draw a stick figure as the stage's camera sees it; the left red, the right blue.

    Args:
        skeleton: of the performer.
        joints: (J, 3) [m]; NaN where not seen.
        reach: [m] that fill the picture.
    """
    width, height = SIZE
    picture = Image.new("RGB", SIZE, (244, 241, 234))
    pen = ImageDraw.Draw(picture)
    if np.isnan(joints).all():
        return picture
    low, high = np.nanmin(joints, axis=0), np.nanmax(joints, axis=0)
    scale = (1.0 - 2.0 * _MARGIN) * min(width, height) / reach
    x = width / 2 + scale * (joints[:, 0] - 0.5 * (low[0] + high[0]))
    y = height * (1.0 - _MARGIN) - scale * (joints[:, 1] - low[1])
    sides = _sides(plan_by_names(skeleton), skeleton)
    for joint in np.argsort(np.nan_to_num(joints[:, 2])):  # the nearest is drawn last
        parent = int(skeleton.parents[joint])
        if parent < 0 or not np.isfinite([x[joint], x[parent]]).all():
            continue
        line = (x[parent], y[parent], x[joint], y[joint])
        pen.line(line, fill=_COLOURS[sides[joint]], width=3)
    return picture


def _reach(sticks: Array) -> float:
    """The largest width or height [m] of a stick figure (M, J, 3)."""
    with_any = sticks[np.isfinite(sticks[..., 0]).any(axis=1)]
    if not len(with_any):
        return 1.0
    sizes = np.nanmax(with_any, axis=1) - np.nanmin(with_any, axis=1)
    return max(float(sizes[:, :2].max()), 1e-9)


def _sides(plan: BodyPlan | None, skeleton: Skeleton) -> list[Side]:
    """The side of each joint: its limb's, and all that hang on it."""
    sides = [Side.CENTRE] * len(skeleton.names)
    if plan is None:
        return sides
    for limbs in (plan.arms, plan.legs):
        for side, limb in limbs.items():
            for joint in skeleton.tree.subtree(_second(limb)):
                sides[joint] = side
    return sides


def _second(limb: Limb) -> int:
    return limb.upper[1]
