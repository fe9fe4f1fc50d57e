"""Ranked assignments, against a list of all permutations."""

from itertools import combinations, permutations

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st

from solvers.retarget.assignment import rank_assignments
from tests.thorough import examples


def by_listing(values, starts):
    """All choices of columns (of rows, if there are fewer columns) with their best permutation."""
    found = []
    for table in range(len(starts) - 1):
        block = values[:, starts[table] : starts[table + 1]]
        wide = block if block.shape[0] <= block.shape[1] else block.T
        rows = range(wide.shape[0])
        for columns in combinations(range(wide.shape[1]), wide.shape[0]):
            best = max(
                sum(wide[r, c] for r, c in zip(rows, p, strict=True)) for p in permutations(columns)
            )
            found.append((best, table, columns))
    return sorted(found, key=lambda item: -item[0])


@settings(max_examples=examples(80), deadline=None)
@given(
    st.integers(0, 10_000), st.integers(1, 4), st.lists(st.integers(1, 6), min_size=1, max_size=4)
)
def test_the_order_is_that_of_listing_everything(seed, rows, widths):
    starts = np.cumsum([0, *widths])
    values = np.random.default_rng(seed).uniform(-1, 1, size=(rows, starts[-1]))
    expected = by_listing(values, starts)
    tables, columns, sums = rank_assignments(values, starts, 1000)
    np.testing.assert_allclose(sums, [item[0] for item in expected], atol=1e-12)
    for table, row, total, (_, its_table, choice) in zip(
        tables, columns, sums, expected, strict=True
    ):
        assert table == its_table
        used = np.flatnonzero(row >= 0)
        taken = row[used] if rows <= widths[table] else used
        assert tuple(sorted(taken)) == choice
        assert len(used) == min(rows, widths[table])
        assert len(set(row[used])) == len(used)
        assert np.isclose(values[used, starts[table] + row[used]].sum(), total)


def test_forty_branches_and_five_limbs_need_no_listing():
    values = np.random.default_rng(3).uniform(-1, 1, size=(5, 40))
    tables, columns, sums = rank_assignments(values, np.array([0, 40]), 100)
    assert len(tables) == 100  # of 658,008 choices of 120 permutations
    assert (np.diff(sums) <= 0).all()
    assert len({tuple(sorted(row)) for row in columns}) == 100


def test_equal_tables_come_in_their_order():
    tables, _, _ = rank_assignments(np.ones((2, 6)), np.array([0, 2, 4, 6]), 3)
    assert tables.tolist() == [0, 1, 2]


def test_no_choice_is_lost_or_listed_twice_where_all_are_equal():
    values = np.random.default_rng(4).integers(0, 2, size=(3, 7)).astype(float)
    for table in (np.ones((2, 6)), values, np.repeat(values[:, :2], 3, axis=1)):
        _, columns, sums = rank_assignments(table, np.array([0, table.shape[1]]), 100)
        np.testing.assert_allclose(
            sums, [item[0] for item in by_listing(table, [0, table.shape[1]])]
        )
        assert len({tuple(sorted(row)) for row in columns}) == len(sums)
