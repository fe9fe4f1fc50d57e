"""The scene: a stage with the puppets on it, the camera, and the inset of the performer."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from devices.bodies.rest_heading import rest_heading
from devices.skeleton import Skeleton
from runtime.characters.character import Character
from runtime.control.ramp import Ramp
from runtime.driving.driver import Highlight, MappedDriver
from runtime.driving.performer import Pose
from runtime.driving.reach import Reach
from runtime.puppet.puppet import Motion, Puppet
from runtime.render.background import Background
from runtime.render.camera import (
    DEFAULT_PITCH,
    HIGHEST_PITCH,
    LOWEST_PITCH,
    Camera,
    front_camera,
)
from runtime.render.frame import StageSet, stage_set
from runtime.render.glide import SLACK, Glide, GlideState
from runtime.render.inset import SkeletonInset, body_bones, inset_circle, inset_side
from runtime.render.stage import Stage
from runtime.session.ghost_doubles import GhostDoubles
from runtime.session.onion_skin import Ghost
from runtime.show.lights import Lights, pair_colours
from solvers.skeleton.widest_view import bones_of, shown_length, widest_view

if TYPE_CHECKING:
    import moderngl

Colours = NDArray[np.float64]

GAP = 0.18  # [m] of floor between two characters
BLACKOUT = 0.3  # [s] to black, and back to light
MARGIN = 0.06  # of the picture on each side that stays free
LONG = 1.4  # times further back to frame the whole way: a longer way is followed
CAPTION = 0.1  # of half the picture's height that captions take below what is framed
NOTHING_TAKEN = (0.0, 0.0, 0.0, 0.0)
ROOM = 0.12  # share of a character's size that stays in view around its rest pose


class Scene:
    """Puts characters side by side on one stage and draws their motion.

    Args:
        context: the OpenGL context of this thread.
        size: width and height of the picture [px].
        puppets: on the stage, from left to right.
        performer: the skeleton that the inset shows.
        background: replaces backdrop and floor; the picture is then plain and without captions.
        plain: draw neither the highlights nor the inset.
        clock: host monotonic time [s].

    Attributes:
        stage: draws the characters and the inset.
        camera: the view of the picture while the characters are at home; it glides after them,
            unless all that they do fits into one picture.
        highlights: whether the drivers' highlights are drawn.
        focus: the number of the puppet whose performer the inset shows.
        performers: the number of each puppet's performer; all follow one at first.
        blackout: 0 for light, 1 for black.
        ghosts: gives the characters at other moments, as an onion skin; None for none.
        lights: what lights up in place of the drivers' highlights; None for these.
        seen_by: the camera of the newest picture.
        taken: shares of the picture at its left, right, top and bottom that something lies over,
            as a panel does in a window: all that is framed is drawn clear of them.
    """

    def __init__(
        self,
        context: moderngl.Context,
        size: tuple[int, int],
        puppets: Sequence[Puppet],
        performer: Skeleton,
        *,
        background: Background | None = None,
        plain: bool = False,
        clock: Callable[[], float] = time.perf_counter,
    ) -> None:
        self.blackout = Ramp(BLACKOUT, clock)
        self.stage = Stage(context, size, background=background)
        self._puppets = puppets
        self._captions = len(puppets) > 1 and background is None
        places = _side_by_side([puppet.character for puppet in puppets])
        self._characters = [
            self.stage.add(
                puppet.character,
                position=(place, 0.0, 0.0),
                caption=puppet.character.name if self._captions else "",
            )
            for puppet, place in zip(puppets, places, strict=True)
        ]
        plain = plain or background is not None
        self._inset = None if plain else SkeletonInset(*body_bones(performer))
        self.highlights = not plain
        self.focus = 0
        self.performers: Sequence[int] = [0] * len(puppets)
        self.camera = self.seen_by = front_camera()
        self.lights: Lights | None = None
        self.ghosts: Callable[[], Sequence[Ghost]] | None = None
        self._doubles = GhostDoubles(self.stage, self._characters)
        self.taken = NOTHING_TAKEN
        self._pose: Pose | None = None
        self._close_up: Camera | None = None
        self._widest_views: dict[int | None, tuple[float, float]] = {}
        self._rest = self.stage.boxes
        self._reaches: Sequence[Reach] | None = None
        self._glide = Glide(len(puppets))
        self.frame_all()

    def frame_all(self, reaches: Sequence[Reach] | None = None) -> None:
        """Move the camera so that every character is in view, with room to move.

        A short way over the stage is framed as a whole. A longer one is followed, and so is
        whatever may come where nobody knows it, as in a live show.

        Args:
            reaches: the room that each puppet takes in the show. If None, those given before; if
                none were, a guess by the rest poses.
        """
        self._reaches = reaches = self._reaches if reaches is None else reaches
        ways = np.zeros((len(self._rest), 2, 2))
        if reaches is None:
            room = ROOM * np.ptp(self._rest, axis=1).max(axis=1)[:, None]
            boxes = self._rest.copy()
            boxes[:, 0, ::2] -= room
            boxes[:, 1] += room
        else:
            boxes = self._with_rest([reach.around for reach in reaches])
        camera, self._follows = self._framed(boxes), True
        if reaches is not None and not any(puppet.travel.in_place for puppet in self._puppets):
            whole = self._framed(self._with_rest([reach.path for reach in reaches]))
            if whole.distance <= LONG * camera.distance:
                camera, self._follows = whole, False
                ways = np.array([reach.way for reach in reaches])
            else:
                boxes[:, :, ::2] += [[-SLACK], [SLACK]]  # the camera stays behind a little
                camera = self._framed(boxes)
        homes = np.array([character.pool[:2] - character.spot for character in self._characters])
        self._marks = homes[:, None] + ways
        self._boxes, self.camera = boxes, camera
        below = CAPTION if self._captions else 0.0
        free = (2.0 * MARGIN, 2.0 * MARGIN + below)
        across, high = np.add(camera.fills(boxes, self.stage.aspect), free)
        self._filled = min(across, 1.0), min(high, 1.0)

    def view_from_front(self) -> None:
        """Look from the front again, with every character in view."""
        self.camera = front_camera()
        self.frame_all()

    def view_widest(self, number: int | None) -> None:
        """Look from where the most bone length is seen, of one puppet or of all (None)."""
        azimuth, pitch = self._widest(number)
        self.camera = front_camera().orbit(azimuth, pitch - DEFAULT_PITCH)
        self.frame_all()

    def shown_share(self, number: int | None) -> float:
        """Return how much bone length is seen now, as a share of what the widest view shows."""
        azimuth, pitch = self._widest(number)
        widest = front_camera().orbit(azimuth, pitch - DEFAULT_PITCH)
        toward = np.array([each.view_rotation[2] for each in (self.camera, widest)])
        now, most = shown_length(self._bones(number), toward).tolist()
        return float(now / max(most, 1e-9))

    def _widest(self, number: int | None) -> tuple[float, float]:
        """Azimuth and pitch [rad] of the widest view, found once."""
        if number not in self._widest_views:
            self._widest_views[number] = widest_view(
                self._bones(number), DEFAULT_PITCH, LOWEST_PITCH, HIGHEST_PITCH
            )
        return self._widest_views[number]

    def _bones(self, number: int | None) -> NDArray[np.float64]:
        """The bones (B, 3) [m] at rest of one puppet, or of all."""
        puppets = self._puppets if number is None else [self._puppets[number]]
        return np.concatenate([bones_of(puppet.bound_skeleton.tree) for puppet in puppets])

    def _framed(self, boxes: NDArray[np.float64]) -> Camera:
        """The camera, moved so that boxes (A, 2, 3) [m] fill the picture."""
        return self.camera.frame(boxes, self.stage.aspect, margin=MARGIN)

    def _with_rest(self, boxes: Sequence[NDArray[np.float64]]) -> NDArray[np.float64]:
        """Boxes (A, 2, 3) [m] of the puppets on the stage, each with its rest pose."""
        places = np.array([character.position for character in self._characters])[:, None]
        low, high = np.moveaxis(np.array(boxes) + places, 1, 0)
        rest_low, rest_high = np.moveaxis(self._rest, 1, 0)
        return np.stack([np.minimum(low, rest_low), np.maximum(high, rest_high)], axis=1)

    def follow(self, time: float) -> None:
        """Let camera and spot lights glide on after the puppets, to the show's time [s]."""
        self._glide.follow(np.array([puppet.travelled for puppet in self._puppets]), time)

    def snapshot(self) -> GlideState:
        """Return what is remembered between frames."""
        return self._glide.snapshot()

    def restore(self, state: GlideState) -> None:
        """Go back to a snapshot of a scene with as many puppets."""
        self._glide.restore(state)

    def show(self, pose: Pose | None, motions: Sequence[Motion]) -> None:
        """Draw the puppets as they are now, and the performer in the inset."""
        self.upload(motions)
        self.draw(pose)

    def upload(self, motions: Sequence[Motion]) -> None:
        """Upload the vertices of the puppets to the GPU."""
        for character, motion in zip(self._characters, motions, strict=True):
            character.update(motion.vertices)

    def redraw(self) -> None:
        """Draw once more what was drawn last."""
        self.draw(self._pose)

    def draw_for_audience(self) -> None:
        """Draw once more what was drawn last: whole, without highlights and without the inset."""
        kept = self.highlights, self._inset, self.seen_by
        self.highlights, self._inset = False, None
        with self.for_outputs():
            self.redraw()
        self.highlights, self._inset, self.seen_by = kept

    @contextmanager
    def for_outputs(self) -> Iterator[None]:
        """Draw without what only the operator sees: the panel's room, ghosts, what is clicked."""
        kept = self.taken, self.lights, self.ghosts
        self.taken, self.lights, self.ghosts = NOTHING_TAKEN, None, None
        try:
            yield
        finally:
            self.taken, self.lights, self.ghosts = kept

    @property
    def is_for_operator(self) -> bool:
        """Whether something is drawn that only the operator sees."""
        special = self.lights is not None or self.ghosts is not None
        return special or self.taken != NOTHING_TAKEN

    def draw(self, pose: Pose | None) -> None:
        """Draw the uploaded puppets with their highlights, and the performer in the inset."""
        self._pose = pose
        highlights = [puppet.highlights for puppet in self._puppets]
        colours = _colours_of(highlights)
        for number, own in enumerate(highlights):
            self._light_up(number, own if self.highlights else [], colours[number])
        if self._inset is not None and pose is not None:
            joints = len(pose.seen)
            if self.lights is not None:
                of_joints = self.lights.joint_colours(joints)
            else:
                shown = self.performers[self.focus]
                followers = [n for n, own in enumerate(self.performers) if own == shown]
                of_joints = _joint_colours(joints, [(highlights[n], colours[n]) for n in followers])
            self._inset.update(
                pose.seen,
                colours=of_joints,
                dimmed=pose.filled,
                view_rotation=_side_of(self._puppets[self.focus]),
            )
        self.stage.brightness = 1.0 - self.blackout.level
        for character, spot in zip(self._characters, self._glide.places, strict=True):
            character.spot = spot
        inset = self._inset if pose is not None else None
        camera = self._gliding_camera()
        if self.taken != NOTHING_TAKEN:
            camera = camera.clear_of(*self.taken, filled=self._filled)
        self.seen_by = camera
        ghosts = self.ghosts() if self.ghosts is not None and self._inset is not None else ()
        self.stage.draw(camera, inset, self._stage_set(), self._doubles.layers(ghosts))

    def _light_up(self, number: int, highlights: Sequence[Highlight], colours: Colours) -> None:
        """Light up chains of a puppet: its driver's, unless others are to be seen."""
        if self.lights is None:
            chains = [each.points for each in highlights]
            self._characters[number].highlight(chains, colours[: len(chains)])
            return
        lit = self.lights.chains(number)
        self._characters[number].highlight(
            [each.points for each in lit],
            np.array([each.colour for each in lit]),
            np.array([each.width for each in lit]),
        )

    def position(self, number: int) -> NDArray[np.float64]:
        """Return where a puppet's origin is on the stage (3,) [m], by its number."""
        return self._characters[number].position

    @property
    def inset_circle(self) -> tuple[tuple[float, float], float]:
        """The inset's centre [px] from the upper left corner, and its radius [px]; 0 for none."""
        return inset_circle(self.stage.size) if self._inset is not None else ((0.0, 0.0), 0.0)

    @property
    def performer_on_screen(self) -> NDArray[np.float64] | None:
        """(J, 2) [px] the joints in the inset, NaN where none is drawn; None without an inset."""
        if self._inset is None or self._pose is None:
            return None
        (x, y), radius = self.inset_circle
        return self._inset.places * (radius, -radius) + (x, y)

    @property
    def inset_side(self) -> float:
        """The side [px] of the square in the upper left that the inset takes; 0 without one."""
        return 0.0 if self._inset is None else inset_side(self.stage.size)

    def picture(self) -> NDArray[np.uint8]:
        """Return the newest picture (H, W, 4): sRGB with straight alpha, top row first."""
        return self.stage.read()

    def look_at(self, box: NDArray[np.float64]) -> None:
        """Show what is in a box (2, 3) [m] from the front, in the pictures from now on.

        The camera glides no more; spot lights and curtain still do.
        """
        self._close_up = front_camera().frame(box, self.stage.aspect)

    def _gliding_camera(self) -> Camera:
        """The camera where it has glided to: as far on, and back, as framing all takes it."""
        if self._close_up is not None:
            return self._close_up
        if not self._follows or not self._glide.places.any():
            return self.camera
        now = self._boxes.copy()
        now[:, :, ::2] += self._glide.places[:, None]
        home, there = self._framed(self._boxes), self._framed(now)
        shift = np.subtract(there.target, home.target)
        return self.camera.moved(shift, there.distance / home.distance)

    def _stage_set(self) -> StageSet:
        """The curtain: it stays round all that is framed, and glides with the camera."""
        if not self._follows:
            return stage_set(self._marks.reshape(-1, 2))
        slide = float(self._glide.places[:, 0].mean())
        return stage_set(self._marks[:, 0] + self._glide.places, slide)

    def close(self) -> None:
        """Free the stage."""
        self.stage.release()


