"""The table of actions: each has one name, the same in the docs and in the options."""

from __future__ import annotations

import argparse
import re
from pathlib import Path

from runtime.cli.options.show_options import add_show_options
from runtime.conditioning.switches import STEPS, SWITCHES
from runtime.control.actions import ACTIONS
from runtime.control.keys import KEYS


def test_the_documented_table_is_the_table() -> None:
    page = (Path(__file__).resolve().parents[3] / "docs" / "remote.md").read_text("utf-8")
    rows = [
        [cell.strip() for cell in line.strip("|").split("|")]
        for line in page.splitlines()
        if line.startswith("| `/bunraku/")
    ]
    keys = {name: f"`{key}`" for key, name in KEYS.items()}
    table = []
    for name, action in ACTIONS.items():
        tells = "yes" if action.read else ""
        table.append(
            [
                f"`/bunraku/{name}`",
                keys.get(name, ""),
                action.label,
                action.text,
                action.kind.value,
                tells,
            ]
        )
    assert rows == table


def test_every_step_of_the_conditioning_has_one_name() -> None:
    page = (Path(__file__).resolve().parents[3] / "docs" / "streams.md").read_text("utf-8")
    named = re.findall(r"^\| ([^|]+) \| [^|]+ \| `--(\w+)`", page, re.MULTILINE)
    assert {name: label for label, name in named} == {
        name: label for name, (label, _) in STEPS.items()
    }
    parser = argparse.ArgumentParser(prog="x")
    add_show_options(parser)
    usage = " ".join(parser.format_help().split())
    for name, (label, text) in STEPS.items():
        assert ACTIONS[name].label == label
        assert f"{label}: {text}" in usage
    assert set(STEPS) == set(SWITCHES)
