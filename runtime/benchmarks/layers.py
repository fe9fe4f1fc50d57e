"""Benchmark: twenty layers of a session, on 200 bones alone and in the ticks of a show."""

from __future__ import annotations

import tempfile
from pathlib import Path
from time import perf_counter

import numpy as np
from scipy.spatial.transform import Rotation

from replay.builtin import builtin_recording
from runtime.characters.builtin import builtin_character
from runtime.control.actions import press
from runtime.session import edits
from runtime.session.document import Actor, Session, Take
from runtime.session.files.store import SessionStore
from runtime.session.performance import Performance
from runtime.session.playing import ActorPlayer
from runtime.show.open_stream import play
from runtime.show.settings import ShowSettings
from runtime.show.show import Show
from solvers.skeleton.tree import Tree

LAYERS, BONES = 20, 200
SECONDS, RATE = 10.0, 60
BUDGET_MS = {"layers": 1.0, "p50": 4.0, "p99": 8.0}


def run(*, frames: int = 1200) -> dict[str, object]:
    """Play twenty layers; print and return the times [ms].

    Args:
        frames: how many moments, and how many ticks.
    """
    alone = _alone(frames)
    print(f"layers: {LAYERS} on {BONES} bones, half of them additive, at {frames} moments")
    print(f"  alone  {_said(alone)} (budget {BUDGET_MS['layers']:.0f} ms)")
    rehearsed, played = _ticks(frames)
    budget = f"(budget {BUDGET_MS['p50']:.0f} and {BUDGET_MS['p99']:.0f} ms)"
    print(f"a tick of the mannequin, 10k vertices {budget}")
    print(f"  performed  {_said(rehearsed)}")
    print(f"  {LAYERS} layers  {_said(played)}")
    return {
        "budget_ms": BUDGET_MS,
        "alone_ms": alone,
        "tick_ms": {"performed": rehearsed, "layers": played},
    }


def _said(times: dict[str, float]) -> str:
    return f"{times['p50']:.2f} ms in the median, {times['p99']:.2f} ms p99"


def _alone(frames: int) -> dict[str, float]:
    """The times of all layers on a tree of bones, without a character."""
    random = np.random.default_rng(0)
    parents = np.array([-1, *(random.integers(max(n - 5, 0), n) for n in range(1, BONES))])
    player = ActorPlayer(1, Tree(parents, random.normal(size=(BONES, 3))))
    session = edits.with_actor(Session(), Actor(1, "tree", "squid", "auto", BONES))
    for _ in range(LAYERS):
        session = edits.with_take(session, Take(0, "", 1, _performance(random)), 0.0)
    session = _mixed(session)
    moments = np.linspace(0.0, SECONDS, frames).tolist()
    player.play(session, 1.0)  # the kernels are there
    return _quantiles([_seconds(player, session, moment) for moment in moments])


def _seconds(player: ActorPlayer, session: Session, moment: float) -> float:
    start = perf_counter()
    player.play(session, moment)
    return perf_counter() - start


def _performance(random: np.random.Generator) -> Performance:
    """Every bone swings once a second, by up to 57 degrees, about an axis of its own."""
    frames = round(SECONDS * RATE)
    times = np.arange(frames) / RATE
    vectors = random.normal(size=(BONES, 3))
    vectors /= np.linalg.norm(vectors, axis=1, keepdims=True)
    swing = np.sin(2.0 * np.pi * times)[:, None, None] * vectors
    turns = Rotation.from_rotvec(swing.reshape(-1, 3)).as_quat().reshape(frames, BONES, 4)
    return Performance(
        times.astype(np.float32),
        np.arange(BONES),
        turns.astype(np.float32),
        (0.01 * swing).astype(np.float32),
    )


def _mixed(session: Session) -> Session:
    """The session with every clip at half its weight, and every other one additive."""
    for clip in session.clips:
        session = edits.weighted(session, clip.id, 0.5)
        session = edits.made_additive(session, clip.id, clip.id % 2 == 0)
    return session


def _ticks(frames: int) -> tuple[dict[str, float], dict[str, float]]:
    """The times of ticks that a performer moves, and of ticks in which the layers play."""
    stream = play(builtin_recording(), every_frame=True, loop=True)
    with tempfile.TemporaryDirectory() as folder:
        store = SessionStore(Path(folder) / "bench.bunraku")
        show = Show(stream, [builtin_character("mannequin")], ShowSettings(), session=store)
        with show:
            live = show.controls.session
            assert live is not None
            _timed(show, 120)
            press("record", show.controls)
            rehearsed = _timed(show, frames)
            press("record", show.controls)
            session = live.session
            for _ in range(LAYERS - 1):
                session = edits.copied(session, session.clips[0].id, 0.0)
            live.edit(_mixed(session), "layers")
            live.transport.loop = True
            press("play", show.controls)
            _timed(show, 60)
            return rehearsed, _timed(show, frames)


def _timed(show: Show, frames: int) -> dict[str, float]:
    times = []
    for _ in range(frames):
        start = perf_counter()
        show.tick()
        times.append(perf_counter() - start)
    return _quantiles(times)


def _quantiles(seconds: list[float]) -> dict[str, float]:
    return {f"p{q}": 1e3 * float(np.percentile(seconds, q)) for q in (50, 99)}
