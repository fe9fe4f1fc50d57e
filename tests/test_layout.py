"""The rules of the tree: imports, sizes of folders and files, docstrings, reasons, no paths."""

from __future__ import annotations

import ast
import inspect
import json
import re
import shutil
import subprocess
import sys
import tokenize
from collections import Counter
from collections.abc import Iterable, Iterator
from functools import cache
from importlib import import_module
from pathlib import Path
from typing import NamedTuple, get_type_hints

import pytest

from devices.stream import ADAPTERS, SkeletonStream
from replay.player import Player

CHECKOUT = Path(__file__).resolve().parents[1]
ROOMS = ("devices", "replay", "solvers", "runtime")
MAY_LOAD = {
    "devices": {"devices", "solvers"},
    "replay": {"replay", "devices", "solvers"},
    "solvers": {"solvers"},
    "runtime": set(ROOMS),
}
GRAPHICS = {"moderngl", "glfw"}
EXTRAS = {
    "SpoutGL",
    "av",
    "cv2",
    "cyndilib",
    "fast_simplification",
    "flatbuffers",
    "igl",
    "manifold3d",
    "mediapipe",
    "meshio",
    "opentimelineio",
    "pxr",
    "pygel3d",
    "pyvirtualcam",
    "sounddevice",
    "syphon",
    "websockets",
}


def loaded_by(code: str) -> set[str]:
    """The top-level modules that a fresh interpreter has loaded after running `code`."""
    tell = "import json, sys; print(json.dumps(sorted({n.split('.')[0] for n in sys.modules})))"
    run = subprocess.run(
        [sys.executable, "-c", f"{code}\n{tell}"],
        cwd=CHECKOUT,
        capture_output=True,
        text=True,
        check=False,
    )
    assert run.returncode == 0, run.stderr
    return set(json.loads(run.stdout.splitlines()[-1]))


def every_module_of(room: str) -> str:
    """Code that imports all of a room but what is there to be run."""
    return (
        f"import importlib, pkgutil, {room}\n"
        f"for module in pkgutil.walk_packages({room}.__path__, '{room}.'):\n"
        f"    if not module.name.endswith('.__main__'):\n"
        f"        importlib.import_module(module.name)"
    )


@cache
def sources(*rooms: str) -> tuple[Path, ...]:
    return tuple(path for room in rooms for path in sorted((CHECKOUT / room).rglob("*.py")))


@cache
def text_of(path: Path) -> str:
    return path.read_text(encoding="utf-8")


class Parsed(NamedTuple):
    """What the rules ask of a file, parsed once."""

    docstring: str | None
    imports: frozenset[str]  # top-level names that it imports anywhere
    at_import: frozenset[str]  # those of them that it imports when it is itself imported


@cache
def parsed(path: Path) -> Parsed:
    module = ast.parse(text_of(path))
    inside: set[str] = set()
    outside: set[str] = set()
    left: list[tuple[ast.AST, set[str]]] = [(module, outside)]
    while left:
        node, names = left.pop()
        if isinstance(node, ast.Import):
            names.update(alias.name.split(".")[0] for alias in node.names)
        elif isinstance(node, ast.ImportFrom) and node.module and node.level == 0:
            names.add(node.module.split(".")[0])
        elif not isinstance(node, ast.expr):
            below = inside if isinstance(node, ast.FunctionDef) else names
            left += [(child, below) for child in ast.iter_child_nodes(node)]
    return Parsed(ast.get_docstring(module), frozenset(inside | outside), frozenset(outside))


@pytest.mark.parametrize("room", ROOMS)
def test_a_room_loads_no_room_that_it_may_not_know(room: str) -> None:
    loaded = loaded_by(every_module_of(room))
    assert loaded & set(ROOMS) <= MAY_LOAD[room]
    assert not loaded & EXTRAS
    if room != "runtime":
        assert not loaded & GRAPHICS


@pytest.mark.parametrize("room", ROOMS)
def test_no_import_hidden_in_a_function_breaks_the_rule(room: str) -> None:
    for path in sources(room):
        assert parsed(path).imports & set(ROOMS) <= MAY_LOAD[room], path


def test_the_library_loads_nothing_before_it_is_used() -> None:
    everything = EXTRAS | GRAPHICS | {"numba", "numpy", "scipy", "devices", "replay", "solvers"}
    assert not loaded_by("import runtime; dir(runtime)") & everything
    assert "numpy" not in loaded_by("from runtime import ShowSettings; ShowSettings()")


def test_only_a_window_loads_what_its_panel_needs() -> None:
    assert "imgui_bundle" not in loaded_by("import runtime.show.show, runtime.cli")


def test_the_command_line_answers_without_loading_what_a_command_needs() -> None:
    asked = (
        "import contextlib, io, runtime.cli\n"
        "with contextlib.redirect_stdout(io.StringIO()), contextlib.suppress(SystemExit):\n"
        "    runtime.cli.main(['--help'])"
    )
    loaded = loaded_by(asked)
    assert not loaded & (EXTRAS | GRAPHICS | {"numba", "numpy", "scipy", "solvers", "replay"})


def test_extras_are_imported_where_they_are_used() -> None:
    for path in sources(*ROOMS):
        assert not parsed(path).at_import & EXTRAS, path


