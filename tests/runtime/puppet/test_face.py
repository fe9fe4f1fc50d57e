"""A puppet's face: names, stand-ins, rules of expressions, and the surface that follows."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np
import pytest

from runtime.characters.builtin import BUILTIN, builtin_character
from runtime.characters.morphs import BLEND, BLOCK, Expression, Morphs
from runtime.driving.performer import Performer
from runtime.puppet.face import ExpressionMixer, Face
from runtime.puppet.puppet import Puppet
from solvers.deform.morph_targets import MorphTargets
from tests.runtime.stick_figures import BODY, frame, make_figure, pose


def morphs_of(names: Sequence[str], expressions: Sequence[Expression] = ()) -> Morphs:
    moves = [(np.array([k]), np.ones((1, 3))) for k in range(len(names))]
    return Morphs.of(MorphTargets.of(moves), names, expressions)


def mixed(morphs: Morphs, blends: Mapping[str, float]) -> list[float]:
    return ExpressionMixer(morphs).weights(blends).tolist()


VRM = morphs_of(
    ["joy", "eyes", "mouth"],
    [
        Expression("happy", ((0, 1.0),)),
        Expression("blink", ((1, 0.5),)),
        Expression("aa", ((2, 1.0), (0, 0.25))),
    ],
)


@pytest.mark.parametrize("name", ["happy", "Joy", "JOY", "joy"])
def test_an_expression_is_moved_by_every_name_of_it(name: str) -> None:
    assert mixed(VRM, {name: 0.5}) == [0.5, 0.0, 0.0]


def test_expressions_add_up_and_are_bounded() -> None:
    assert mixed(VRM, {"happy": 1.0, "aa": 1.0}) == [1.0, 0.0, 1.0]
    assert mixed(VRM, {"happy": 0.5, "aa": 1.0}) == [0.75, 0.0, 1.0]
    assert mixed(VRM, {"Blink": 1.0}) == [0.0, 0.5, 0.0]


def test_a_target_that_no_expression_is_called_moves_by_its_own_name() -> None:
    assert mixed(VRM, {"Mouth": 0.5, "eyes": 0.25}) == [0.0, 0.25, 0.5]


def test_shapes_that_a_character_has_not_stand_in() -> None:
    assert mixed(VRM, {"eyeBlinkLeft": 1.0}) == [0.0, 0.25, 0.0]
    assert mixed(VRM, {"eyeBlinkLeft": 1.0, "eyeBlinkRight": 1.0}) == [0.0, 0.5, 0.0]
    assert mixed(VRM, {"jawOpen": 0.5}) == [0.125, 0.0, 0.5]
    assert mixed(VRM, {"jawOpen": 0.5, "A": 0.0}) == [0.125, 0.0, 0.5], "not both together"
    perfect = morphs_of(["eyeBlinkLeft", "eyeBlinkRight", "jawOpen"])
    assert mixed(perfect, {"Blink": 0.5, "A": 1.0}) == [0.5, 0.5, 1.0]
    assert mixed(perfect, {"Blink_L": 0.5}) == [0.5, 0.0, 0.0]


@pytest.mark.parametrize(
    ("rule", "happy", "left"), [(BLEND, 0.25, 0.75), (BLOCK, 0.25, 0.0), (BLOCK, 0.0, 1.0)]
)
def test_an_expression_overrides_others_as_vrm_1_says(rule: str, happy: float, left: float) -> None:
    morphs = morphs_of(
        ["h", "b", "m"],
        [
            Expression("happy", ((0, 1.0),), blink=rule),
            Expression("blink", ((1, 1.0),)),
            Expression("aa", ((2, 1.0),)),
        ],
    )
    assert mixed(morphs, {"happy": happy, "blink": 1.0, "aa": 1.0}) == [happy, left, 1.0]


def test_overrides_add_up_and_never_take_more_than_all() -> None:
    morphs = morphs_of(
        ["h", "a", "m"],
        [
            Expression("happy", ((0, 1.0),), mouth=BLEND),
            Expression("angry", ((1, 1.0),), mouth=BLEND),
            Expression("oh", ((2, 1.0),)),
        ],
    )
    assert mixed(morphs, {"happy": 0.25, "angry": 0.25, "oh": 1.0})[2] == 0.5
    assert mixed(morphs, {"happy": 0.75, "angry": 0.75, "oh": 1.0})[2] == 0.0


def test_binary_expressions_are_there_or_not() -> None:
    morphs = morphs_of(
        ["h", "b"],
        [
            Expression("happy", ((0, 1.0),), is_binary=True, blink=BLEND),
            Expression("blink", ((1, 1.0),), is_binary=True),
        ],
    )
    assert mixed(morphs, {"happy": 0.5, "blink": 0.9}) == [0.0, 1.0]
    assert mixed(morphs, {"happy": 0.51, "blink": 0.9}) == [1.0, 0.0]
    faded = replace(
        morphs, expressions=(replace(morphs.expressions[0], is_binary=False), morphs.expressions[1])
    )
    assert mixed(faded, {"happy": 0.1, "blink": 0.9}) == [0.1, 0.0], "a binary one is not faded"


def test_an_expression_does_not_override_itself() -> None:
    morphs = morphs_of(["b"], [Expression("blink", ((0, 1.0),), blink=BLOCK)])
    assert mixed(morphs, {"blink": 0.5}) == [0.5]


def test_names_that_move_nothing_are_told_once() -> None:
    told: list[str] = []
    face = Face(builtin_character("paper"), told.append)
    for value in (0.1, 0.2):
        face.follow({"tongueOut": value, "jawOpen": value, "Neutral": value})
    face.follow({"tongueOut": 0.1, "cheekPuff": 0.1, "noseSneerLeft": 0.2})
    assert told == [
        "blend shape tongueOut moves nothing on paper",
        "blend shapes cheekPuff, noseSneerLeft move nothing on paper",
    ]


def test_a_character_without_morphs_is_told_of_once_and_stays() -> None:
    told: list[str] = []
    figure = make_figure()
    face = Face(figure, told.append)
    for value in (0.1, 0.2):
        face.follow({"jawOpen": value})
    (line,) = told
    assert "has no blend shapes" in line
    vertices = figure.vertices.copy()
    face.move(vertices)
    np.testing.assert_array_equal(vertices, figure.vertices)


@pytest.mark.parametrize("name", BUILTIN)
def test_every_built_in_character_blinks_talks_and_smiles(name: str) -> None:
    character = builtin_character(name)
    face = Face(character)

    def moved(**blends: float) -> np.ndarray:
        face.follow(blends)
        vertices = character.vertices.copy()
        face.move(vertices)
        assert np.isfinite(vertices).all()
        return vertices - character.vertices

    size = float(np.ptp(character.vertices, axis=0).max())
    left, right = moved(blinkLeft=1.0), moved(blinkRight=1.0)
    assert character.vertices[np.abs(left).max(axis=1) > 0.01, 0].min() > 0.0, "its left is +x"
    assert character.vertices[np.abs(right).max(axis=1) > 0.01, 0].max() < 0.0
    np.testing.assert_allclose(moved(Blink=1.0), left + right, atol=1e-9)
    opened, smiling = moved(A=1.0), moved(Joy=1.0)
    assert opened[:, 1].min() < -0.01 * size
    assert smiling[:, 1].max() > 0.002 * size
    np.testing.assert_array_equal(moved(), 0.0)
    everything = moved(Blink=1.0, A=1.0, Joy=1.0)
    assert np.abs(everything).max() < 0.15 * size


def test_a_puppet_follows_the_face_of_its_performer_and_states_hold_it() -> None:
    character = builtin_character("mannequin")
    puppet, performer = Puppet(character), Performer(BODY)
    plain = puppet.deform().vertices.copy()
    open_mouth = replace(frame(pose(), 0.1), blends={"jawOpen": 1.0})
    puppet.follow(performer.follow(open_mouth))
    opened = puppet.deform().vertices.copy()
    assert np.abs(opened - plain).max() > 0.01
    state = puppet.snapshot()
    puppet.follow(performer.follow(frame(pose(), 0.2)))
    np.testing.assert_allclose(puppet.deform().vertices, plain, atol=1e-9)
    puppet.restore(state)
    np.testing.assert_allclose(puppet.deform().vertices, opened, atol=1e-9)
    puppet.follow(performer.follow(frame(pose(), 0.2)))
    np.testing.assert_allclose(puppet.deform().vertices, plain, atol=1e-9)
    puppet.follow(performer.follow(open_mouth))
    np.testing.assert_allclose(puppet.deform().vertices, opened, atol=1e-9)
