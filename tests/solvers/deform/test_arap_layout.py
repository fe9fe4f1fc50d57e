"""Bad input to a deformation solver is refused, with a message that names the fault."""

from __future__ import annotations

import numpy as np
import pytest

from solvers.arap import ArapSolver

GOOD = np.array([[0.0, 0, 0], [1, 0, 0], [0, 1, 0]])


@pytest.mark.parametrize(
    ("arguments", "options", "message"),
    [
        ((np.zeros((3, 2)), [[0, 1, 2]], [0]), {}, r"vertices of shape \(N, 3\).*\(3, 2\)"),
        ((np.zeros((0, 3)), np.zeros((0, 3), int), [0]), {}, r"vertices of shape"),
        ((np.full((3, 3), np.nan), [[0, 1, 2]], [0]), {}, "vertex 0 is not finite"),
        ((GOOD, [[0, 1, 3]], [0]), {}, "faces name vertex 3, but there are 3"),
        ((GOOD, [[0, 1, -1]], [0]), {}, "faces name vertex -1"),
        ((GOOD, [[0, 1, 2, 0]], [0]), {}, r"faces of shape \(F, 3\)"),
        ((GOOD, [[0.0, 1.0, 2.0]], [0]), {}, "integer faces"),
        ((GOOD, [[0, 1, 2]], []), {}, r"handles of shape \(H,\), H > 0"),
        ((GOOD, [[0, 1, 2]], [3]), {}, "handles name vertex 3"),
        ((GOOD, [[0, 1, 2]], [1, 2, 1]), {}, "vertex 1 is a handle more than once"),
        ((GOOD, [[0, 1, 2]], [1]), {"energy": "rims"}, "unknown energy 'rims'.*spokes-and-rims"),
        ((GOOD, [[0, 1, 2]], [1, 2]), {"groups": [1]}, r"groups of shape \(2,\), got \(1,\)"),
    ],
)
def test_bad_input_is_named(arguments: tuple, options: dict, message: str):
    with pytest.raises(ValueError, match=message):
        ArapSolver(*arguments, **options)


@pytest.mark.parametrize(
    ("targets", "message"),
    [
        (np.zeros((2, 3)), r"targets of shape \(1, 3\), got \(2, 3\)"),
        ([[np.nan, 0, 0]], "target 0 is not finite"),
        ([[np.inf, 0, 0]], "target 0 is not finite"),
        ([[1e30, 0, 0]], "target 0 .*absurdly far"),
    ],
)
def test_bad_targets_are_named_and_change_nothing(targets: object, message: str):
    solver = ArapSolver(GOOD, [[0, 1, 2]], [1])
    before = solver.solve([[1.0, 1.0, 0.0]])
    with pytest.raises(ValueError, match=message):
        solver.solve(targets)
    np.testing.assert_allclose(solver.solve([[1.0, 1.0, 0.0]]), before, atol=1e-12)
    with pytest.raises(ValueError, match="iterations"):
        solver.solve([[1.0, 1.0, 0.0]], -1)
