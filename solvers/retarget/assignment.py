"""Lists the best pairings of performer limbs with character limbs, best first.

For each choice of columns only its best permutation counts, as in AniMesh (Jin et al. 2015),
section 4.2. Each table's best choice is a linear assignment (Kuhn 1955, shortest augmenting paths);
the next ones follow by splitting the remaining choices at the columns of the one just taken (Lawler
1972): "without its first column", "with its first but without its second", and so on, each again a
linear assignment. So the first k of the C(n, m) choices cost at most k m assignments, and are
exactly those of a list of all m! C(n, m). A table is solved only when its upper bound comes first.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from solvers.kernels.compiled import kernel
from solvers.kernels.short_loops import put

Array = NDArray[np.float64]
Ints = NDArray[np.int64]

MOST_COLUMNS = 60  # sets of columns are kept as bits
_BARRED = 1e3  # outweighs any sum of values


@kernel
def rank_assignments(values: Array, starts: Ints, limit: int) -> tuple[Ints, Ints, Array]:
    """Return the `limit` best assignments of rows to columns over all tables, best first.

    Args:
        values: (m, T) the tables side by side, each entry well below 100 in size.
        starts: (C + 1,) first column of each table and the end of the last; at most
            `MOST_COLUMNS` (and rows) each.
        limit: the most assignments.

    Returns:
        The table of each of the n assignments (n,); the column within it that each row takes
        (n, m), -1 for none; the sums (n,). A table with fewer columns than rows uses all of them.
        Equal sums come in the order of the tables.
    """
    rows, tables = values.shape[0], len(starts) - 1
    room = tables + limit * MOST_COLUMNS
    table = np.empty(room, dtype=np.int64)
    required, barred = np.zeros(room, dtype=np.int64), np.zeros(room, dtype=np.int64)
    merit, solved = np.empty(room), np.zeros(room, dtype=np.int64)
    columns = np.full((room, rows), -1, dtype=np.int64)
    for c in range(tables):
        table[c] = c
        merit[c] = _bound(values[:, starts[c] : starts[c + 1]])
    count, found = tables, 0
    taken, pairs, sums = (
        np.empty(limit, dtype=np.int64),
        np.empty((limit, rows), dtype=np.int64),
        np.empty(limit),
    )
    while found < limit and count > 0:
        best = np.argmax(merit[:count])
        if merit[best] == -np.inf:
            break
        block = values[:, starts[table[best]] : starts[table[best] + 1]]
        if solved[best] == 0:
            merit[best] = _assign(block, required[best], barred[best], columns[best])
            solved[best] = 1
            continue
        taken[found], sums[found] = table[best], merit[best]
        put(pairs[found], columns[best])
        found += 1
        merit[best] = -np.inf
        forced = required[best]
        for position in range(max(block.shape)):
            bit = np.int64(1) << position
            if not _uses(columns[best], position, block) or forced & bit:
                continue
            merit[count] = _assign(block, forced, barred[best] | bit, columns[count])
            table[count], required[count], barred[count] = table[best], forced, barred[best] | bit
            solved[count] = 1
            count += merit[count] > -np.inf
            forced |= bit
    return taken[:found], pairs[:found], sums[:found]


@kernel
def _uses(columns: Ints, position: int, block: Array) -> bool:
    """Whether an assignment uses the column (the row, if there are more rows) at `position`."""
    if block.shape[0] > block.shape[1]:
        return bool(columns[position] >= 0)
    return bool(np.any(columns == position))


@kernel
def _bound(block: Array) -> float:
    """Upper bound of a table's best assignment: the sum of the best of each row (or column)."""
    wide = block if block.shape[0] <= block.shape[1] else block.T
    total = 0.0
    for i in range(wide.shape[0]):
        total += wide[i].max()
    return total


@kernel
def _assign(block: Array, required: int, barred: int, columns: Ints) -> float:
    """Best assignment that uses all required and no barred columns; -inf if there is none.

    "Columns" are the longer side of the block; `columns` (m,) receives each row's column or -1.
    """
    upright = block.shape[0] <= block.shape[1]
    costs = -block if upright else -block.T
    for j in range(costs.shape[1]):
        bit = np.int64(1) << j
        if barred & bit:
            for i in range(len(costs)):
                costs[i, j] += _BARRED
        elif required & bit:
            for i in range(len(costs)):
                costs[i, j] -= _BARRED
    owner = _hungarian(costs)
    columns[:] = -1
    total, used = 0.0, np.int64(0)
    for j in range(len(owner)):
        i = owner[j]
        if i >= 0:
            total += block[i, j] if upright else block[j, i]
            used |= np.int64(1) << j
            columns[i if upright else j] = j if upright else i
    return total if used & barred == 0 and used & required == required else -np.inf


@kernel
def _hungarian(costs: Array) -> Ints:
    """Row of each column (-1 for none) in the cheapest assignment of all rows; rows <= columns.

    Rows enter one by one, each along the shortest augmenting path under the current prices (Kuhn
    1955; Edmonds and Karp 1972). Row and column 0 are the path's start, hence the offset by one.
    """
    rows, width = costs.shape
    price_row, price_column = np.zeros(rows + 1), np.zeros(width + 1)
    owner, before = np.zeros(width + 1, dtype=np.int64), np.zeros(width + 1, dtype=np.int64)
    for row in range(1, rows + 1):
        owner[0] = row
        reach = np.full(width + 1, np.inf)
        done = np.zeros(width + 1, dtype=np.bool_)
        here = 0
        while owner[here] != 0:
            done[here] = True
            step, following = np.inf, 0
            for j in range(1, width + 1):
                if not done[j]:
                    i = owner[here]
                    slack = costs[i - 1, j - 1] - price_row[i] - price_column[j]
                    if slack < reach[j]:
                        reach[j], before[j] = slack, here
                    if reach[j] < step:
                        step, following = reach[j], j
            for j in range(width + 1):
                if done[j]:
                    price_row[owner[j]] += step
                    price_column[j] -= step
                else:
                    reach[j] -= step
            here = following
        while here != 0:
            owner[here] = owner[before[here]]
            here = before[here]
    return owner[1:] - 1
