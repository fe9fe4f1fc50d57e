"""The documents hold what is there: commands run, tables are whole, links lead somewhere."""

from __future__ import annotations

import itertools
import json
import re
import shlex
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import pytest
from PIL import Image

from devices.bodies.source_joints import PRESETS
from devices.builtin.motions import MOTIONS
from replay.formats import formats
from runtime.characters.builtin import BUILTIN
from runtime.characters.character_file import SUFFIXES
from runtime.cli import main, parser
from runtime.control.actions import ACTIONS
from runtime.control.keys import KEYS
from runtime.output.report.report import Report
from tests.thorough import THOROUGH

CHECKOUT = Path(__file__).resolve().parents[1]
PAGES = sorted([*CHECKOUT.glob("*.md"), *(CHECKOUT / "docs").glob("*.md")])
NAMES = [page.relative_to(CHECKOUT).as_posix() for page in PAGES]
FENCE = re.compile(r"^```(?P<info>[^\n]*)\n(?P<text>.*?)^```$", re.MULTILINE | re.DOTALL)


@dataclass(frozen=True)
class Block:
    """A fenced block of a page: what stands after its fence, and what it holds."""

    info: str
    text: str

    @property
    def commands(self) -> list[str]:
        return [line for line in self.text.splitlines() if line.startswith("bunraku ")]


def blocks(name: str) -> Iterator[Block]:
    for found in FENCE.finditer((CHECKOUT / name).read_text(encoding="utf-8")):
        yield Block(found["info"].strip(), found["text"])


def page(name: str) -> str:
    return (CHECKOUT / name).read_text(encoding="utf-8")


def first_column(name: str, heading: str) -> list[str]:
    """The code words in the first column of the table under `heading`."""
    section = page(name).split(f"## {heading}\n", 1)[1].split("\n## ", 1)[0]
    rows = [line for line in section.splitlines() if line.startswith("| `")]
    return [word for row in rows for word in re.findall(r"`([^`]+)`", row.split("|")[1])]


def smaller(command: str) -> list[str]:
    """The arguments of a documented command, with less to do: short takes, small pictures."""
    arguments = shlex.split(command.replace("--seconds 2", "--seconds 0.2"))[1:]
    if "--video" in arguments or "--frames" in arguments:
        arguments += ["--size", "64x48"]
    return arguments


def run_python(text: str, name: str) -> None:
    """Run a documented program with names of its own, for fewer frames."""
    exec(compile(text.replace("frames < 60", "frames < 6"), name, "exec"), {"__name__": "__main__"})


RUNNABLE = [
    name for name in NAMES if any(block.info.endswith("runnable") for block in blocks(name))
]


@pytest.mark.parametrize("name", RUNNABLE)
def test_marked_examples_run_in_order(
    name: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capfd: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    outputs = ("--video", "--frames", "--cache", "--report", "--export", "--record")
    for block in blocks(name):
        kind, _, file = block.info.partition(" ")
        if kind == "json" and file:
            Path(file).write_text(block.text, encoding="utf-8")
        if block.info == "python runnable":
            run_python(block.text, name)
        if block.info != "sh runnable":
            continue
        assert block.commands == block.text.strip().splitlines()
        for command in block.commands:
            arguments = smaller(command)
            if arguments[0] == "figures" and not THOROUGH:
                continue  # tests/runtime/figures draws them of a smaller character
            assert main(arguments) == 0, f"{command}\n{capfd.readouterr().err}"
            for option, value in itertools.pairwise(arguments):
                if option in outputs and "--character" in arguments:
                    assert Path(value).exists(), f"{command} wrote no {value}"


@pytest.mark.parametrize("name", NAMES)
def test_every_command_has_options_that_exist(name: str) -> None:
    for block in blocks(name):
        for command in block.commands:
            parser().parse_args(shlex.split(command, comments=True)[1:])


def test_an_option_that_does_not_exist_would_be_noticed() -> None:
    with pytest.raises(Exception, match="--colour"):
        parser().parse_args(["demo", "--colour"])


@pytest.mark.parametrize("name", NAMES)
def test_links_and_named_files_lead_somewhere(name: str) -> None:
    text = page(name)
    here = (CHECKOUT / name).parent
    for target in re.findall(r"\]\(([^)\s]+)\)", text):
        if target.startswith("https://"):
            continue
        path, _, anchor = target.partition("#")
        assert not path or (here / path).is_file(), target
        if anchor:
            headings = re.findall(r"^#+ (.+)$", text, re.MULTILINE)
            assert anchor in [heading.lower().replace(" ", "-") for heading in headings], target
    for file in re.findall(r"`((?:devices|replay|solvers|runtime|tests|docs)/[\w/.]+)`", text):
        module, _, _ = file.partition(".read_")
        known = (CHECKOUT / module, CHECKOUT / f"{module}.py")
        assert any(path.exists() for path in known), f"{name} names {file}"


def test_every_step_of_a_frame_is_where_the_page_says() -> None:
    steps = re.findall(r"^\| \w+ \| `(\S+)` \| `(\w+)` \|", page("docs/packet-to-pixel.md"), re.M)
    assert len(steps) > 20
    for file, name in steps:
        source = (CHECKOUT / file).read_text(encoding="utf-8")
        assert re.search(rf"^(class|def|void) {name}\b", source, re.MULTILINE), f"{file}: {name}"


def test_the_tables_are_whole() -> None:
    commands = re.findall(r"^\| `bunraku (\w+)", page("README.md"), re.MULTILINE)
    usage = parser().format_help()
    assert commands == re.findall(r"^    (\w+) {2,}", usage, re.MULTILINE)
    texts = {key: ACTIONS[name].text for key, name in KEYS.items()}
    section = page("README.md").split("## The window", 1)[1].split("\n## ", 1)[0]
    shown = dict(re.findall(r"^\| `(\S+)` \| (.+) \|$", section, re.MULTILINE))
    assert shown
    assert shown.items() <= texts.items(), "the rest is in docs/remote.md"
    assert set(first_column("docs/mapping.md", "The part that drives: `--source`")) >= set(PRESETS)
    assert first_column("docs/outputs.md", "The report")  # the keys below
    kinds = re.findall(r"^\| ([^|]+?) \|", page("docs/recordings.md"), re.MULTILINE)
    assert [kind.name for kind in formats()] == kinds[1:]


def test_the_report_has_the_keys_that_are_documented(tmp_path: Path) -> None:
    report = Report(tmp_path / "report.json")
    report.close()
    written = set(json.loads((tmp_path / "report.json").read_text()))
    section = page("docs/outputs.md").split("## The report", 1)[1]
    documented = set(re.findall(r"^\| `(\w+)`", section, re.MULTILINE))
    assert written <= documented
    assert documented == written | {"character", "match", "stretch", "watchdog", "characters"}


def test_names_that_a_reader_may_type_are_there() -> None:
    readme, characters = page("README.md"), page("docs/characters.md")
    for name in BUILTIN:
        assert f"`{name}`" in characters
    for act in MOTIONS:
        assert f"{act}`" in readme
    for suffix in SUFFIXES:
        assert suffix[1:] in readme


def test_the_picture_is_a_picture_of_moderate_size() -> None:
    path = CHECKOUT / "docs/images/demo.png"
    assert path.stat().st_size < 700_000
    with Image.open(path) as picture:
        picture.load()
        assert picture.size == (1280, 560)
