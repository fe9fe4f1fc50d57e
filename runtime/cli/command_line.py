"""The command line: `bunraku COMMAND --help` tells each command's options."""

from __future__ import annotations

import argparse
import importlib
import io
import os
import sys
from collections.abc import Callable, Sequence
from pathlib import Path

from devices.errors import InputError
from runtime.cli.arguments import positive, size, whole
from runtime.cli.show_options import add_show_options
from runtime.show.collector_pauses import collector_paused
from runtime.show.interrupt import Interrupted, interruptible

Command = Callable[[argparse.Namespace], int]

BAD_INPUT = 2


class _Parser(argparse.ArgumentParser):
    """Answers bad arguments with the one line that every command answers bad input with."""

    def error(self, message: str) -> None:  # type: ignore[override]  # raises where argparse exits
        raise InputError(f"{message} (see `{self.prog} --help`)")


def _characters(parser: argparse.ArgumentParser, *, required: bool) -> None:
    parser.add_argument(
        "--character",
        action="append",
        required=required,
        metavar="C",
        help="a mesh (obj, ply, stl, off, glb, gltf, vrm) or a built-in character; may be repeated",
    )


def _command(module: str, function: str) -> Command:
    """A command that is imported when it is run, so that `--help` answers at once."""

    def run(options: argparse.Namespace) -> int:
        with collector_paused():
            command: Command = getattr(importlib.import_module(f"runtime.cli.{module}"), function)
        return command(options)

    return run


def parser() -> argparse.ArgumentParser:
    """Every command with its options."""
    top = _Parser(
        prog="bunraku",
        description="A performer moves, and any character on the screen moves with them.",
    )
    commands = top.add_subparsers(dest="command", required=True, metavar="COMMAND")

    def add(module: str, name: str, text: str) -> argparse.ArgumentParser:
        command = commands.add_parser(name, help=text, description=text)
        command.set_defaults(run=_command(module, name))
        return command

    _add_demo(add("show", "demo", "one performer, several characters, nothing else needed"))
    _add_replay(add("show", "replay", "a recorded stream drives a character"))
    _add_live(add("show", "live", "a live stream drives a character"))
    _add_record(add("record", "record", "a live stream goes to a file, without a character"))
    _add_bridge(add("bridge", "bridge", "a live stream goes to shows on other machines"))
    _add_devices(
        add("devices", "devices", "what is connected, what arrives, which ports are taken")
    )
    _add_info(add("info", "info", "what is in a recording or a character's file"))
    _add_convert(add("convert", "convert", "a recording becomes a file of another kind"))
    _add_figures(add("figures", "figures", "draw the figures on squash and stretch"))
    _add_doctor(add("doctor", "doctor", "what is wrong with this machine"))
    _add_bench(add("bench", "bench", "how fast it is here"))
    return top


def _add_demo(demo: argparse.ArgumentParser) -> None:
    _characters(demo, required=False)
    add_show_options(demo)
    demo.set_defaults(fps=30.0, size=(1280, 560))


def _add_replay(replay: argparse.ArgumentParser) -> None:
    replay.add_argument("recording", type=Path, metavar="RECORDING")
    _characters(replay, required=True)
    add_show_options(replay)


def _add_live(live: argparse.ArgumentParser) -> None:
    live.add_argument("--device", required=True, metavar="URL", help="as `bunraku devices` lists")
    _characters(live, required=True)
    add_show_options(live)


def _add_record(record: argparse.ArgumentParser) -> None:
    record.add_argument("--device", required=True, metavar="URL")
    record.add_argument("out", type=Path, metavar="OUT.mcap")
    record.add_argument("--seconds", type=positive, help="stop after this long")


def _add_bridge(bridge: argparse.ArgumentParser) -> None:
    bridge.add_argument("--device", metavar="URL", help="as `bunraku devices` lists")
    bridge.add_argument(
        "--bind",
        default="tcp://127.0.0.1:5570",
        metavar="tcp://HOST:PORT",
        help="where shows find it, as zmq+tcp://HOST:PORT (default tcp://127.0.0.1:5570)",
    )
    bridge.add_argument(
        "--keys", type=Path, metavar="DIR", help="of this machine; needed beyond it"
    )
    bridge.add_argument(
        "--make-keys", type=Path, metavar="DIR", help="write keys for both machines, and end"
    )
    bridge.add_argument("--seconds", type=positive, help="stop after this long")


