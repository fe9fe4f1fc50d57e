"""`bunraku bench`: measures how fast the program is, and how well its characters follow."""

from __future__ import annotations

import argparse
import importlib
import json
from pathlib import Path
from typing import Any

from devices.errors import InputError
from runtime.cli.options.arguments import counting, positive
from runtime.show.settings import DRIVES

HELP = "measure the speed of this machine"

DEFAULT = ("arap", "table1", "hold", "dense", "tick", "layers", "match", "spacetime")
LONG = ("clips", "likeness", "soak", "kill", "latency", "fuzz")  # only when named


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the command's arguments and options."""
    parser.add_argument(
        "name",
        nargs="?",
        metavar="NAME",
        help="arap, table1, hold, dense, tick, layers, match or spacetime (default: all); or "
        "clips, likeness, soak, kill, latency or fuzz, which take long",
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
        help="clips, likeness: play this recording, not a built-in one; fuzz: damage it too; may "
        "be repeated",
    )
    parser.add_argument(
        "--character",
        action="append",
        metavar="C",
        help="clips, likeness: use this character, not the built-in ones; fuzz: damage it too; may "
        "be repeated",
    )
    parser.add_argument(
        "--drive", choices=DRIVES, help="likeness: how the characters follow (default auto)"
    )
    parser.add_argument(
        "--sheets",
        type=Path,
        metavar="DIR",
        help="likeness: draw moments of each pair into a picture in this folder",
    )
    parser.add_argument(
        "--inputs", type=counting, metavar="N", help="fuzz: damaged inputs (default 200000)"
    )
    parser.add_argument(
        "--seed", type=int, metavar="N", help="fuzz: another seed damages otherwise (default 0)"
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
    """The arguments of the benchmark; each option belongs to some benchmarks only."""
    asked = {
        "seconds": (options.seconds, ("soak",)),
        "real_time": (options.real_time or None, ("soak",)),
        "load": (options.load or None, ("latency",)),
        "recording": (options.recording, ("clips", "likeness", "fuzz")),
        "character": (options.character, ("clips", "likeness", "fuzz")),
        "inputs": (options.inputs, ("fuzz",)),
        "seed": (options.seed, ("fuzz",)),
        "drive": (options.drive, ("likeness",)),
        "sheets": (options.sheets, ("likeness",)),
    }
    for name, (value, owners) in asked.items():
        if value is not None and options.name not in owners:
            option = name.replace("_", "-")
            there = " and ".join(f"`bunraku bench {owner}`" for owner in owners)
            raise InputError(f"--{option} is for {there}; leave it out")
    return {name: value for name, (value, _) in asked.items() if value is not None}
