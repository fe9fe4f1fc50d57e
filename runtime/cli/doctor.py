"""`bunraku doctor`: reports what is wrong with this machine, and what to do about it."""

from __future__ import annotations

import argparse

HELP = "check this machine"
USAGE = "[--warm]"


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the command's arguments and options."""
    ahead = parser.add_argument_group("preparing")
    ahead.add_argument(
        "--warm", action="store_true", help="also compile all kernels, so that shows start at once"
    )


def run(options: argparse.Namespace) -> int:
    """Print a line for each thing that a show needs; the exit code is 0 when all is well."""
    from runtime.cli.health_checks import check_all

    wrong = check_all()
    if options.warm:
        from runtime.cli.warm import warm_up

        warm_up()
        print("ok       warm         all kernels of a show are compiled")
    return 1 if wrong else 0
