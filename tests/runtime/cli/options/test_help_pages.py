"""The pages of `--help`: the usage line has what must be given, and every option does something."""

from __future__ import annotations

import re

import pytest

from devices.errors import InputError
from runtime.cli import parser
from runtime.cli.command_line import COMMANDS


def page_of(command: str, capsys: pytest.CaptureFixture[str]) -> str:
    with pytest.raises(SystemExit) as ended:
        parser().parse_args([command, "--help"])
    assert ended.value.code == 0
    return capsys.readouterr().out


def words(needed: str) -> list[str]:
    """The usage without what is in brackets, one entry for each argument that must be given."""
    return re.findall(r"--\S+ \S+|\S+", re.sub(r"\[.*?\]", "", needed))


@pytest.mark.parametrize("command", COMMANDS)
def test_what_the_usage_line_asks_for_is_enough_and_needed(
    command: str, capsys: pytest.CaptureFixture[str]
) -> None:
    usage = re.match(rf"usage: bunraku {command}(.*)", page_of(command, capsys))
    assert usage
    needed = words(usage[1])
    assert parser().parse_args([command, *" ".join(needed).split()])
    if command == "bridge":
        return  # it asks for one of two options, when it runs
    for left_out in needed:
        rest = " ".join(word for word in needed if word != left_out).split()
        with pytest.raises(InputError, match="required"):
            parser().parse_args([command, *rest])


@pytest.mark.parametrize("command", COMMANDS)
def test_the_page_is_in_groups_and_begins_with_a_sentence(
    command: str, capsys: pytest.CaptureFixture[str]
) -> None:
    page = page_of(command, capsys)
    titles = re.findall(r"^(\w.*):$", page, re.MULTILINE)
    assert not {"positional arguments", "options", "optional arguments"} & set(titles)
    assert titles[-1] == "help"
    assert re.search(r"^[A-Z].*\.$", page, re.MULTILINE)
    for option in re.split(r"\n  (?=-|[A-Z])", page):
        if option.startswith(("--seconds", "--size", "--fps ", "--speed", "--rate", "--drive")):
            assert "default:" in option, option


@pytest.mark.parametrize(
    "offered",
    [["render", "s.bunraku", "--record", "a.mcap"], ["render", "s.bunraku", "--plain"],
     ["live", "--device", "sim://", "--character", "squid", "--loop"]],
    ids=lambda offered: f"{offered[0]} {offered[-1]}",
)  # fmt: skip
def test_what_can_do_nothing_is_not_offered(offered: list[str]) -> None:
    with pytest.raises(InputError, match="unrecognized"):
        parser().parse_args(offered)