def _add_devices(there: argparse.ArgumentParser) -> None:
    there.add_argument(
        "addresses", nargs="*", metavar="URL", help="listen there (default: where each kind is)"
    )
    there.add_argument(
        "--seconds", type=positive, default=2.0, metavar="N", help="how long (default 2)"
    )
    there.add_argument("--json", type=Path, metavar="FILE", help="write it there as well")


def _add_info(info: argparse.ArgumentParser) -> None:
    info.add_argument("file", metavar="FILE")


def _add_convert(convert: argparse.ArgumentParser) -> None:
    convert.add_argument("recording", type=Path, metavar="IN", help="any recording that is read")
    convert.add_argument("out", type=Path, metavar="OUT.{mcap,bvh,csv}")
    convert.add_argument("--performer", type=whole, metavar="N", help="of several, only this one")
    convert.add_argument(
        "--unit", choices=("cm", "m", "mm", "in"), help="of a BVH file (default cm)"
    )
    convert.add_argument(
        "--rate", type=positive, metavar="HZ", help="of a BVH file (default: the recording's)"
    )
    convert.add_argument("--force", action="store_true", help="replace OUT if it is there")


def _add_figures(figures: argparse.ArgumentParser) -> None:
    figures.add_argument("folder", type=Path, metavar="DIR", help="where the pictures go")
    figures.add_argument("--size", type=size, default=(1500, 420), metavar="WxH", help="of a row")
    _characters(figures, required=False)


def _add_doctor(doctor: argparse.ArgumentParser) -> None:
    doctor.add_argument("--warm", action="store_true", help="compile the solvers ahead of time")


def _add_bench(bench: argparse.ArgumentParser) -> None:
    bench.add_argument(
        "name",
        nargs="?",
        metavar="NAME",
        help="arap, table1, hold, dense, tick, match or spacetime, all if absent; clips, soak, "
        "kill or latency, which take long",
    )
    bench.add_argument("--seconds", type=positive, help="of show in `bench soak` (default 3600)")
    bench.add_argument(
        "--real-time", action="store_true", help="soak at 60 Hz, not as fast as it goes"
    )
    bench.add_argument(
        "--load", action="store_true", help="latency also beside a process that loads one core"
    )
    bench.add_argument(
        "--recording",
        action="append",
        type=Path,
        metavar="FILE",
        help="for clips, instead of the built-in acts; may be repeated",
    )
    bench.add_argument(
        "--character",
        action="append",
        metavar="C",
        help="for clips, instead of the built-in characters; may be repeated",
    )
    bench.add_argument("--json", type=Path, metavar="FILE", help="write the figures there as well")


def main(arguments: Sequence[str] | None = None) -> int:
    """Run one command; the exit code is 0, 2 for bad input, 130 after Ctrl-C."""
    for stream in (sys.stdout, sys.stderr):  # a name may hold what the terminal cannot show
        if isinstance(stream, io.TextIOWrapper):
            stream.reconfigure(errors="backslashreplace")
    try:
        with interruptible():
            options = parser().parse_args(arguments)
            run: Command = options.run
            code = run(options)
            print(end="", flush=True)
            return code
    except InputError as error:
        return _refuse(str(error))
    except Interrupted as interrupted:
        return interrupted.code
    except BrokenPipeError:  # whoever read our output has seen enough
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        return 0
    except OSError as error:
        where = f"{error.filename}: " if error.filename else ""
        return _refuse(f"{where}{error.strerror or error}; check the file and its disk")
    except MemoryError:
        return _refuse("this needs more memory than there is; use a smaller file, or close others")


def _refuse(reason: str) -> int:
    print(f"bunraku: error: {' '.join(reason.split())}", file=sys.stderr)
    return BAD_INPUT