def test_only_the_renderer_and_the_window_touch_graphics() -> None:
    touching = {
        path.relative_to(CHECKOUT).as_posix()
        for path in sources(*ROOMS)
        if parsed(path).imports & GRAPHICS
    }
    # A show passes a context on and names its type; it calls nothing of moderngl.
    named = (
        "figures/window",
        "show/opening/display",
        "show/opening/opened_show",
        "show/scene",
        "show/show",
        "control/keys",
        "panel/gui",
        "panel/panel",
    )
    passing = {f"runtime/{name}.py" for name in named}
    outside = {path for path in touching if not path.startswith("runtime/render/")}
    windows = {"runtime/control/window.py", "runtime/control/audience_window.py"}
    assert outside <= windows | passing
    for path in passing:
        source = text_of(CHECKOUT / path)
        assert set(re.findall(r"moderngl\.(\w+)", source)) <= {"Context", "Framebuffer"}, path


@pytest.mark.parametrize("room", ROOMS)
def test_a_room_is_imported_from_this_checkout(room: str) -> None:
    assert Path(str(import_module(room).__file__)).resolve() == CHECKOUT / room / "__init__.py"


def methods_of_the_protocol() -> set[str]:
    known = {name for name in vars(SkeletonStream) if not name.startswith("_")}
    return known | {"__enter__", "__exit__"}


@pytest.mark.parametrize("scheme", ADAPTERS)
def test_an_adapter_is_the_protocol_and_nothing_more(scheme: str) -> None:
    module = import_module(ADAPTERS[scheme])
    hints = get_type_hints(module.open_device)
    assert list(inspect.signature(module.open_device).parameters) == ["address"]
    stream = hints["return"]
    public = {name for name in vars(stream) if not name.startswith("_")}
    live = {"traffic", "tap", "wait"}  # what else a source can be asked that comes from outside
    assert (public - live) | {"__enter__", "__exit__"} == methods_of_the_protocol()
    assert {"__enter__", "__exit__"} <= set(vars(stream))


def test_a_player_can_stand_in_for_a_device() -> None:
    assert methods_of_the_protocol() <= set(vars(Player))


MOST_MODULES = 20  # in a folder, without its __init__.py
MOST_LINES = 399  # of a file
SUPPRESSED = re.compile(r"# *(?:noqa|type: *ignore)\b.*")
REASONED = re.compile(r"# (?:noqa: [A-Z]+\d+(?:, [A-Z]+\d+)*|type: ignore\[[\w, -]+\])  # \S.+")


def modules() -> list[Path]:
    """Every Python file of the rooms and of the tests."""
    return list(sources(*ROOMS, "tests"))


def named(paths: Iterable[Path]) -> list[str]:
    return [path.relative_to(CHECKOUT).as_posix() for path in paths]


def test_no_folder_has_more_modules_than_one_can_look_through() -> None:
    folders = Counter(path.parent for path in modules() if path.name != "__init__.py")
    assert not named(folder for folder, count in folders.items() if count > MOST_MODULES)


def test_no_file_is_longer_than_one_can_read() -> None:
    lengths = {path: len(text_of(path).splitlines()) for path in modules()}
    assert not named(path for path, length in lengths.items() if length > MOST_LINES)


def test_each_module_says_in_its_first_line_what_it_is() -> None:
    said = {path: parsed(path).docstring for path in modules()}
    assert not named(path for path, docstring in said.items() if not docstring)
    first = {path: str(docstring).splitlines()[0] for path, docstring in said.items()}
    assert not named(path for path, line in first.items() if not line.endswith("."))


@pytest.mark.parametrize("room", ROOMS)
def test_each_room_is_typed_for_those_who_import_it(room: str) -> None:
    assert (CHECKOUT / room / "py.typed").is_file()


def test_each_warning_that_is_suppressed_has_a_reason() -> None:
    for path in modules():
        if SUPPRESSED.search(text_of(path)) is None:
            continue
        with path.open("rb") as file:
            comments = [
                found[0]
                for token in tokenize.tokenize(file.readline)
                if token.type == tokenize.COMMENT and (found := SUPPRESSED.search(token.string))
            ]
        assert not [comment for comment in comments if not REASONED.fullmatch(comment)], path


def tracked_text() -> Iterator[tuple[str, str]]:
    if shutil.which("git") is None or not (CHECKOUT / ".git").exists():
        pytest.skip("needs git and a checkout to know what is tracked")
    listed = subprocess.run(
        ["git", "ls-files", "-z"], cwd=CHECKOUT, capture_output=True, text=True, check=True
    )
    for name in listed.stdout.rstrip("\0").split("\0"):
        path = CHECKOUT / name
        if not path.is_file():
            continue  # removed, not committed yet
        data = path.read_bytes()
        if b"\0" not in data:
            yield name, data.decode("utf-8")


# Put together from pieces, so that this file does not find itself.
MACHINE_PATHS = re.compile(r"(?<![\w.])/(?:work|home|root|Users)" + r"/\w|[A-Z]:\\\\?Users", re.A)
HOSTS = re.compile("|".join(("pypi" + r"\.org", "pythonhosted" + r"\.org", "index-" + "url")))


def test_no_tracked_file_names_a_machine_or_a_registry() -> None:
    for name, text in tracked_text():
        for pattern in (MACHINE_PATHS, HOSTS):
            found = pattern.search(text)
            assert found is None, f"{name}: {found and found.group()}"
