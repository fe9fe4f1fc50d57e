"""The command line: builds the parser of all commands and runs one of them."""

from __future__ import annotations

import argparse
import sys
from collections.abc import Sequence
from importlib import import_module
from typing import Protocol, cast

from devices.errors import InputError
from runtime.show.interrupts import Interrupted, interruptible
from runtime.show.messages import abandon, open_standard_streams, say

COMMANDS = (
    "demo",
    "replay",
    "live",
    "session",
    "edit",
    "render",
    "record",
    "bridge",
    "devices",
    "info",
    "convert",
    "figures",
    "doctor",
    "bench",
)
"""The commands, in the order of `--help`; each is the module of its name in this package."""

IN_SESSIONS = ("session", "edit", "render")
"""The commands whose modules are in `runtime.cli.sessions`."""

BAD_INPUT = 2


class Command(Protocol):
    """What a command's module contains.

    Its top imports only what is quick; `run` imports the rest, so that `--help` answers at once.
    """

    HELP: str
    """What the command does, in a few words."""

    USAGE: str
    """What may follow the command's name, first what must; a line for each way to call it."""

    def add_arguments(self, parser: argparse.ArgumentParser, /) -> None:
        """Add the command's arguments and options."""

    def run(self, options: argparse.Namespace, /) -> int:
        """Run the command and return its exit code."""
        ...


class _Parser(argparse.ArgumentParser):
    """A parser that raises `InputError`, so that bad arguments are refused in one line too."""

    def error(self, message: str) -> None:  # type: ignore[override]  # raises where argparse exits
        raise InputError(f"{message} (see `{self.prog} --help`)")


class _ShowVersion(argparse.Action):
    """Prints the version and exits; finding it takes time, so only when it is asked for."""

    def __call__(self, *_: object, **__: object) -> None:
        from runtime.version import program_version

        print(f"bunraku {program_version()}")
        raise SystemExit(0)


def parser() -> argparse.ArgumentParser:
    """Every command with its options."""
    top = _Parser(
        prog="bunraku",
        usage="bunraku COMMAND [OPTIONS]",
        description="A performer moves, and any character on the screen moves with them.",
        epilog="`bunraku COMMAND --help` shows the options of a command.",
        add_help=False,
    )
    subparsers = top.add_subparsers(
        title="commands", prog="bunraku", dest="command", required=True, metavar="COMMAND"
    )
    for name in COMMANDS:
        folder = "runtime.cli.sessions" if name in IN_SESSIONS else "runtime.cli"
        command = cast(Command, import_module(f"{folder}.{name}"))
        own = subparsers.add_parser(
            name,
            help=command.HELP,
            description=f"{command.HELP[0].upper()}{command.HELP[1:]}.",
            usage="\n       ".join(f"%(prog)s {line}" for line in command.USAGE.splitlines()),
            add_help=False,
        )
        command.add_arguments(own)
        _add_help(own)
        own.set_defaults(run=command.run)
    about = _add_help(top)
    about.add_argument("--version", action=_ShowVersion, nargs=0, help="print the version and exit")
    return top


def _add_help(parser: argparse.ArgumentParser) -> argparse._ArgumentGroup:
    """Add `--help` in a group of its own, below all others."""
    group = parser.add_argument_group("help")
    group.add_argument("-h", "--help", action="help", help="print this page and exit")
    return group


def main(arguments: Sequence[str] | None = None) -> int:
    """Run one command; the exit code is 0, 2 for bad input, 130 after Ctrl-C."""
    open_standard_streams()
    try:
        with interruptible():
            options = parser().parse_args(arguments)
            code: int = options.run(options)
            print(end="", flush=True)
            return code
    except InputError as error:
        return _refuse(str(error))
    except Interrupted as interrupted:
        return interrupted.code
    except BrokenPipeError:  # the reader of our output closed it
        abandon(sys.stdout)
        return 0
    except OSError as error:
        abandon(sys.stdout)  # what it still holds may be what does not fit
        where = f"{error.filename}: " if error.filename else ""
        return _refuse(f"{where}{error.strerror or error}; check the file and its disk")
    except MemoryError:
        return _refuse("this needs more memory than there is; use a smaller file, or close others")


def _refuse(reason: str) -> int:
    say(f"error: {reason}")
    return BAD_INPUT
