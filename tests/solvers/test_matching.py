"""Ranked matches, against a list of all choices; inner chains; preferences."""

from itertools import combinations, permutations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from solvers.matching import TargetHierarchy, rank_matches
from solvers.retarget.abstraction import abstract
from solvers.retarget.source_limbs import simplify
from solvers.skeleton.forward_kinematics import SkeletonPose
from solvers.skeleton.tree import Tree, extend_to_leaf
from tests.thorough import examples

FRONT = np.eye(3)
SQUID_ARMS = np.radians([0, 45, 90, 135, 180, 225, 270, 315])
# spine, head, and per side arm (shoulder, elbow, wrist, two fingers) and leg (hip, knee, foot)
BODY = {
    "pelvis": ("", (0, 0.95, 0)),
    "spine": ("pelvis", (0, 1.2, 0)),
    "chest": ("spine", (0, 1.45, 0)),
    "neck": ("chest", (0, 1.55, 0)),
    "head": ("neck", (0, 1.75, 0)),
}
for side, x in (("left", 1), ("right", -1)):
    BODY |= {
        f"{side} shoulder": ("chest", (0.18 * x, 1.42, 0)),
        f"{side} elbow": (f"{side} shoulder", (0.45 * x, 1.40, 0)),
        f"{side} wrist": (f"{side} elbow", (0.70 * x, 1.42, 0)),
        f"{side} thumb": (f"{side} wrist", (0.74 * x, 1.47, 0)),
        f"{side} finger": (f"{side} wrist", (0.85 * x, 1.42, 0)),
        f"{side} hip": ("pelvis", (0.10 * x, 0.92, 0)),
        f"{side} knee": (f"{side} hip", (0.12 * x, 0.50, 0)),
        f"{side} foot": (f"{side} knee", (0.13 * x, 0.05, 0)),
    }


def body(*without):
    """A person in T-pose as a tree, less the joints whose names hold one of the words."""
    names = [name for name in BODY if not any(word in name for word in without)]
    root = next(n for n in names if BODY[n][0] not in names)
    parents = [names.index(BODY[n][0]) if n != root else -1 for n in names]
    return Tree(np.array(parents), np.array([BODY[n][1] for n in names], dtype=float)), names


def star(angles, count=6, length=1.0):
    """Straight tentacles in the screen plane, from one node."""
    parents, positions = [-1], [(0.0, 0.0, 0.0)]
    for angle in angles:
        for step in range(1, count + 1):
            parents.append(len(parents) - 1 if step > 1 else 0)
            r = length * step / count
            positions.append((r * np.cos(angle), r * np.sin(angle), 0.0))
    return Tree(np.array(parents), np.array(positions))


def arms(left, right):
    """Two arms of three joints each that point at angles from the chest."""
    return star([left, right], count=3)


def scores(matches):
    return [match.score for match in matches]


def named(match, source, target):
    return {(source[s[0]], source[s[-1]], target[t[0]], target[t[-1]]) for s, t in match.pairs}


def test_a_body_drives_a_body_limb_by_limb_and_the_spine_too():
    source, names = body()
    match = rank_matches(source, source, FRONT)[0]
    assert match.score == pytest.approx(5.0)
    assert match.limbs == 5
    assert names[match.root] == "pelvis"
    assert named(match, names, names) == {
        ("pelvis", f"{side} foot") * 2 for side in ("left", "right")
    } | {("chest", f"{side} finger") * 2 for side in ("left", "right")} | {
        ("chest", "head") * 2,
        ("pelvis", "chest") * 2,
    }


@settings(max_examples=examples(25), deadline=None)
@given(st.integers(0, 10_000))
def test_a_noisy_body_with_spurs_still_takes_the_natural_match(seed):
    rng = np.random.default_rng(seed)
    source, names = body()
    target, others = body("thumb")
    spurs = rng.integers(0, len(others), size=8)
    grown = Tree(
        np.append(target.parents, spurs),
        np.concatenate(
            [
                target.positions + rng.normal(scale=0.02, size=target.positions.shape),
                target.positions[spurs] + rng.normal(scale=0.03, size=(8, 3)),
            ]
        ),
    )
    match = rank_matches(source, grown, FRONT, size_preference=0.4)[0]
    ends = {
        names[s[-1]]: [others[n] for n in t if n < len(others)]
        for s, t in match.pairs[: match.limbs]
    }
    assert set(ends) == {"head"} | {
        f"{s} {e}" for s in ("left", "right") for e in ("foot", "finger")
    }
    for side in ("left", "right"):
        assert f"{side} elbow" in ends[f"{side} finger"]
        assert f"{side} knee" in ends[f"{side} foot"]


