"""`bunraku bench`: how fast the parts are on this machine, beside their peers."""

from __future__ import annotations

import argparse
import importlib
import json
from pathlib import Path
from typing import Any

from devices.errors import InputError
from runtime.output.files.whole_file import check_writable, whole_file

NAMES = ("arap", "table1", "hold", "dense", "tick", "match", "spacetime")
LONG = ("clips", "soak", "kill", "latency")  # only when named


def bench(options: argparse.Namespace) -> int:
    """Run one benchmark or all; print each and write the figures as JSON if asked."""
    if options.name is not None and options.name not in NAMES + LONG:
        there = ", ".join(NAMES + LONG)
        raise InputError(f"there is no benchmark {options.name!r}; there are: {there}")
    wishes = _wishes(options)
    if options.json is not None:
        check_writable(options.json)
    figures: dict[str, Any] = {}
    for name in [options.name] if options.name else NAMES:
        figures[name] = importlib.import_module(f"runtime.benchmarks.{name}").run(**wishes)
    if options.json is not None:
        _write(options.json, figures)
    return 0


def _wishes(options: argparse.Namespace) -> dict[str, Any]:
    """What was asked of the one benchmark that can be asked for it."""
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


def _write(path: Path, figures: dict[str, Any]) -> None:
    with whole_file(path) as partial:
        partial.write_text(json.dumps(figures, indent=2) + "\n", encoding="utf-8")
