"""What is heard follows the clips: cut, moved, looped, muted; a part is that part of the whole."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from runtime.session import edits
from runtime.session.document import Session
from runtime.sound.mix import RATE, Mixed, for_mixing, heard_in, mixed, write_mix
from tests.runtime.session.sessions import session, take
from tests.runtime.sound.clicks import clicks, moments_in_wav, moments_of

SAMPLES = for_mixing(clicks(0.25, 1.0, 1.75))  # of a take of two seconds


@pytest.fixture
def made() -> Session:
    """A clip from 1 to 3 s whose take has sound."""
    return session(replace(take(0.1), sound="a.wav"), start=1.0)


def heard(made: Session, start: float = 0.0, seconds: float = 8.0) -> Mixed:
    layers = heard_in(made, {"a.wav": SAMPLES}.get)
    return mixed(layers, round(start * RATE), round(seconds * RATE))


def moments(made: Session) -> list[float]:
    return moments_of(heard(made)[:, 0])


def test_a_sound_is_heard_where_its_take_plays(made: Session) -> None:
    assert moments(made) == [1.25, 2.0, 2.75]
    assert moments(edits.moved(made, 1, 2.5)) == [2.75, 3.5, 4.25]


def test_a_sound_is_cut_split_and_copied_with_its_clip(made: Session) -> None:
    assert moments(edits.trimmed(made, 1, 1.5, 2.5)) == [2.0]
    parts = edits.moved(edits.split(made, 1, 1.5), 2, 5.0)
    assert moments(parts) == [1.25, 5.5, 6.25]
    assert moments(edits.copied(made, 1, 4.0)) == [1.25, 2.0, 2.75, 4.25, 5.0, 5.75]


def test_a_sound_is_looped_with_its_clip(made: Session) -> None:
    assert moments(edits.looped(made, 1, 1.6)) == [1.25, 2.0, 2.75, 3.25, 4.0]


def test_muted_and_other_speeds_are_silent(made: Session) -> None:
    for silent in (
        edits.muted(made, 1, True),
        edits.soloed(edits.with_take(made, take(0.2), 0.0), 2, True),
        edits.paced(made, 1, 2.0),
    ):
        assert not heard(silent).any()
    assert not mixed(heard_in(made, lambda _: None), 0, RATE).any(), "of a sound that is lost"


def test_any_part_is_that_part_of_the_whole(made: Session) -> None:
    whole = heard(edits.copied(made, 1, 1.6))
    part = heard(edits.copied(made, 1, 1.6), 1.3, 1.0)
    np.testing.assert_array_equal(part, whole[round(1.3 * RATE) : round(2.3 * RATE)])


def test_loud_layers_are_clipped_and_never_wrap(made: Session) -> None:
    twice = edits.copied(edits.copied(made, 1, 1.0), 1, 1.0)
    assert heard(twice).max() == 1.0


def test_a_cut_does_not_click() -> None:
    loud = for_mixing(clicks(0.0, seconds=2.0))
    loud[:] = 20_000
    made = edits.trimmed(session(replace(take(0.1), sound="a.wav"), start=1.0), 1, 1.5, 2.5)
    steps = np.abs(np.diff(mixed(heard_in(made, {"a.wav": loud}.get), 0, 4 * RATE)[:, 0]))
    assert 0.0 < steps.max() < 0.01


def test_a_range_is_written_as_wav(made: Session, tmp_path: Path) -> None:
    layers = heard_in(made, {"a.wav": SAMPLES}.get)
    write_mix(tmp_path / "a.wav", layers, 1.1, 1.5)
    assert moments_in_wav(tmp_path / "a.wav") == pytest.approx([0.15, 0.9], abs=0.001)