def test_a_raised_arm_takes_the_arm_on_the_same_side_of_the_screen():
    source, _ = body("hip", "knee", "foot", "pelvis", "spine", "head", "neck", "right")
    target, others = body()
    hierarchy = TargetHierarchy(target)
    assert len(simplify(source).chains) == 1
    match = hierarchy.rank(simplify(source), FRONT)[0]
    assert others[match.pairs[0][1][-1]] == "left finger"


@pytest.mark.parametrize(("left", "right"), [(0, 180), (45, 135), (-45, 180), (40, 140), (90, 225)])
def test_two_arms_take_the_two_tentacles_that_point_as_they_do(left, right):
    squid = star(SQUID_ARMS)
    match = rank_matches(arms(np.radians(left), np.radians(right)), squid, FRONT)[0]
    for (_, target), angle in zip(match.pairs, (left, right), strict=True):
        x, y = squid.positions[target[-1], :2]
        assert abs((np.degrees(np.arctan2(y, x)) - angle + 180) % 360 - 180) < 6
    assert match.score == pytest.approx(2.0, abs=0.02)
    assert match.root == 0


def test_all_choices_are_listed_with_the_best_of_their_permutations():
    squid, pose = star(SQUID_ARMS + 0.1), arms(0.4, 2.0)
    matches = rank_matches(pose, squid, FRONT)
    points = [np.array([np.cos(a), np.sin(a)]) for a in SQUID_ARMS + 0.1]
    limbs = [np.array([np.cos(a), np.sin(a)]) for a in (0.4, 2.0)]
    expected = [
        max(sum(a @ b for a, b in zip(limbs, order, strict=True)) for order in permutations(pair))
        for pair in combinations(points, 2)
    ]
    assert len(matches) == 28
    np.testing.assert_allclose(scores(matches), sorted(expected, reverse=True), atol=1e-12)


def figure_3():
    """p and q carry one limb each and a fork; all lies in the screen plane."""
    parents = [-1, 0, 1, 2, 2, 1, 0, 6, 7, 7, 6]
    positions = [(0, 0), (-2, 0), (-4, 0), (-5, 1), (-4.8, -0.8), (-2, 2), (2.2, 0), (4.2, 0),
                 (5.2, 1), (5, -0.8), (2.2, 2)]  # fmt: skip
    return Tree(np.array(parents), np.array([(*p, 0.0) for p in positions]))


def test_figure_3_offers_every_level_of_detail():
    target = figure_3()
    matches = rank_matches(arms(np.pi / 4, -np.pi / 4), target, FRONT)
    assert len(matches) == 5  # forks 2 and 7, p, q, and the root between them, two branches each
    assert sorted(match.level for match in matches) == [1, 1, 2, 2, 3]
    best = matches[0]
    assert (best.root, best.level) == (7, 1)
    assert best.score == pytest.approx(2.0)
    assert [target for _, target in best.pairs] == [(7, 8), (7, 9)]


def test_figure_5_a_chain_extends_to_a_leaf_or_stops_at_the_sub_tree():
    target = figure_3()
    match = next(m for m in rank_matches(arms(np.pi / 2, 0.0), target, FRONT) if m.root == 6)
    assert [t for _, t in match.pairs] == [(6, 10), (6, 7, 8)]
    assert [t for _, t in match.stopped().pairs] == [(6, 10), (6, 7)]
    assert extend_to_leaf(target, match.stopped().pairs[1][1]) == (6, 7, 8)


def test_fewer_branches_than_the_source_has_take_its_best_ones():
    source, names = body("thumb", "finger")
    matches = rank_matches(source, star(np.radians([-100, 10])), FRONT)
    assert matches[0].limbs == 2
    driving = {names[s[-1]] for s, _ in matches[0].pairs}
    assert driving == {"left wrist", "right foot"}


def test_a_plain_chain_is_driven_whole_or_by_halves():
    snake = Tree(np.arange(-1, 9), np.column_stack([np.arange(10.0), np.zeros((10, 2))]))
    whole = rank_matches(star([np.pi], count=3), snake, FRONT)
    assert whole[0].score == pytest.approx(1.0)
    assert {match.pairs[0][1] for match in whole[:2]} >= {tuple(range(9, -1, -1))}
    both = rank_matches(arms(0.0, np.pi), snake, FRONT)[0]
    assert both.score == pytest.approx(2.0)
    assert [t[-1] for _, t in both.pairs] == [9, 0]


def test_a_single_node_has_no_match():
    assert rank_matches(arms(0, 1), Tree(np.array([-1]), np.zeros((1, 3))), FRONT) == []


