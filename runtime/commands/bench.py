"""`bunraku bench`: how fast the parts are on this machine, beside their peers."""

from __future__ import annotations

import argparse
import importlib
import json
from pathlib import Path
from typing import Any

from devices.errors import InputError
from runtime.output.whole_file import check_writable, whole_file

NAMES = ("arap", "tick", "match")


def bench(options: argparse.Namespace) -> int:
    """Run one benchmark or all; print each and write the figures as JSON if asked."""
    if options.name is not None and options.name not in NAMES:
        raise InputError(f"there is no benchmark {options.name!r}; there are: {', '.join(NAMES)}")
    if options.json is not None:
        check_writable(options.json)
    figures: dict[str, Any] = {}
    for name in [options.name] if options.name else NAMES:
        figures[name] = importlib.import_module(f"runtime.benchmarks.{name}").run()
    if options.json is not None:
        _write(options.json, figures)
    return 0


def _write(path: Path, figures: dict[str, Any]) -> None:
    with whole_file(path) as partial:
        partial.write_text(json.dumps(figures, indent=2) + "\n", encoding="utf-8")
