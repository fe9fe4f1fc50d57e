"""A performer goes through the whole flow by one gesture, without touching anything."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from devices.errors import InputError
from replay.builtin import builtin_recording
from replay.recording import Recording
from runtime.characters.open_character import load_character
from runtime.control.flow_settings import FlowSettings
from runtime.control.gestures import arms_of
from runtime.session.files.store import SessionStore
from runtime.session.transport import Mode
from runtime.show.open_stream import play
from runtime.show.settings import MatchSettings, ShowSettings
from runtime.show.show import Show

RATE = 30
GESTURE, BETWEEN = 2.5, 1.5  # [s]


def gesturing(times: int) -> Recording:
    """Somebody who moves a little, and stretches both arms out from time to time."""
    wave = builtin_recording("wave")
    seconds = times * (GESTURE + BETWEEN) + BETWEEN
    count = round(seconds * RATE)
    positions = np.repeat(wave.skeleton.rest_positions[None], count, axis=0)
    at = np.arange(count) / RATE
    for number, time in enumerate(at):
        gesture = time % (GESTURE + BETWEEN) >= BETWEEN
        for arm in arms_of(wave.skeleton):
            way = np.array([arm.side, 0.0, 0.0] if gesture else [0.1 * arm.side, -0.9, 0.4])
            for joint, share in zip(arm.joints[1:], (0.5, 1.0), strict=True):
                shoulder = positions[number, arm.joints[0]]
                positions[number, joint] = shoulder + share * arm.length * way
    return replace(
        wave,
        times=at,
        positions=positions,
        rotations=None,
        confidence=np.ones(positions.shape[:2]),
        performers=np.zeros(count, dtype=np.int64),
        arrivals=np.full(count, np.nan),
        blends=None,
    )


def test_the_whole_flow_goes_by_one_gesture(tmp_path: Path) -> None:
    stream = play(gesturing(6), every_frame=True)
    settings = ShowSettings(
        flow=FlowSettings(count_in=0.5, hands_free="pose"),
        match=MatchSettings(rehearse=False, patience=np.inf),
    )
    store = SessionStore(tmp_path / "s.bunraku")
    seen: list[tuple[str, str]] = []
    with Show(stream, [load_character("squid")], settings, session=store) as show:
        session, hands_free = show.controls.session, show._opened.hands_free
        assert session is not None
        assert hands_free is not None
        while not show.ended:
            show.tick()
            now = (hands_free.step, session.transport.mode.value)
            if not seen or seen[-1] != now:
                seen.append(now)
        takes = session.session.takes
        asked = show._opened.status().hands_free
    assert seen == [
        ("accept", "rehearsing"),
        ("record", "rehearsing"),
        ("end", "rehearsing"),  # counted in
        ("end", "recording"),
        ("play", "rehearsing"),
        ("rehearse", "playing"),
        ("rehearse", "paused"),  # the take is over
        ("record", "rehearsing"),
        ("end", "rehearsing"),
        ("end", "recording"),
    ]
    assert asked == ("Stretch both arms out to the side for 2 s to end the take", 0.0)
    assert takes[0].performance.duration == pytest.approx(GESTURE + BETWEEN - 0.5, abs=0.1)
    assert session.transport.mode is Mode.REHEARSING


def test_an_unknown_gesture_is_refused() -> None:
    with pytest.raises(InputError, match=r"FlowSettings\.hands_free: expected one of pose"):
        FlowSettings(hands_free="wink")