def test_a_limb_that_points_at_the_viewer_counts_nothing():
    target = star([0.0, 2.0, 4.0])
    turned = target.positions.copy()
    turned[1:7] = [(0.0, 0.0, step / 6) for step in range(1, 7)]
    matches = rank_matches(arms(0.0, 2.0), Tree(target.parents, turned), FRONT)
    away = next(m for m in matches if {t[-1] for _, t in m.pairs} == {6, 12})
    assert away.score == pytest.approx(1.0, abs=1e-9)
    assert np.isfinite(scores(matches)).all()


def test_a_limb_almost_end_on_counts_little():
    target = star([0.0, 2.0], count=1)
    tilted = target.positions.copy()
    tilted[1] = (0.01, 0.0, 1.0)  # a fifth of what counts in full
    match = rank_matches(arms(0.0, 2.0), Tree(target.parents, tilted), FRONT)[0]
    assert match.score == pytest.approx(1.2, abs=1e-3)


def test_the_spine_ends_where_the_first_of_its_limbs_leaves():
    # pelvis 0 with two legs, spine 0-1-2, left arm at 2, right arm and head further up at 3
    places = [(0, 0), (0, 1), (0, 2), (0, 2.2), (1, 2), (2, 2), (-1, 2.2), (-2, 2.2), (0, 3.4),
              (0.1, -1), (0.1, -2), (-0.1, -1), (-0.1, -2)]  # fmt: skip
    parents = [-1, 0, 1, 2, 2, 4, 3, 6, 3, 0, 9, 0, 11]
    target = Tree(np.array(parents), np.array([(*p, 0.0) for p in places]))
    source, names = body("thumb")
    match = rank_matches(source, target, FRONT)[0]
    assert match.root == 0
    assert named(match, names, range(13)) >= {
        ("pelvis", "chest", 0, 2),
        ("chest", "left finger", 2, 5),
        ("chest", "right finger", 3, 7),
        ("chest", "head", 3, 8),
    }


def test_a_short_head_beside_a_long_arm_is_offered_too():
    places = [(0, 0), (0, 1), (0, 2), (0, 2.2), (1, 2), (2, 2), (-1, 2.2), (-2, 2.2), (0, 2.8),
              (0.1, -1), (0.1, -2), (-0.1, -1), (-0.1, -2)]  # fmt: skip
    parents = [-1, 0, 1, 2, 2, 4, 3, 6, 3, 0, 9, 0, 11]
    target = Tree(np.array(parents), np.array([(*p, 0.0) for p in places]))
    source, names = body("thumb")
    found = named(rank_matches(source, target, FRONT)[0], names, range(13))
    assert found >= {("chest", "head", 3, 8), ("chest", "right finger", 2, 7)}


def centipede(segments):
    """A spine in the screen plane with a pair of legs on each of its nodes."""
    parents, positions = [], []
    for segment in range(segments):
        parents.append(3 * (segment - 1) if segment else -1)
        positions.append((0.0, 1.0 * segment, 0.0))
        for x in (-1, 1):
            parents.append(3 * segment)
            positions.append((2.0 * x, 1.0 * segment + 0.2, 0.0))
    return Tree(np.array(parents), np.array(positions))


def test_every_stretch_between_several_forks_is_driven():
    match = rank_matches(centipede(4), centipede(4), FRONT)[0]
    assert match.score == pytest.approx(8.0)
    assert list(match.pairs[match.limbs :]) == [
        ((0, 3), (0, 3)),
        ((3, 6), (3, 6)),
        ((6, 9), (6, 9)),
    ]


@pytest.mark.parametrize("scale", [1e-6, 1.0, 1e6])
def test_scores_ignore_scale_and_place(scale):
    source, _ = body()
    target, _ = body("thumb", "finger")
    far = Tree(target.parents, target.positions * scale + np.array([3.0, -7.0, 11.0]) * scale)
    pose = Tree(source.parents, source.positions * 100.0 + 5.0)
    expected = scores(rank_matches(source, target, FRONT))
    np.testing.assert_allclose(scores(rank_matches(pose, far, FRONT)), expected, atol=1e-9)


def test_only_what_is_seen_counts():
    source, target = arms(0.3, 1.4), figure_3()
    expected = rank_matches(source, target, FRONT)
    turn = Rotation.from_euler("xyz", [0.4, -1.1, 2.0]).as_matrix()
    turned = Tree(target.parents, target.positions @ turn.T)
    seen = rank_matches(source, turned, turn.T)
    assert [m.pairs for m in seen] == [m.pairs for m in expected]
    np.testing.assert_allclose(scores(seen), scores(expected), atol=1e-12)
    aside = Tree(source.parents, source.positions @ turn.T)
    same = rank_matches(aside, target, FRONT, source_view=turn.T)
    np.testing.assert_allclose(scores(same), scores(expected), atol=1e-12)


