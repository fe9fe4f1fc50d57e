"""The options of the flow: what is counted down, and which gestures do the next step."""

from __future__ import annotations

import argparse

from runtime.cli.options.arguments import count_in
from runtime.control.flow_settings import GESTURES, FlowSettings

HANDS_FREE_COUNT_IN = 3.0  # [s]


def add_flow_options(parser: argparse.ArgumentParser) -> None:
    """Add the options of the flow from a match to a take."""
    flow = parser.add_argument_group("how a show goes on from one step to the next")
    flow.add_argument(
        "--count-in",
        type=count_in,
        metavar="S",
        help="count S seconds down before a take begins, and before an accepted match performs "
        "(default: 0; 3 with --hands-free)",
    )
    flow.add_argument(
        "--hands-free",
        choices=GESTURES,
        default="",
        help="let a gesture do the next step: accept the match, begin and end a take, play it; "
        "pose: arms held out to the sides for 2 s; clap: three claps; raise: a hand held above the "
        "head (default: no gesture)",
    )


def flow_settings(options: argparse.Namespace) -> FlowSettings:
    """The settings of the flow that the options of a command line ask for.

    Who has no hand free gets time to take their place, unless they say how much.
    """
    usual = HANDS_FREE_COUNT_IN if options.hands_free else 0.0
    return FlowSettings(
        count_in=usual if options.count_in is None else options.count_in,
        hands_free=options.hands_free,
    )
