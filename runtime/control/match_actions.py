"""The actions that take one of the best matches, as their small pictures in the window do."""

from __future__ import annotations

from collections.abc import Mapping

from runtime.control.action import Action, Do
from runtime.control.show_controls import ShowControls

ORDINALS = ("best", "second", "third", "fourth")


def _show(rank: int) -> Do:
    """What shows the match of a rank, 1 for the best."""

    def press(controls: ShowControls) -> None:
        controls.match_controls.show_match(rank)

    return press


MATCH_ACTIONS: Mapping[str, Action] = {
    f"match-{rank}": Action(
        f"{ordinal} match".capitalize(), f"light up the {ordinal} match", press=_show(rank)
    )
    for rank, ordinal in enumerate(ORDINALS, start=1)
}
"""The rows of the table of actions that are for single matches."""