def test_turning_the_picture_turns_the_choice():
    squid = star(SQUID_ARMS)
    quarter = Rotation.from_euler("z", 90, degrees=True).as_matrix()
    upright = rank_matches(arms(0.0, np.pi / 4), squid, FRONT)[0]
    turned = rank_matches(arms(0.0, np.pi / 4), squid, quarter)[0]
    for (_, a), (_, b) in zip(upright.pairs, turned.pairs, strict=True):
        np.testing.assert_allclose(
            quarter @ squid.positions[b[-1]], squid.positions[a[-1]], atol=1e-9
        )


def test_node_numbers_do_not_matter():
    rng = np.random.default_rng(5)
    source, _ = body()
    target = Tree(
        np.array([-1] + [rng.integers(max(0, n - 3), n) for n in range(1, 30)]),
        rng.normal(size=(30, 3)),
    )
    name = rng.permutation(30)
    parents = np.full(30, -1)
    parents[name] = np.where(target.parents >= 0, name[target.parents], -1)
    positions = np.empty((30, 3))
    positions[name] = target.positions
    before = rank_matches(source, target, FRONT)
    after = rank_matches(source, Tree(parents, positions), FRONT)
    np.testing.assert_allclose(scores(after), scores(before), atol=1e-9)
    renamed = [(s, tuple(name[list(t)])) for s, t in before[0].pairs]
    assert sorted(renamed) == sorted(after[0].pairs)


@settings(max_examples=examples(60), deadline=None)
@given(
    st.integers(0, 100_000),
    st.integers(1, 80),
    st.sampled_from(["", "centipede", "left", "finger"]),
)
def test_any_tree_gives_finite_scores_and_chains_that_can_be_driven(seed, count, without):
    rng = np.random.default_rng(seed)
    reach = int(rng.integers(1, 8))
    parents = np.array([-1] + [rng.integers(max(0, n - reach), n) for n in range(1, count)])
    positions = rng.normal(size=(count, 3)).round(int(rng.integers(0, 3)))
    target = Tree(parents, positions)
    source = centipede(4) if without == "centipede" else body(*([without] if without else []))[0]
    matches = rank_matches(source, target, FRONT, size_preference=float(rng.integers(0, 2)))
    merits = [match.merit for match in matches]
    assert merits == sorted(merits, reverse=True)
    assert len({(match.root, match.pairs) for match in matches}) == len(matches)
    for match in matches:
        assert np.isfinite(match.score)
        assert -match.limbs - 1e-9 <= match.score <= match.limbs + 1e-9
        chains = [t for _, t in match.pairs]
        SkeletonPose(target, match.root, chains)  # refuses bones driven twice or towards the root
        SkeletonPose(target, match.root, [t for _, t in match.stopped().pairs])
        for s, t in match.pairs:
            assert source.chain(s[0], s[-1]) == s
            assert target.chain(t[0], t[-1]) == t


def test_size_settles_between_limbs_and_spurs_that_look_alike():
    # a tiny fork that points exactly as the arms do, and large limbs 20 degrees off
    big, small = star(np.radians([20, 160, 270])), star(np.radians([0, 180]), length=0.1)
    parents = np.concatenate([big.parents, np.where(small.parents < 0, 18, small.parents + 19)])
    target = Tree(
        parents, np.concatenate([big.positions, small.positions - np.array([0, 1.01, 0])])
    )
    pose = arms(0.0, np.pi)
    by_score = rank_matches(pose, target, FRONT)
    assert scores(by_score) == sorted(scores(by_score), reverse=True)
    assert {t[-1] for _, t in by_score[0].pairs} == {25, 31}
    by_size = rank_matches(pose, target, FRONT, size_preference=0.4)[0]
    assert {t[-1] for _, t in by_size.pairs} == {6, 12}
    assert by_size.score == pytest.approx(2 * np.cos(np.radians(20)))


def test_a_hierarchy_answers_for_any_pose_as_if_built_anew():
    squid, rest = star(SQUID_ARMS), arms(0.0, np.pi)
    hierarchy, source = TargetHierarchy(squid), simplify(rest)
    for angle in (0.0, 1.0, 2.5):
        pose = arms(angle, np.pi)
        live = hierarchy.rank(source, FRONT, pose.positions, limit=5)
        assert live == rank_matches(pose, squid, FRONT, limit=5)


def test_a_view_of_the_wrong_shape_is_refused():
    with pytest.raises(ValueError, match="view of shape"):
        rank_matches(arms(0, 1), figure_3(), np.eye(4))


def test_the_hierarchy_can_be_rooted_by_hand():
    assert TargetHierarchy(figure_3(), root=5).hierarchy.root == 5
    assert abstract(figure_3()).root == 0
