"""`bunraku bench`: measures how fast the parts of the program are on this machine."""

from __future__ import annotations

import argparse
import importlib
import json
from pathlib import Path
from typing import Any

from devices.errors import InputError
from runtime.cli.arguments import positive

HELP = "measure the speed of this machine"

DEFAULT = ("arap", "table1", "hold", "dense", "tick", "match", "spacetime")
LONG = ("clips", "soak", "kill", "latency")  # only when named


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the command's arguments and options."""
    parser.add_argument(
        "name",
        nargs="?",
        metavar="NAME",
        help="arap, table1, hold, dense, tick, match or spacetime (default: all of these); or "
        "clips, soak, kill or latency, which take long",
    )
    parser.add_argument(
        "--seconds", type=positive, metavar="N", help="soak: seconds of show (default 3600)"
    )
    parser.add_argument(
        "--real-time", action="store_true", help="soak: run at 60 Hz, not as fast as possible"
    )
    parser.add_argument(
        "--load", action="store_true", help="latency: measure also while another process is busy"
    )
    parser.add_argument(
        "--recording",
        action="append",
        type=Path,
        metavar="FILE",
        help="clips: play this recording instead of the built-in motions; may be repeated",
    )
    parser.add_argument(
        "--character",
        action="append",
        metavar="C",
        help="clips: use this character instead of the built-in ones; may be repeated",
    )
    parser.add_argument(
        "--json", type=Path, metavar="FILE", help="also write the figures to this file"
    )


def run(options: argparse.Namespace) -> int:
    """Run one benchmark or all; print each and write the figures as JSON if asked."""
    from runtime.output.files.whole_file import check_writable, whole_file

    if options.name is not None and options.name not in DEFAULT + LONG:
        there = ", ".join(DEFAULT + LONG)
        raise InputError(f"there is no benchmark {options.name!r}; there are: {there}")
    arguments = _arguments(options)
    if options.json is not None:
        check_writable(options.json)
    figures: dict[str, Any] = {}
    for name in [options.name] if options.name else DEFAULT:
        figures[name] = importlib.import_module(f"runtime.benchmarks.{name}").run(**arguments)
    if options.json is not None:
        with whole_file(options.json) as partial:
            partial.write_text(json.dumps(figures, indent=2) + "\n", encoding="utf-8")
    return 0


def _arguments(options: argparse.Namespace) -> dict[str, Any]:
    """The arguments of the benchmark; each option belongs to one benchmark only."""
    asked = {
        "seconds": (options.seconds, "soak"),
        "real_time": (options.real_time or None, "soak"),
        "load": (options.load or None, "latency"),
        "recording": (options.recording, "clips"),
        "character": (options.character, "clips"),
    }
    for name, (value, owner) in asked.items():
        if value is not None and options.name != owner:
            option = name.replace("_", "-")
            raise InputError(f"--{option} is for `bunraku bench {owner}`; leave it out")
    return {name: value for name, (value, _) in asked.items() if value is not None}
