"""The frame loop: receive, match, retarget, deform, draw, keep - one tick after the other.

The data goes one way, from the stream to the outputs. The loop is the only caller of the solvers
and of GL while a performance runs.
"""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Mapping, Sequence

from devices.skeleton import SkeletonFrame
from devices.stream import SkeletonStream
from runtime.conditioning.reception import Reception
from runtime.conditioning.switches import Conditioning, filled_only
from runtime.driving.match_session import MatchSession
from runtime.driving.performer import Performer, Pose
from runtime.driving.unfreeze_blend import UnfreezeBlend
from runtime.output.output import Output, PerformedFrame, Screen
from runtime.output.report.report import Report
from runtime.puppet.puppet import Motion, Puppet
from runtime.show.act_group import Act
from runtime.show.clock import StageTimer
from runtime.show.performer_slots import PerformerSlots
from runtime.show.scene import Scene

EARLY = 0.75  # of the wanted step between pictures; frames never come quite evenly


class FrameLoop:
    """Drives puppets by the newest frame of a stream.

    Args:
        stream: where frames come from.
        performer: who they are of.
        puppets: who follows.
        director: who decides what drives what.
        report: what the show is told by.
        theatre: where it is shown, or None when nobody looks and no output needs a picture.
        outputs: for each puppet, what keeps its performance.
        others: further performers' acts, in the order in which they come; outputs and theatre have
            their puppets after these.
        conditioning: how the stream is put in order; as it comes where None.
        shown: whether somebody looks, so that every tick is drawn.
        clock: host monotonic time [s].

    Attributes:
        frozen: whether the characters hold still, while frames go on to come, to be recorded and
            to be published; let go, they ease to where their performers are by then.
        frames: frames performed so far.
        received: frames that came so far.
        seconds: performer's time from the first of them to the last [s].
        latency: [s] from the newest frame's arrival until it was handed on to be shown; NaN where
            nobody knows when it came.
    """

    def __init__(
        self,
        stream: SkeletonStream,
        performer: Performer,
        puppets: Sequence[Puppet],
        *,
        match_session: MatchSession,
        report: Report,
        scene: Scene | None,
        outputs: Sequence[Sequence[Output]],
        others: Sequence[Act] = (),
        conditioning: Conditioning | None = None,
        shown: bool = False,
        clock: Callable[[], float] = time.perf_counter,
    ) -> None:
        self.frozen = False
        self.frames = self.received = 0
        self.seconds = 0.0
        self.latency = math.nan
        self._began = float("nan")
        self._stream = stream
        self._acts = (Act(performer, puppets, match_session), *others)
        self._unfreeze_blends = [UnfreezeBlend(act.performer.skeleton) for act in self._acts]
        self._report = report
        self._scene = scene
        self._outputs = outputs
        self._shown = shown
        rate = max((o.pictures_a_second for kept in outputs for o in kept), default=0.0)
        self._picture_step = EARLY / rate if rate > 0.0 else math.inf  # [s]
        self._screens = [o for kept in outputs for o in kept if isinstance(o, Screen)]
        self._pictured = self._pictured_at = -math.inf
        self._clock = clock
        self._reception = Reception(stream.skeleton, conditioning or filled_only())
        self._performer_slots = PerformerSlots(len(self._acts))
        self._timer = StageTimer()
        self._poses: list[Pose | None] = [None] * len(self._acts)
        self._motions = [puppet.deform() for act in self._acts for puppet in act.puppets]
        self._unsettled = False

    def tick(self) -> bool:
        """Do what has come since the last tick; draw in any case where somebody looks.

        Returns:
            Whether a frame was performed.
        """
        self.settle()
        self._timer.reset()
        with self._timer.stage("frame"):
            with self._timer.stage("poll"):
                newest, parts = self._receive()
            if newest is not None:
                self._perform(newest, parts)
            else:
                self._idle()
        if newest is not None:
            for stage, spent in self._timer.stages.items():
                self._report.times.add(stage, spent)
        return newest is not None

    def settle(self) -> None:
        """Bring the surfaces nearer to rest once a tick has been shown, before the next is due.

        The next tick would begin with it otherwise: what is shown is the same.
        """
        if not self._unsettled:
            return
        self._unsettled = False
        with self._report.times.measure("settle"):
            for act in self._acts:
                for puppet in act.puppets:
                    puppet.settle()

    @property
    def motions(self) -> Sequence[Motion]:
        """Each puppet as it was performed last."""
        return self._motions

    def draw(self) -> None:
        """Draw what was performed last, where there is a scene."""
        if self._scene is not None:
            self._scene.show(self._poses[0], self._motions)

    def hurry(self) -> None:
        """Leave the surfaces as they were shown: there is no time to settle them."""
        self._unsettled = False

    def _idle(self) -> None:
        """Go on showing what there is, though no frame has come: camera and light may change."""
        due = self._clock() - self._pictured_at >= self._picture_step
        if self._scene is not None and (self._shown or (due and self._screens)):
            self.draw()
            if due and self._screens:
                picture = self._scene.picture()
                self._pictured_at = self._clock()
                for screen in self._screens:
                    screen.show(picture)

    def _receive(self) -> tuple[SkeletonFrame | None, dict[int, SkeletonFrame]]:
        """The newest frame, and that of each part."""
        came = self._stream.poll()
        frames = self._reception.receive(came)
        parts = {}
        for frame in frames:
            part = self._performer_slots.part(frame)
            if part is not None:
                parts[part] = frame
        newest = parts.get(0, next(iter(parts.values()), frames[-1] if frames else None))
        self.received += len(came)
        self._report.dropped += len(came) - max(len(parts), min(len(frames), 1))
        return newest, parts

    def _perform(self, frame: SkeletonFrame, parts: Mapping[int, SkeletonFrame]) -> None:
        timer = self._timer
        motions: list[Motion] = []
        for part, act in enumerate(self._acts):
            if part in parts:
                with timer.stage("match"):
                    self._poses[part] = act.performer.follow(parts[part])
                    if act.performer.calibrates:
                        act.match_session.calibrate()
                    if not self.frozen:
                        act.match_session.direct(parts[part])
            if self.frozen:
                self._unfreeze_blends[part].freeze(frame.time)
                continue
            with timer.stage("retarget"):
                pose = self._eased(part, frame.time)
            for puppet in act.puppets:
                with timer.stage("retarget"):
                    if pose is not None:
                        puppet.follow(pose)
                with timer.stage("deform"):
                    motions.append(puppet.deform())
        if not self.frozen:
            self._motions = motions
            self._unsettled = True
        self._publish(frame)
        self._began = frame.time if self.frames == 0 else self._began
        self.seconds = frame.time - self._began
        self.frames += 1

    def _eased(self, part: int, time: float) -> Pose | None:
        """The pose that the puppets of a part follow at `time` [s]: their performer's, or eased."""
        pose = self._poses[part]
        if pose is None:
            return None
        rests = self._acts[part].match_session.rests
        return self._unfreeze_blends[part].follow(pose, time, rests)

    def _publish(self, frame: SkeletonFrame) -> None:
        at, step = frame.time, self._picture_step
        wanted = math.isfinite(step) and at - self._pictured >= step
        picture = None
        with self._timer.stage("render"):
            if self._scene is not None and (self._shown or wanted):
                self._scene.show(self._poses[0], self._motions)
            if self._scene is not None and wanted:
                picture = self._scene.picture()
                self._pictured, self._pictured_at = at, self._clock()
        self.latency = self._clock() - frame.arrival
        if math.isfinite(self.latency):
            self._report.times.add("latency", self.latency)
        poses = tuple(self._poses)
        with self._timer.stage("publish"):
            for motion, kept in zip(self._motions, self._outputs, strict=True):
                performed = PerformedFrame(
                    index=self.frames,
                    time=at,
                    vertices=motion.vertices,
                    nodes=motion.nodes,
                    poses=poses,
                    picture=picture,
                )
                for output in kept:
                    output.write(performed)
