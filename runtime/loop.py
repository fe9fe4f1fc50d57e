"""The frame loop: receive, match, retarget, deform, draw, keep - one tick after the other.

The data goes one way, from the stream to the outputs. The loop is the only caller of the solvers
and of GL while a performance runs.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Protocol

from devices.skeleton import SkeletonFrame
from devices.stream import SkeletonStream
from runtime.clock import StageTimer
from runtime.conditioning.reception import Reception
from runtime.conditioning.switches import Conditioning, filled_only
from runtime.director import Director
from runtime.lead import Lead
from runtime.output.output import Output, PerformedFrame
from runtime.output.report import Report
from runtime.performer import Performer, Pose
from runtime.puppet import Motion, Puppet
from runtime.theatre import Theatre

EARLY = 0.75  # of the wanted step between pictures; frames never come quite evenly


class Recorder(Protocol):
    """Keeps every frame that arrives, in order."""

    def write(self, frame: SkeletonFrame) -> None:
        """Keep one frame."""
        ...


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
        conditioning: how the stream is put in order; as it comes where None.
        recorder: what keeps the performer's frames as they come, or None.
        shown: whether somebody looks, so that every tick is drawn.

    Attributes:
        frames: frames performed so far.
        seconds: performer's time from the first of them to the last [s].
    """

    def __init__(
        self,
        stream: SkeletonStream,
        performer: Performer,
        puppets: Sequence[Puppet],
        *,
        director: Director,
        report: Report,
        theatre: Theatre | None,
        outputs: Sequence[Sequence[Output]],
        conditioning: Conditioning | None = None,
        recorder: Recorder | None = None,
        shown: bool = False,
    ) -> None:
        self.frames = 0
        self.seconds = 0.0
        self._began = float("nan")
        self._stream = stream
        self._performer = performer
        self._puppets = puppets
        self._director = director
        self._report = report
        self._theatre = theatre
        self._outputs = outputs
        self._recorder = recorder
        self._shown = shown
        rate = max((o.pictures_a_second for kept in outputs for o in kept), default=0.0)
        self._picture_step = EARLY / rate if rate > 0.0 else math.inf  # [s]
        self._pictured = -math.inf
        self._reception = Reception(stream.skeleton, conditioning or filled_only())
        self._lead = Lead()
        self._timer = StageTimer()
        self._pose: Pose | None = None
        self._motions: list[Motion] = [puppet.deform() for puppet in puppets]

    def tick(self) -> bool:
        """Do what has come since the last tick; draw in any case where somebody looks.

        Returns:
            Whether a frame was performed.
        """
        self._timer.reset()
        with self._timer.stage("frame"):
            with self._timer.stage("poll"):
                newest, leads = self._receive()
            if newest is not None:
                self._perform(newest, leads)
            elif self._shown and self._theatre is not None:
                self._theatre.show(self._pose, self._motions)
        if newest is not None:
            for stage, spent in self._timer.stages.items():
                self._report.times.add(stage, spent)
        return newest is not None

    def _receive(self) -> tuple[SkeletonFrame | None, bool]:
        """The lead's newest frame, else anyone's; the recorder gets every one, as it came."""
        came = self._stream.poll()
        if self._recorder is not None:
            for frame in came:
                self._recorder.write(frame)
        frames = self._reception.receive(came)
        leading = [frame for frame in frames if self._lead.leads(frame)]
        self._report.dropped += len(came) - min(len(frames), 1)
        if leading:
            return leading[-1], True
        return (frames[-1] if frames else None), False

    def _perform(self, frame: SkeletonFrame, leads: bool) -> None:
        timer = self._timer
        if leads:
            with timer.stage("match"):
                self._pose = self._performer.follow(frame)
                if self._performer.calibrates:
                    self._director.calibrate()
                self._director.direct(frame)
        motions = []
        for puppet in self._puppets:
            with timer.stage("retarget"):
                if self._pose is not None:
                    puppet.follow(self._pose)
            with timer.stage("deform"):
                motions.append(puppet.deform())
        self._motions = motions
        self._publish(frame.time)
        self._began = frame.time if self.frames == 0 else self._began
        self.seconds = frame.time - self._began
        self.frames += 1

    def _publish(self, time: float) -> None:
        step = self._picture_step
        wanted = math.isfinite(step) and time - self._pictured >= step
        picture = None
        with self._timer.stage("render"):
            if self._theatre is not None and (self._shown or wanted):
                self._theatre.show(self._pose, self._motions)
            if self._theatre is not None and wanted:
                picture = self._theatre.picture()
                self._pictured = time
        with self._timer.stage("publish"):
            for motion, kept in zip(self._motions, self._outputs, strict=True):
                performed = PerformedFrame(
                    index=self.frames,
                    time=time,
                    vertices=motion.vertices,
                    node_positions=motion.node_positions,
                    node_rotations=motion.node_rotations,
                    picture=picture,
                )
                for output in kept:
                    output.write(performed)
