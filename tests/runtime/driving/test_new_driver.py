"""New drivers of thirty lines, made here, move a character through everything that a show has."""

from __future__ import annotations

import json
from collections.abc import Sequence
from contextlib import ExitStack
from pathlib import Path

import av
import moderngl
import numpy as np
import pytest

from devices.errors import InputError
from replay.player import EveryFrame, Player
from replay.recording import Recording
from runtime.driving.choices import Choices
from runtime.driving.driver import DrivenPart, Driver, Highlight, Needs
from runtime.driving.drivers import DRIVERS, DriverFactory
from runtime.driving.match_session import MatchSession
from runtime.driving.pairing import Pairing
from runtime.driving.performer import Performer, Pose, Rest
from runtime.driving.rehearsal import rehearse
from runtime.driving.targets import HandleGroups, HandleTargets, Placement, Targets
from runtime.output.files.export import open_export
from runtime.output.files.point_cache import PointCache
from runtime.output.files.video import Video
from runtime.output.report.report import Report
from runtime.puppet.puppet import Puppet
from runtime.show.act_group import Act
from runtime.show.loop import FrameLoop
from runtime.show.scene import Scene
from runtime.show.settings import FileSettings, ShowSettings
from runtime.show.show import Show
from solvers.deform.handles import HARD
from tests.runtime.output.files.test_point_cache import read_pc2
from tests.runtime.show.loops import Kept, Wire
from tests.runtime.stick_figures import BODY, FRONT_VIEW, frame, make_figure, record, waving

SIZE = (96, 54)
FRAMES = 9


class _New:
    """What the two drivers have in common: how high the performer's left hand is."""

    needs = Needs()
    poses_nodes = False
    highlights: Sequence[Highlight] = ()
    parts: Sequence[DrivenPart] = ()

    def __init__(self, pairing: Pairing) -> None:
        self.hand = pairing.performer.index("HandLeft")
        self.vertices, self.rest_of_surface = pairing.character.vertices, pairing.surface.rest
        self.rest: Rest | None = None

    def prepare(self, clip: Sequence[Pose], rest: Rest | None) -> None:
        self.rest = rest

    def raised(self, pose: Pose) -> float:
        """How far [m] the hand is above its rest state."""
        if self.rest is None:
            return 0.0
        return float(pose.seen[self.hand, 1] - self.rest.positions[self.hand, 1])

    def reset(self) -> None: ...

    def snapshot(self) -> None: ...

    def restore(self, state: None) -> None: ...


class Stretcher(_New):
    """Pulls the head up by handles of its own, travels, and lights up what it pulls."""

    def targets(self, pose: Pose) -> Targets:
        feet, head = (np.flatnonzero(side) for side in self._ends())
        handles = HandleGroups(np.append(feet, head), np.repeat([0, 1], [len(feet), len(head)]))
        positions = self.rest_of_surface[handles.vertices].copy()
        positions[len(feet) :, 1] += self.raised(pose)
        self.highlights = [Highlight(positions[[0, -1]], joints=(self.hand,))]
        shape = HandleTargets(handles, positions, np.full(2, HARD))
        return Targets(shape, Placement(travel=(0.5 * self.raised(pose), 0.0)))

    def _ends(self) -> tuple[np.ndarray, np.ndarray]:
        height = self.rest_of_surface[:, 1]
        return height < 0.1, height > height.max() - 0.1


class Twister(_New):
    """Gives a finished surface: all vertices twisted about the vertical."""

    def targets(self, pose: Pose) -> Targets:
        x, y, z = self.vertices.T
        angle = 1.5 * self.raised(pose) * y
        turned = (np.cos(angle) * x + np.sin(angle) * z, y, np.cos(angle) * z - np.sin(angle) * x)
        return Targets(np.stack(turned, axis=1))


@pytest.fixture(scope="module")
def puppet() -> Puppet:
    return Puppet(make_figure())


def show_of(
    puppet: Puppet, make_driver: DriverFactory, recording: Recording
) -> tuple[Player, Performer, MatchSession]:
    """A rehearsed show of one puppet."""
    puppet.rest()
    puppet.forget()
    performer = Performer(recording.skeleton)
    session = MatchSession(
        performer, [puppet], lambda: FRONT_VIEW, Choices(), [None], make_driver=make_driver
    )
    rehearse(recording, "whole", session)
    return Player(recording, EveryFrame()), performer, session


