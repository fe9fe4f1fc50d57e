"""The matches of a body by its anatomy: pairs to pairs, left to left, and a base stays."""

from __future__ import annotations

import numpy as np
import pytest

from runtime.characters.open_character import load_character
from runtime.driving.matching.match_guard import MatchGuard
from runtime.driving.performer import Performer
from runtime.puppet.puppet import Puppet
from solvers.matching import Match
from solvers.retarget.source_limbs import simplify
from tests.runtime.stick_figures import BODY, FRONT_VIEW, pose


@pytest.fixture(scope="module")
def cactus() -> Puppet:
    return Puppet(load_character("cactus"))


def matches(puppet: Puppet, source: str, positions: np.ndarray) -> tuple[Performer, list[Match]]:
    performer = Performer(BODY, source)
    guard = MatchGuard(performer, simplify(performer.rest_tree()), puppet)
    return performer, guard.rank(positions[performer.joints], FRONT_VIEW, 20)


@pytest.mark.parametrize("source", ["whole", "upper"])
@pytest.mark.parametrize("raised", [-1.2, 0.0, 1.2])
def test_arms_take_the_arms_of_a_cactus_and_its_pot_stays(
    cactus: Puppet, source: str, raised: float
) -> None:
    lifted = {"ShoulderLeft": (0.0, 0.0, raised), "ShoulderRight": (0.0, 0.0, -raised)}
    performer, ranked = matches(cactus, source, pose(lifted))
    nodes = cactus.bound_skeleton.tree.positions
    pot = int(np.argmin(nodes[:, 1]))
    assert all(pot not in target for match in ranked for _, target in match.pairs)
    tips = {
        BODY.names[performer.joints[chain[-1]]]: nodes[target[-1]]
        for chain, target in ranked[0].pairs[: ranked[0].limbs]
    }
    left, right, head = (
        next(place for name, place in tips.items() if name.startswith(part))
        for part in ("HandLeft", "HandRight", "Head")
    )
    assert left[0] > 0.3
    assert right[0] < -0.3
    assert abs(head[0]) < 0.1
