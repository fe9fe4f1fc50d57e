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
USAGE = "[NAME] [OPTIONS]"

DEFAULT = ("arap", "table1", "hold", "dense", "tick", "layers", "match", "spacetime")
LONG = ("clips", "likeness", "soak", "kill", "latency", "fuzz")  # only when named


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the command's arguments and options."""
    measured = parser.add_argument_group("what is measured")
    measured.add_argument(
        "name",
        nargs="?",
        metavar="NAME",
        help="arap, table1, hold, dense, tick, layers, match or spacetime (default: each of "
        "these); or clips, likeness, soak, kill, latency or fuzz, which take long",
    )
    measured.add_argument(
        "--json", type=Path, metavar="FILE", help="also write the figures to this file"
    )
    played = parser.add_argument_group("clips, likeness and fuzz")
    played.add_argument(
        "--recording",
        action="append",
        type=Path,
        metavar="FILE",
        help="play this recording (default: built-in ones); fuzz: damage it, too; repeat the "
        "option for several",
    )
    played.add_argument(
        "--character",
        action="append",
        metavar="C",
        help="use this character (default: all built-in ones); fuzz: damage it, too; repeat the "
        "option for several",
    )
    likeness = parser.add_argument_group("likeness")
    likeness.add_argument(
        "--drive", choices=DRIVES, help="how the characters follow (default: auto)"
    )
    likeness.add_argument(
        "--sheets",
        type=Path,
        metavar="DIR",
        help="draw moments of each pair into a picture in this folder",
    )
    soak = parser.add_argument_group("soak")
    soak.add_argument(
        "--seconds", type=positive, metavar="N", help="seconds of show (default: 3600)"
    )
    soak.add_argument(
        "--real-time", action="store_true", help="run at 60 Hz (default: as fast as possible)"
    )
    latency = parser.add_argument_group("latency")
    latency.add_argument(
        "--load", action="store_true", help="measure also while another process is busy"
    )
    fuzz = parser.add_argument_group("fuzz")
    fuzz.add_argument(
        "--inputs", type=counting, metavar="N", help="number of damaged inputs (default: 200000)"
    )
    fuzz.add_argument("--seed", type=int, metavar="N", help="seed of all damage (default: 0)")


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
