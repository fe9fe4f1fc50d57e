"""The frame loop: each tick receives, matches, retargets, deforms, draws and writes one frame.

The data goes one way, from the stream to the outputs. The loop is the only caller of the solvers
and of OpenGL while a show runs.
"""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace

from devices.skeleton import SkeletonFrame
from devices.stream import SkeletonStream
from runtime.conditioning.switches import Conditioning
from runtime.driving.performer import Pose
from runtime.output.output import Output, PerformedFrame
from runtime.output.report.report import Report
from runtime.puppet.puppet import Motion
from runtime.render.glide import GlideState
from runtime.show.act_group import Act, ActState
from runtime.show.arrivals import Arrivals, ArrivalsState
from runtime.show.clock import StageTimer
from runtime.show.picture_schedule import PictureSchedule
from runtime.show.scene import Scene
from runtime.status.stream_watch import StreamWatch


@dataclass(frozen=True, slots=True, eq=False)
class FrameLoopState:
    """The state of a `FrameLoop` between two frames; the stream has its own.

    Attributes:
        arrivals, acts: the states of its parts.
        motions: each puppet as it was performed last, with arrays of its own.
        unsettled: whether the surfaces are still to settle.
        pictured: [s] the show's time of the last picture.
        scene: of the scene; None without one.
        frames, seconds: as of `FrameLoop`.
        began: [s] time of the first frame.
    """

    arrivals: ArrivalsState
    acts: tuple[ActState, ...]
    motions: tuple[Motion, ...]
    unsettled: bool
    pictured: float
    scene: GlideState | None
    frames: int
    seconds: float
    began: float