@pytest.mark.parametrize("name", ["stretcher", "twister"])
def test_a_new_driver_moves_a_character_through_loop_outputs_and_window(
    puppet: Puppet,
    name: str,
    context: moderngl.Context,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setitem(DRIVERS, name, {"stretcher": Stretcher, "twister": Twister}[name])
    player, performer, session = show_of(puppet, DRIVERS[name], record(waving(FRAMES)))
    assert not session.matching, "it performs without a match"
    with ExitStack() as closing:
        report = closing.enter_context(Report(tmp_path / "report.json"))
        kept, figures = Kept(), report.add_character(puppet.character)
        scene = Scene(context, SIZE, [puppet], BODY)
        closing.callback(scene.close)
        loop = FrameLoop(
            player,
            [Act(performer, [puppet], session)],
            report=report,
            scene=scene,
            outputs=[
                [
                    figures,
                    kept,
                    closing.enter_context(PointCache(tmp_path / "a.pc2", puppet.character)),
                    closing.enter_context(Video(tmp_path / "a.mp4", pictures_a_second=1000.0)),
                ]
            ],
            shown=True,
        )
        pictures = []
        while not player.ended:
            loop.tick()
            loop.settle()
            pictures.append(scene.picture().astype(int))

    shapes = np.array([each.vertices for each in kept.frames])
    moved = np.abs(shapes - shapes[0]).max(axis=(1, 2))
    assert moved[FRAMES // 2] > 0.2, "the hand is up in the middle"
    assert moved[-1] < 0.05, "and down at the end"
    assert all(each.nodes is None for each in kept.frames)
    _, samples = read_pc2(tmp_path / "a.pc2")
    np.testing.assert_allclose(samples, shapes, atol=1e-6)
    with av.open(str(tmp_path / "a.mp4")) as video:
        assert sum(1 for _ in video.decode(video=0)) == FRAMES
    told = json.loads((tmp_path / "report.json").read_text())
    assert told["frames"] == FRAMES
    assert told["stretch"]["p99"] > 0.01
    assert told["match"] == {"score": None, "pairs": []}
    assert np.abs(pictures[FRAMES // 2] - pictures[0]).max() > 60, "it is seen moving"
    assert len(scene._characters[0].tubes) == (4 if name == "stretcher" else 0)


def test_handles_of_its_own_are_met_and_the_whole_travels(puppet: Puppet) -> None:
    _, performer, _ = show_of(puppet, Stretcher, record(waving(FRAMES)))
    top = puppet.character.vertices[:, 1].max()
    performer.follow(frame(waving(FRAMES)[0]))
    for positions in waving(FRAMES)[: FRAMES // 2 + 1]:
        puppet.follow(performer.follow(frame(positions)))
        motion = puppet.deform()
    driver = puppet.driver
    assert isinstance(driver, Stretcher)
    raised = driver.raised(performer.pose)
    assert raised > 0.5
    assert motion.vertices[:, 1].max() == pytest.approx(top + raised, abs=1e-6)
    feet = puppet.character.vertices[:, 1] < 0.1
    rest = puppet.character.vertices[feet] + (0.5 * raised, 0.0, 0.0)
    np.testing.assert_allclose(motion.vertices[feet], rest, atol=1e-6)
    np.testing.assert_allclose(puppet.highlights[0].points[0, 0], rest[0, 0], atol=1e-9)


def test_drivers_are_switched_while_performing_and_the_surface_goes_on(puppet: Puppet) -> None:
    """By handles, twisted, by handles of another kind, and back: as if it had not been switched."""
    runs = []
    for switches in (False, True):
        _, performer, session = show_of(puppet, DRIVERS["relative"], record(waving(FRAMES)))
        for number in range(60):
            if switches and number in (20, 30, 40):
                others: dict[int, DriverFactory] = {20: Twister, 30: Stretcher}
                session.drive_with(others.get(number, DRIVERS["relative"]))
            struck = waving(FRAMES)[min(number, FRAMES // 2)]
            puppet.follow(performer.follow(frame(struck, number / 30.0)))
            motion = puppet.deform()
            puppet.settle()
        runs.append((session.mappings[0].drives, motion.vertices.copy()))
    assert runs[0][0] == runs[1][0] != (), "with the same mapping"
    np.testing.assert_allclose(runs[1][1], runs[0][1], atol=2e-3)


@pytest.mark.parametrize("suffix", [".bvh", ".glb"])
def test_an_export_of_nodes_says_that_the_driver_poses_none(
    puppet: Puppet, suffix: str, tmp_path: Path
) -> None:
    player, performer, session = show_of(puppet, Twister, record(waving(FRAMES)))
    with open_export(tmp_path / f"a{suffix}", puppet.character) as export:
        loop = FrameLoop(
            player,
            [Act(performer, [puppet], session)],
            report=Report(None),
            scene=None,
            outputs=[[export]],
        )
        with pytest.raises(InputError, match=r"poses none: .*--cache") as told:
            loop.tick()
    assert "\n" not in str(told.value)


@pytest.mark.parametrize("suffix", [".bvh", ".glb"])
def test_a_show_refuses_such_an_export_before_it_touches_a_file(
    suffix: str, tmp_path: Path
) -> None:
    earlier = tmp_path / f"a{suffix}"
    earlier.write_text("an earlier performance")
    files = FileSettings(export=earlier, cache=tmp_path / "a.pc2")
    with pytest.raises(InputError, match=r"poses no nodes; export a \.usdc"):
        Show(
            Player(record(waving(FRAMES)), EveryFrame()),
            [make_figure()],
            ShowSettings(files=files),
            make_driver=Twister,
        )
    assert earlier.read_text() == "an earlier performance"
    assert not (tmp_path / "a.pc2").exists()


def test_what_a_driver_needs_is_there_or_is_told() -> None:
    class WholeClip(Twister):
        needs = Needs(clip=True)
        clip: Sequence[Pose] = ()

        def prepare(self, clip: Sequence[Pose], rest: Rest | None) -> None:
            super().prepare(clip, rest)
            self.clip = clip

    class FromSurface(Twister):
        needs = Needs(surface=True)

    puppet = Puppet(make_figure())
    long = record([positions for positions in waving(50) for _ in range(12)], rate=60.0)
    show_of(puppet, WholeClip, long)
    driver: Driver | None = puppet.driver
    assert isinstance(driver, WholeClip)
    np.testing.assert_array_equal([pose.time for pose in driver.clip], long.times)

    performer = Performer(BODY)
    live = Wire([frame(waving(3)[0])])
    session = MatchSession(
        performer, [puppet], lambda: FRONT_VIEW, Choices(), [None], make_driver=WholeClip
    )
    struck = live.poll()[0]
    performer.follow(struck)
    with pytest.raises(InputError, match=r"figure needs the whole motion .* recording"):
        session.direct(struck)
    with pytest.raises(InputError, match=r"figure needs a surface of the performer"):
        show_of(puppet, FromSurface, long)
