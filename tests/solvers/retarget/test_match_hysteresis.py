"""A shown match changes only after another was better for some time."""

from itertools import pairwise

import numpy as np
import pytest

from solvers.matching import Match, TargetHierarchy
from solvers.retarget.match_hysteresis import MatchHysteresis
from solvers.retarget.source_limbs import simplify
from solvers.skeleton.tree import Tree


def match(name, merit):
    return Match(merit, (((0, 1), (0, name)),), 1, (2,), 0, 1, merit)


def ranked(**merits):
    names = {"a": 1, "b": 2, "c": 3}
    return sorted((match(names[n], m) for n, m in merits.items()), key=lambda m: -m.merit)


def shown(hysteresis):
    return {1: "a", 2: "b", 3: "c"}[hysteresis.shown.pairs[0][1][-1]]


def test_another_must_lead_by_a_margin_for_a_while():
    h = MatchHysteresis(margin=0.2, hold=0.5)
    assert h.update([], 0.0) is None
    h.update(ranked(a=1.0, b=0.9), 0.0)
    for time in (0.1, 0.4, 0.9):
        h.update(ranked(a=1.0, b=1.15), time)
        assert shown(h) == "a"  # ahead, but not by the margin
    h.update(ranked(a=1.0, b=1.3), 1.0)
    h.update(ranked(a=1.0, b=1.3), 1.4)
    assert shown(h) == "a"  # not for long enough
    h.update(ranked(a=1.0, b=1.1), 1.45)
    h.update(ranked(a=1.0, b=1.3), 1.6)
    assert shown(h) == "a"  # the wait began anew
    h.update(ranked(a=1.0, b=1.3), 2.1)
    assert shown(h) == "b"


def test_the_shown_match_carries_its_newest_score_and_survives_an_empty_list():
    h = MatchHysteresis()
    h.update(ranked(a=1.0), 0.0)
    assert h.update(ranked(a=0.7, b=0.8), 0.1).merit == 0.7
    assert h.update([], 0.2).merit == 0.7


def test_a_match_that_left_the_list_gives_way():
    h = MatchHysteresis(margin=0.1, hold=0.2)
    h.update(ranked(a=1.0), 0.0)
    h.update(ranked(b=1.0, c=0.5), 1.0)
    assert shown(h) == "a"
    h.update(ranked(b=1.0, c=0.5), 1.3)
    assert shown(h) == "b"


def test_stepping_goes_round_and_stays():
    h = MatchHysteresis(hold=0.0)
    assert h.cycle(1) is None
    h.update(ranked(a=1.0, b=0.5, c=0.2), 0.0)
    assert [(h.cycle(1), shown(h))[1] for _ in range(3)] == ["b", "c", "a"]
    h.cycle(-1)
    for time in (1.0, 2.0, 3.0):
        h.update(ranked(a=1.0, b=0.5, c=0.2), time)
    assert shown(h) == "c"
    h.release()
    h.update(ranked(a=1.0, b=0.5, c=0.2), 4.0)
    h.update(ranked(a=1.0, b=0.5, c=0.2), 5.0)
    assert shown(h) == "a"


@pytest.mark.parametrize(("rank", "name"), [(0, "a"), (1, "b"), (2, "c"), (9, "c")])
def test_any_rank_can_be_followed(rank, name):
    h = MatchHysteresis(rank)
    h.update(ranked(a=3.0, b=2.0, c=1.0), 0.0)
    assert shown(h) == name


def test_time_that_steps_back_starts_the_wait_anew():
    h = MatchHysteresis(margin=0.1, hold=0.5)
    h.update(ranked(a=1.0, b=0.5), 10.0)
    h.update(ranked(a=0.5, b=1.0), 10.1)
    h.update(ranked(a=0.5, b=1.0), 0.0)
    h.update(ranked(a=0.5, b=1.0), 0.4)
    assert shown(h) == "a"
    h.update(ranked(a=0.5, b=1.0), 0.5)
    assert shown(h) == "b"


@pytest.mark.parametrize("seed", range(5))
def test_a_noisy_arm_that_sweeps_past_two_tentacles_flips_the_match_once(seed):
    rng = np.random.default_rng(seed)
    angles = np.radians([0.0, 90.0])
    points = [(0.0, 0.0, 0.0)]
    points += [(r * np.cos(a), r * np.sin(a), 0.0) for a in angles for r in (0.5, 1.0)]
    points.append((0.0, -1.0, 0.0))
    squid = TargetHierarchy(Tree(np.array([-1, 0, 1, 0, 3, 0]), np.array(points)))
    arm = Tree(np.array([-1, 0, 1]), np.array([(0.0, 0, 0), (0.5, 0, 0), (1.0, 0, 0)]))
    source, h, seen = simplify(arm), MatchHysteresis(margin=0.15, hold=0.3), []
    raw = []
    for time in np.arange(0.0, 10.0, 1 / 30):
        angle = np.radians(90.0) * np.clip((time - 2) / 6, 0.0, 1.0) + rng.normal(scale=0.15)
        pose = np.outer([0, 0.5, 1.0], [np.cos(angle), np.sin(angle), 0.0])
        matches = squid.rank(source, np.eye(3), pose)
        raw.append(matches[0].pairs)
        seen.append(h.update(matches, time).pairs)
    flips = sum(a != b for a, b in pairwise(seen))
    assert sum(a != b for a, b in pairwise(raw)) > 1
    assert flips == 1


def test_going_on_from_a_snapshot_shows_the_same_matches():
    h = MatchHysteresis(margin=0.2, hold=0.5)
    h.update(ranked(a=1.0, b=0.9), 0.0)
    h.update(ranked(a=1.0, b=1.3), 1.0)  # the wait has begun
    state = h.snapshot()

    def go_on():
        seen = []
        for time in (1.4, 1.6, 1.8):
            h.update(ranked(a=1.0, b=1.3), time)
            seen.append(shown(h))
        return seen

    assert go_on() == ["a", "b", "b"]
    h.cycle(1)  # pins another
    h.restore(state)
    assert not h.pinned
    assert go_on() == ["a", "b", "b"]
    h.update(ranked(c=1.0), 9.0)
    h.restore(state)
    h.cycle(1)
    assert shown(h) == "b"  # the matches of the snapshot's frame are known again


def names(matches):
    return "".join({1: "a", 2: "b", 3: "c"}[match.pairs[0][1][-1]] for match in matches)


def test_the_best_keep_their_places_in_noise_and_leave_them_for_what_is_clearly_better():
    h = MatchHysteresis(margin=0.2)
    h.update(ranked(a=1.0, b=0.95, c=0.9), 0.0)
    assert names(h.best) == "abc"
    h.update(ranked(a=0.9, b=1.0, c=0.95), 0.1)
    assert names(h.best) == "abc"
    assert [match.merit for match in h.best] == [0.9, 1.0, 0.95]
    h.update(ranked(a=0.7, b=1.0, c=0.95), 0.2)
    assert names(h.best) == "bca"
    h.update(ranked(b=1.0, c=0.95), 0.3)
    assert names(h.best) == "bc"


def test_one_of_the_best_can_be_chosen_and_stays():
    h = MatchHysteresis(hold=0.0)
    h.update(ranked(a=1.0, b=0.9, c=0.2), 0.0)
    kept = h.snapshot()
    h.choose(1)
    h.update(ranked(a=2.0, b=0.9, c=0.2), 1.0)
    assert shown(h) == "b"
    h.choose(7)
    assert shown(h) == "b"
    h.restore(kept)
    h.choose(2)
    assert shown(h) == "c"
