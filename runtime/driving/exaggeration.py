"""Cartoon exaggeration: limbs and body stretch when they move fast, and squash when they stop.

Chenney et al. 2002, Simulating cartoon style animation, stretch a body by its speed and squash it
where it stops. Here each driven limb grows with the speed of its tip, and the whole body with the
speed at which it rises or falls. Damped springs follow both, so that a limb or a body that stops is
squashed for a moment. The solver keeps the volume: `solvers.squash_stretch`.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from solvers.kernels.compiled import kernel
from solvers.signal.springs import Springs, SpringsState

Array = NDArray[np.float64]

FREQUENCY = 3.0  # [1/s] of the springs: about that of steps
DAMPING = 0.35  # one clear overshoot
LIMB = 0.35  # share by which a limb grows at most
BODY = 0.3  # share by which the body grows at most
FAST_LIMB = 6.0  # [1/s] limb lengths a second of a tip at which a limb grows by 0.76 of that
FAST_BODY = 1.2  # [1/s] body heights a second, likewise
LONGEST_STEP = 0.1  # [s] between two frames that give a speed


@dataclass(frozen=True, slots=True, eq=False)
class Strain:
    """The stretch of a character by its motion.

    Attributes:
        limbs: (D,) length of each driven chain, as a share of its length at rest.
        body: height of the whole, as a share of its height at rest.
    """

    limbs: Array
    body: float

    @property
    def is_none(self) -> bool:
        """Whether nothing is stretched at all."""
        return self.body == 1.0 and bool((self.limbs == 1.0).all())

    def of_limbs(self, limbs: NDArray[np.int64]) -> Array:
        """Return the stretch (n,) of limbs by number (n,); -1 is no limb, which never stretches."""
        return np.append(self.limbs, 1.0)[limbs]


@dataclass(frozen=True, slots=True, eq=False)
class ExaggerationState:
    """The state of an `Exaggeration` between two frames.

    Attributes:
        springs: of the limbs and the whole.
        before: time [s], tips (D, 3) [m] and lift [m] of the last frame; None before the first.
    """

    springs: SpringsState
    before: tuple[float, Array, float] | None


class Exaggeration:
    """Follows the speed of a character's limbs and body, and stretches them.

    Args:
        lengths: (D,) [m] of the driven chains.
        height: [m] of the character.
    """

    def __init__(self, lengths: Array, height: float) -> None:
        self._sizes = np.maximum(np.append(lengths, height), 1e-9)
        self._springs = _springs(len(self._sizes))
        self._before: tuple[float, Array, float] | None = None

    def reset(self) -> None:
        """Forget the motion before."""
        self._springs = _springs(len(self._sizes))
        self._before = None

    def snapshot(self) -> ExaggerationState:
        """Return what is remembered between frames."""
        return ExaggerationState(self._springs.snapshot(), self._before)

    def restore(self, state: ExaggerationState) -> None:
        """Go back to a snapshot of as many limbs."""
        self._springs.restore(state.springs)
        self._before = state.before

    def strain(self, time: float, tips: Array, lift: float, amount: float) -> Strain:
        """Return the stretch of the character at a moment.

        Args:
            time: [s].
            tips: (D, 3) [m] from each chain's start to its tip.
            lift: [m] of the whole.
            amount: of exaggeration, from 0 (none) to 1.
        """
        passed = math.inf if self._before is None else time - self._before[0]
        pulls = np.zeros(len(self._sizes))
        if self._before is not None and 0.0 < passed <= LONGEST_STEP:
            _, tips_before, lift_before = self._before
            _pull(tips - tips_before, lift - lift_before, self._sizes, passed, pulls)
        self._before = (time, tips.copy(), lift)
        if 0.0 < passed < math.inf:
            self._springs.step(pulls, passed)
        lengths = 1.0 + amount * self._springs.at
        return Strain(lengths[:-1], float(lengths[-1]))


def _springs(count: int) -> Springs:
    return Springs(np.zeros(count), frequency=FREQUENCY, damping=DAMPING)


@kernel
def _pull(tips: Array, lift: float, sizes: Array, passed: float, out: Array) -> None:
    """Put the growth of each limb, and last of the body, into `out` (D + 1,)."""
    count = len(tips)
    for d in range(count):
        far = math.sqrt(tips[d, 0] ** 2 + tips[d, 1] ** 2 + tips[d, 2] ** 2)
        out[d] = LIMB * math.tanh((far / sizes[d] / passed / FAST_LIMB) ** 2)
    out[count] = BODY * math.tanh(abs(lift) / sizes[count] / passed / FAST_BODY)