class FrameLoop:
    """Drives puppets by the newest frames of a stream.

    Args:
        stream: where the frames come from.
        acts: each performer with their puppets, in the order of the performers' slots.
        report: collects times and counts.
        scene: draws all puppets, in the order of the acts; None where no window and no output
            needs a picture.
        outputs: for each puppet, what writes its performance.
        conditioning: how the stream is put in order; as it comes if None.
        shown: whether a window shows every tick.
        watch: knows how long a live stream has been silent; None where silence is no matter.
        clock: host monotonic time [s].

    Attributes:
        frozen: whether the characters are frozen. Frames are still received, recorded and
            published. Afterwards the characters blend to the pose of their performer.
        goes_on: whether the show goes on where no performer sends, as while a session plays.
        before: is called with the time [s] of each frame just before it is performed.
        frames: frames performed so far.
        seconds: performer's time from the first of them to the last [s].
        latency: [s] from the newest frame's arrival until it was handed on to be shown; NaN if its
            arrival is not known.
        motions: each puppet as it was performed last.
    """

    def __init__(
        self,
        stream: SkeletonStream,
        acts: Sequence[Act],
        *,
        report: Report,
        scene: Scene | None,
        outputs: Sequence[Sequence[Output]],
        conditioning: Conditioning | None = None,
        shown: bool = False,
        watch: StreamWatch | None = None,
        clock: Callable[[], float] = time.perf_counter,
    ) -> None:
        self.frozen = False
        self.goes_on: Callable[[], bool] = lambda: False
        self.before: Callable[[float], None] = lambda _: None
        self.frames = 0
        self.seconds = 0.0
        self.latency = math.nan
        self._began = math.nan
        self._arrivals = Arrivals(stream, len(acts), conditioning)
        self._watch = watch
        self._acts = acts
        self._report = report
        self._scene = scene
        self._outputs = outputs
        every = [output for own in outputs for output in own]
        self._pictures = PictureSchedule(scene, every, shown=shown, clock=clock)
        self._clock = clock
        self._timer = StageTimer()
        self.motions = [puppet.deform() for act in acts for puppet in act.puppets]
        self._unsettled = False
        self._outdated = False
        self._last: SkeletonFrame | None = None

    @property
    def received(self) -> int:
        """Frames that came so far."""
        return self._arrivals.count

    def tick(self) -> bool:
        """Perform what has come since the last tick; draw in any case for a window.

        Returns:
            Whether a frame was performed.
        """
        self.settle()
        self._timer.reset()
        with self._timer.stage("frame"):
            with self._timer.stage("poll"):
                silence = 0.0 if self._watch is None else self._watch.silence
                now = self._clock() if self.goes_on() else math.nan
                arrived = self._arrivals.poll(silence, goes_on_at=now)
                self._report.dropped += arrived.dropped
                if self._watch is not None and arrived.came:
                    self._watch.note()
            if arrived.newest is not None:
                self.before(arrived.newest.time)
                self._perform(arrived.newest, arrived.of_slots)
                self._publish(arrived.newest)
                self._count(arrived.newest)
            else:
                self._revise()
                self._pictures.idle(self.draw)
        if arrived.newest is None:
            return False
        for stage, spent in self._timer.stages.items():
            self._report.times.add(stage, spent)
        return True

    def advance(self) -> bool:
        """Perform what has come since the last tick, without showing or publishing it.

        The state afterwards is that after `tick`.

        Returns:
            Whether a frame was performed.
        """
        self.settle()
        arrived = self._arrivals.poll()
        if arrived.newest is None:
            return False
        self._perform(arrived.newest, arrived.of_slots)
        self._pictures.is_due(arrived.newest.time)
        self._count(arrived.newest)
        return True

    def snapshot(self) -> FrameLoopState:
        """Return everything that the next frames depend on, besides stream and settings."""
        return FrameLoopState(
            self._arrivals.snapshot(),
            tuple(act.snapshot() for act in self._acts),
            _copies(self.motions),
            self._unsettled,
            self._pictures.snapshot(),
            None if self._scene is None else self._scene.snapshot(),
            self.frames,
            self.seconds,
            self._began,
        )

    def restore(self, state: FrameLoopState) -> None:
        """Go back to a snapshot of a loop with the same acts; `frozen` stays as it is."""
        self._arrivals.restore(state.arrivals)
        for act, own in zip(self._acts, state.acts, strict=True):
            act.restore(own)
        self.motions = list(_copies(state.motions))
        self._unsettled = state.unsettled
        self._pictures.restore(state.pictured)
        if self._scene is not None and state.scene is not None:
            self._scene.restore(state.scene)
        self.frames, self.seconds, self._began = state.frames, state.seconds, state.began

    def settle(self) -> None:
        """Bring the surfaces nearer to their targets, between one tick and the next.

        Else the next tick begins with it. What is shown is the same.
        """
        if not self._unsettled:
            return
        self._unsettled = False
        with self._report.times.measure("settle"):
            for act in self._acts:
                for puppet in act.puppets:
                    puppet.settle()

    def perform_again(self) -> None:
        """Perform the last poses anew where no frame comes, as after an action in a pause."""
        self._outdated = True

    def hurry(self) -> None:
        """Leave the surfaces as they were shown: there is no time to settle them."""
        self._unsettled = False

    def draw(self) -> None:
        """Draw what was performed last, where there is a scene."""
        if self._scene is not None:
            self._scene.show(self._pose_in_focus(self._scene.focus), self.motions)

    def _pose_in_focus(self, number: int) -> Pose | None:
        """The pose of the performer who drives the puppet with this number."""
        for act in self._acts:
            if number < len(act.puppets):
                return act.pose
            number -= len(act.puppets)
        return None

    def _perform(self, frame: SkeletonFrame, of_slots: Mapping[int, SkeletonFrame]) -> None:
        timer = self._timer
        motions: list[Motion] = []
        self._last, self._outdated = frame, False
        for slot, act in enumerate(self._acts):
            if slot in of_slots:
                with timer.stage("match"):
                    act.receive(of_slots[slot], frozen=self.frozen)
            if self.frozen:
                act.freeze(frame.time)
                continue
            with timer.stage("retarget"):
                pose = act.followed_pose(frame.time)
            for puppet in act.puppets:
                with timer.stage("retarget"):
                    if pose is not None:
                        puppet.follow(pose)
                with timer.stage("deform"):
                    motions.append(puppet.deform())
        if not self.frozen:
            self.motions = motions
            self._unsettled = True
        if self._scene is not None:
            self._scene.follow(frame.time)

    def _revise(self) -> None:
        """Perform the last poses anew, if an action may have changed what they look like."""
        frame, outdated, self._outdated = self._last, self._outdated, False
        if frame is None or not outdated or self.frozen:
            return
        for act in self._acts:
            act.match_again_at(frame)
        self._perform(frame, {})

    def _count(self, frame: SkeletonFrame) -> None:
        self._began = frame.time if self.frames == 0 else self._began
        self.seconds = frame.time - self._began
        self.frames += 1

    def _publish(self, frame: SkeletonFrame) -> None:
        with self._timer.stage("render"):
            picture = self._pictures.perform(frame.time, self.draw)
        self.latency = self._clock() - frame.arrival
        if math.isfinite(self.latency):
            self._report.times.add("latency", self.latency)
        poses = tuple(act.pose for act in self._acts)
        with self._timer.stage("publish"):
            for motion, own in zip(self.motions, self._outputs, strict=True):
                performed = PerformedFrame(
                    index=self.frames,
                    time=frame.time,
                    vertices=motion.vertices,
                    nodes=motion.nodes,
                    poses=poses,
                    picture=picture,
                    weights=motion.weights,
                )
                for output in own:
                    output.write(performed)


def _copies(motions: Sequence[Motion]) -> tuple[Motion, ...]:
    """Return motions with vertices that no puppet overwrites."""
    return tuple(replace(motion, vertices=motion.vertices.copy()) for motion in motions)
