"""The face of a puppet: named blend shapes become weights of morph targets.

Names that a character has not stand in for others: a performer's ARKit "eyeBlinkLeft" closes half
of a character's "blink". Rules of expressions are VRM 1's.

Source: VRM Consortium, "VRMC_vrm 1.0: expressions", sections "isBinary" and "override".
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from devices.blend_shapes import MOST_BLENDS, Blends
from runtime.characters.character import Character
from runtime.characters.morphs import (
    BLEND,
    BLINKS,
    BLOCK,
    LOOKS,
    MOUTHS,
    Expression,
    Morphs,
    canonical_name,
)
from solvers.deform.morph_targets import MorphedSurface

Array = NDArray[np.float64]

SILENT = frozenset({"neutral"})
"""Names that move nothing by intention."""

STAND_INS: dict[str, tuple[tuple[tuple[str, float], ...], ...]] = {
    "blink": (
        (("blinkleft", 1.0), ("blinkright", 1.0)),
        (("eyeblinkleft", 1.0), ("eyeblinkright", 1.0)),
    ),
    "blinkleft": ((("eyeblinkleft", 1.0),), (("blink", 0.5),)),
    "blinkright": ((("eyeblinkright", 1.0),), (("blink", 0.5),)),
    "eyeblinkleft": ((("blinkleft", 1.0),), (("blink", 0.5),)),
    "eyeblinkright": ((("blinkright", 1.0),), (("blink", 0.5),)),
    "aa": ((("jawopen", 1.0),), (("mouthopen", 1.0),)),
    "jawopen": ((("aa", 1.0),), (("mouthopen", 1.0),)),
    "mouthopen": ((("aa", 1.0),), (("jawopen", 1.0),)),
    "ou": ((("mouthpucker", 1.0),), (("aa", 0.4),)),
    "oh": ((("mouthfunnel", 1.0),), (("aa", 0.7),)),
    "ee": ((("aa", 0.5),), (("jawopen", 0.4),)),
    "ih": ((("aa", 0.3),), (("jawopen", 0.2),)),
    "mouthpucker": ((("ou", 1.0),),),
    "mouthfunnel": ((("oh", 1.0),),),
    "happy": (
        (("mouthsmileleft", 1.0), ("mouthsmileright", 1.0)),
        (("smile", 1.0),),
    ),
    "relaxed": (
        (("mouthsmileleft", 0.6), ("mouthsmileright", 0.6)),
        (("smile", 0.6),),
    ),
    "mouthsmileleft": ((("smile", 0.5),), (("happy", 0.5),)),
    "mouthsmileright": ((("smile", 0.5),), (("happy", 0.5),)),
    "sad": ((("mouthfrownleft", 1.0), ("mouthfrownright", 1.0)),),
    "angry": ((("browdownleft", 1.0), ("browdownright", 1.0)),),
}
"""What moves instead of a blend shape that a character has not: the first of these sets of which it
has every shape; each with the share of the weight."""


@dataclass(frozen=True, slots=True, eq=False)
class _Route:
    """How the blend shapes of one set of names reach the expressions.

    Attributes:
        direct: (n, 2) from which name to which expression.
        stand_in: (m, 2) the same for names that the character has not.
        shares: (m,) of the weights of those.
    """

    direct: NDArray[np.int64]
    stand_in: NDArray[np.int64]
    shares: Array


class ExpressionMixer:
    """Weights of a character's morph targets for the blend shapes of a performer.

    Args:
        morphs: of the character.

    Attributes:
        unmoved: names that came and move nothing, in the order of their coming.
    """

    def __init__(self, morphs: Morphs) -> None:
        self.unmoved: dict[str, None] = {}
        expressions = morphs.expressions
        self._count = len(morphs.targets)
        self._expressions = {canonical_name(e.name): k for k, e in enumerate(expressions)}
        self._is_binary = np.array([e.is_binary for e in expressions], dtype=bool)
        self._overrides = [
            _override(expressions, members, kind)
            for members, kind in ((BLINKS, "blink"), (LOOKS, "look"), (MOUTHS, "mouth"))
        ]
        binds = [(k, t, w) for k, e in enumerate(expressions) for t, w in e.binds]
        self._binds = np.array([bind[:2] for bind in binds], dtype=np.int64).reshape(-1, 2)
        self._bind_weights = np.array([bind[2] for bind in binds])
        self._names: tuple[str, ...] = ()
        self._route = self._route_of(())

    def weights(self, blends: Blends | None) -> Array:
        """Return the weight (T,) in [0, 1] of each morph target; 0 for those that nothing moves."""
        targets = np.zeros(self._count)
        if not blends:
            return targets
        names = tuple(blends)
        if names != self._names:
            self._names, self._route = names, self._route_of(names)
        shown = self.expressions(np.fromiter(blends.values(), np.float64, len(names)))
        sources, moved = self._binds.T
        np.add.at(targets, moved, shown[sources] * self._bind_weights)
        return np.clip(targets, 0.0, 1.0)

    def expressions(self, values: Array) -> Array:
        """Return the weight (E,) of each expression by the rules, for the names that came last."""
        route, count = self._route, len(self._is_binary)
        direct, stand_in = np.zeros(count), np.zeros(count)
        np.maximum.at(direct, route.direct[:, 1], values[route.direct[:, 0]])
        np.add.at(stand_in, route.stand_in[:, 1], values[route.stand_in[:, 0]] * route.shares)
        asked = np.maximum(direct, np.minimum(stand_in, 1.0))
        asked = np.where(self._is_binary, np.where(asked > 0.5, 1.0, 0.0), asked)
        shown = asked.copy()
        for override in self._overrides:
            left = max(1.0 - override.amount(asked), 0.0)
            # A binary expression is there or not: what fades it at all takes it away.
            factor = np.where(self._is_binary & (left < 1.0), 0.0, left)
            shown = np.where(override.members, asked * factor, shown)
        return shown

    def _route_of(self, names: Sequence[str]) -> _Route:
        direct, stand_in, shares = [], [], []
        for source, name in enumerate(names):
            key = canonical_name(name)
            if key in self._expressions:
                direct.append((source, self._expressions[key]))
                continue
            choices = STAND_INS.get(key, ())
            found = next((c for c in choices if all(k in self._expressions for k, _ in c)), ())
            for other, share in found:
                stand_in.append((source, self._expressions[other]))
                shares.append(share)
            if not found and key not in SILENT and len(self.unmoved) < MOST_BLENDS:
                self.unmoved[name] = None
        return _Route(
            np.array(direct, dtype=np.int64).reshape(-1, 2),
            np.array(stand_in, dtype=np.int64).reshape(-1, 2),
            np.array(shares),
        )


@dataclass(frozen=True, slots=True, eq=False)
class _Override:
    """What expressions do to others of one kind: members (E,), and who blends or blocks (E,)."""

    members: NDArray[np.bool_]
    blends: NDArray[np.bool_]
    blocks: NDArray[np.bool_]

    def amount(self, shown: Array) -> float:
        """How much of the members' weights is taken away, 1 or more for all."""
        return float(shown[self.blends].sum() + np.count_nonzero(shown[self.blocks] > 0.0))