def _side_by_side(characters: Sequence[Character]) -> list[float]:
    """Return the x coordinate [m] of each character in a row that is centred."""
    places, right = [], 0.0
    for character in characters:
        low, high = character.vertices[:, 0].min(), character.vertices[:, 0].max()
        places.append(right - float(low))
        right += float(high - low) + GAP
    middle = (right - GAP) / 2.0
    if len(characters) == 1:
        return [0.0]
    return [place - middle for place in places]


def _side_of(puppet: Puppet) -> NDArray[np.float64] | None:
    """The turn (3, 3) that shows a performer from the side from which the puppet is seen.

    None for the front, from which chains are matched, too.
    """
    plan = puppet.character.plan
    if plan is None or isinstance(puppet.driver, MappedDriver):
        return None
    quarters = round(rest_heading(puppet.character.skeleton, plan) / (np.pi / 2.0))
    if quarters == 0:
        return None
    sine, cosine = np.sin(quarters * np.pi / 2.0), np.cos(quarters * np.pi / 2.0)
    return np.array([[cosine, 0.0, sine], [0.0, 1.0, 0.0], [-sine, 0.0, cosine]])


def _colours_of(highlights: Sequence[Sequence[Highlight]]) -> list[Colours]:
    """Linear RGB of the highlights of each puppet (H, 3): one for a part of the performer."""
    colours = pair_colours([each.joints for own in highlights for each in own])
    ends = np.cumsum([len(own) for own in highlights])[:-1]
    return list(np.split(colours, ends))


def _joint_colours(joints: int, lit: Sequence[tuple[Sequence[Highlight], Colours]]) -> Colours:
    """Linear RGB of each joint (J, 3): that of its highlight on any puppet; NaN where it has none.

    Where chains of two puppets share a joint, the first puppet's colour counts.
    """
    of_joints = np.full((joints, 3), np.nan)
    for highlights, colours in reversed(lit):
        for highlight, colour in zip(highlights, colours, strict=True):
            of_joints[list(highlight.joints)] = colour
    return of_joints