def _override(expressions: Sequence[Expression], members: frozenset[str], kind: str) -> _Override:
    own = np.array([canonical_name(e.name) in members for e in expressions], dtype=bool)
    rules = np.array([getattr(e, kind) for e in expressions], dtype=object)
    return _Override(own, (rules == BLEND) & ~own, (rules == BLOCK) & ~own)


class Face:
    """Moves the morph targets of a character on its deformed surface.

    Args:
        character: one with morphs, or without: then nothing moves.
        tell: takes one line about blend shapes that came and move nothing; each is told once.

    Attributes:
        weights: (T,) of its morph targets, as they are now.
    """

    def __init__(self, character: Character, tell: Callable[[str], None] | None = None) -> None:
        self._name, morphs, self._tell = character.name, character.morphs, tell
        self._mixer = None if morphs is None else ExpressionMixer(morphs)
        self._surface = None
        if morphs is not None:
            self._surface = MorphedSurface(character.vertices, character.faces, morphs.targets)
        self.weights = np.zeros(0 if morphs is None else len(morphs.targets))
        self._blends: Blends | None = None
        self._told: set[str] = set()

    def follow(self, blends: Blends | None) -> None:
        """Take over a performer's blend shapes; a face that the source does not have is at rest."""
        if blends is self._blends:
            return
        self._blends = blends
        if self._mixer is not None:
            self.weights = self._mixer.weights(blends)
        if self._tell is not None and (news := self._news()):
            self._tell(news)

    def move(self, vertices: Array) -> None:
        """Move vertices (N, 3) [m] of the deformed character in place."""
        if self._surface is not None and self.weights.any():
            self._surface.add(self.weights, vertices)

    def show(self, weights: Array) -> None:
        """Show other weights (T,) than the performer's, until the performer's next pose."""
        self.restore(weights)

    def restore(self, weights: Array) -> None:
        """Go back to the weights (T,) of a snapshot."""
        self.weights = weights.copy()
        self._blends = {}  # of no pose: the next one counts, whatever it holds

    def _news(self) -> str:
        if self._mixer is None:
            if not self._blends or self._told:
                return ""
            self._told.update(self._blends)
            return f"{self._name} has no blend shapes: the performer's face moves nothing on it"
        fresh = [name for name in self._mixer.unmoved if name not in self._told]
        self._told.update(fresh)
        if not fresh:
            return ""
        what = "blend shape" if len(fresh) == 1 else "blend shapes"
        moves = "moves" if len(fresh) == 1 else "move"
        return f"{what} {', '.join(fresh)} {moves} nothing on {self._name}"
