"""Remote control over OSC: other people's client and server on loopback, and hostile datagrams."""

from __future__ import annotations

import contextlib
import random
import socket
import threading
import time
from collections.abc import Callable, Iterator
from pathlib import Path

import moderngl
import pytest
from pythonosc.dispatcher import Dispatcher
from pythonosc.osc_server import BlockingOSCUDPServer
from pythonosc.udp_client import SimpleUDPClient

from devices.osc.messages import Message, write_bundles, write_message
from replay.player import EveryFrame, Player
from runtime.characters.character import Character
from runtime.cli import main
from runtime.control.actions import ACTIONS
from runtime.control.remote import (
    ANSWERS,
    AT_ONCE,
    LONGEST,
    MOST_WARNINGS,
    WAITING,
    Remote,
    Request,
    RequestError,
    _is_near,
    request_of,
)
from tests.runtime.staged import StagedShow
from tests.runtime.stick_figures import make_figure, record, waving
from tests.waiting import PATIENCE

LOOPBACK = "127.0.0.1"


@pytest.fixture(scope="module")
def character() -> Character:
    return make_figure()


class Staged(StagedShow):
    """A show with a remote control, served after every tick as in `runtime.show.show`."""

    def __init__(
        self, context: moderngl.Context, character: Character, folder: Path, answer_port: int = 0
    ) -> None:
        super().__init__(
            context, character, Player(record(waving(40)), EveryFrame(), loop=True), folder
        )
        self.time = 0.0
        self.remote = Remote(
            LOOPBACK, 0, answer_port=answer_port, tell=self.told.append, clock=lambda: self.time
        )
        self.client = SimpleUDPClient(LOOPBACK, self.remote.port)

    def until(self, there: Callable[[], bool]) -> None:
        """Let the show go on until something is so."""
        deadline = time.monotonic() + PATIENCE
        while not there():
            assert time.monotonic() < deadline, "it never came"
            self.loop.tick()
            self.remote.serve(self.controls)
            self.time += 1.0 / 60.0

    def close(self) -> None:
        self.client.close()
        self.remote.close()
        super().close()


@pytest.fixture
def show(context: moderngl.Context, character: Character, tmp_path: Path) -> Iterator[Staged]:
    show = Staged(context, character, tmp_path)
    yield show
    show.close()


@contextlib.contextmanager
def phone(port: int = 0) -> Iterator[tuple[BlockingOSCUDPServer, dict[str, float]]]:
    """python-osc's own server; what it was told last of each address."""
    lights: dict[str, float] = {}
    dispatcher = Dispatcher()
    dispatcher.map("/bunraku/state/*", lambda address, value: lights.update({address: value}))
    server = BlockingOSCUDPServer((LOOPBACK, port), dispatcher)
    thread = threading.Thread(target=server.serve_forever, kwargs={"poll_interval": 0.01})
    thread.start()
    try:
        yield server, lights
    finally:
        server.shutdown()
        thread.join()
        server.server_close()


def test_a_button_acts_when_it_is_pressed_and_not_when_it_is_let_go(show: Staged) -> None:
    show.client.send_message("/bunraku/mirror", 1.0)
    show.client.send_message("/bunraku/mirror", 0.0)
    show.client.send_message("/bunraku/freeze", [])
    show.until(lambda: show.loop.frozen)
    assert show.switches.mirror
    for argument in (1, True, 1.0):
        before = show.switches.mirror
        show.client.send_message("/bunraku/mirror", argument)
        show.until(lambda before=before: show.switches.mirror is not before)
    for argument in (0, False, 0.0):
        show.client.send_message("/bunraku/mirror", argument)
    show.client.send_message("/bunraku/freeze", 1)
    show.until(lambda: not show.loop.frozen)
    assert not show.switches.mirror
    assert show.remote.refused == 0


def test_the_whole_table_is_at_hand_by_its_names(show: Staged) -> None:
    for name, action in ACTIONS.items():
        if action.press is not None and name != "leave":
            show.client.send_message(f"/bunraku/{name}", 1.0)
        if action.write is not None:
            show.client.send_message(f"/bunraku/{name}/set", 0.5)
        show.until(lambda: show.remote._waiting == 0 and not show.remote._requests)
    show.until(lambda: show.controls.takes.recording)
    show.client.send_message("/bunraku/leave", [])  # only what is mapped by hand
    show.until(lambda: not show.controls.chooser.on)
    show.client.send_message("/bunraku/leave", [])  # asks, while something is recorded
    show.client.send_message("/bunraku/leave", 1.0)
    show.until(lambda: show.controls.leaving)
    assert show.remote.refused == show.remote.dropped == 0
    assert not show.told


def test_a_fader_goes_where_it_is_put_and_stays_within_its_way(show: Staged) -> None:
    surface = show.puppet.surface
    for value, cartoon in ((0.25, 0.25), (7.0, 1.0), (-3.0, 0.0), (1, 1.0), (float("inf"), 1.0)):
        show.client.send_message("/bunraku/cartoon", value)
        show.until(lambda cartoon=cartoon: surface.elasticity.cartoon == cartoon)
    for step in range(200):  # a thumb on the fader: only where it ends counts
        show.client.send_message("/bunraku/cartoon", step / 400.0)
    show.until(lambda: surface.elasticity.cartoon == pytest.approx(199 / 400.0))
    show.client.send_message("/bunraku/cartoon", float("nan"))
    show.client.send_message("/bunraku/cartoon", [])
    show.client.send_message("/bunraku/cartoon", "much")
    show.client.send_message("/bunraku/cartoon", [0.5, 0.5])
    show.until(lambda: show.remote.refused == 4)
    assert surface.elasticity.cartoon == pytest.approx(199 / 400.0)


def test_a_switch_can_be_set_whatever_it_was(show: Staged) -> None:
    for value in (1, 1, 0, 0, 1):
        show.client.send_message("/bunraku/predict/set", value)
        show.client.send_message("/bunraku/cartoon/set", value)
        show.until(lambda value=value: show.puppet.surface.elasticity.cartoon == value)
        assert show.switches.predict is bool(value)


def test_what_is_asked_for_is_done_in_order(show: Staged) -> None:
    """Also where it all comes at once, and one request takes the place of another."""
    requests = [("mirror/set", 1.0), ("mirror", 1.0), ("mirror/set", 1.0), ("freeze", 1.0)]
    messages = [write_message(f"/bunraku/{name}", "f", value) for name, value in requests]
    (bundle,) = write_bundles(messages, 1400)
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as sender:
        sender.sendto(bundle, (LOOPBACK, show.remote.port))
        show.until(lambda: show.loop.frozen)
    assert show.switches.mirror


def test_a_show_is_run_from_a_phone_from_match_to_blackout(show: Staged) -> None:
    show.until(lambda: len(show.match_session.mappings[0].drives) > 0)
    shown = show.match_session.mappings[0].drives
    show.client.send_message("/bunraku/next-match", 1)
    show.until(lambda: show.match_session.mappings[0].drives not in ((), shown))
    show.client.send_message("/bunraku/accept", 1)
    show.until(lambda: not show.match_session.matching)
    show.client.send_message("/bunraku/freeze", 1)
    show.until(lambda: show.loop.frozen)
    count = len(show.seen.vertices)
    show.until(lambda: len(show.seen.vertices) == count + 5)
    assert all((v == show.seen.vertices[-1]).all() for v in show.seen.vertices[count:])
    show.client.send_message("/bunraku/blackout", 1)
    show.until(lambda: show.scene.blackout.target == 1.0)
    show.now += 1.0
    show.until(lambda: not show.seen.pictures[-1][..., :3].any())


def test_lights_follow_on_the_phones_own_port(
    context: moderngl.Context, character: Character, tmp_path: Path
) -> None:
    with phone() as (server, lights):
        show = Staged(context, character, tmp_path, answer_port=server.server_address[1])
        show.client.send_message("/bunraku/mirror", 1.0)
        show.until(lambda: lights.get("/bunraku/state/mirror") == 1.0)
        readable = {f"/bunraku/state/{name}" for name, a in ACTIONS.items() if a.read}
        show.until(lambda: set(lights) == readable)
        show.switches.mirror = False  # by a key, say
        show.puppet.surface.elasticity = type(show.puppet.surface.elasticity)(cartoon=0.5)
        show.until(lambda: lights["/bunraku/state/mirror"] == 0.0)
        show.until(lambda: lights["/bunraku/state/cartoon"] == 0.5)
        lights.clear()  # datagrams get lost
        show.until(lambda: set(lights) == readable)
        show.close()


def test_who_sends_and_listens_on_one_port_is_answered_there(show: Staged) -> None:
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as pedal:
        pedal.settimeout(PATIENCE)
        pedal.connect((LOOPBACK, show.remote.port))  # hears nobody else
        pedal.send(write_message("/bunraku/freeze"))
        show.until(lambda: show.loop.frozen)
        show.until(lambda: show.remote._sent_to is not None)
        assert b"/bunraku/state/freeze" in pedal.recv(65535)


def test_answers_are_few_and_small_however_much_changes(show: Staged) -> None:
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as asker:
        asker.bind((LOOPBACK, 0))
        asker.sendto(write_message("/bunraku/freeze"), (LOOPBACK, show.remote.port))
        show.until(lambda: show.remote._sent_to is not None)
        began = show.time
        while show.time < began + 10.0:
            show.switches.mirror = not show.switches.mirror
            show.remote.serve(show.controls)
            show.time += 1.0 / 240.0
        asker.setblocking(False)
        answers = []
        with contextlib.suppress(BlockingIOError):
            while True:
                answers.append(asker.recv(65535))
    assert 50 <= len(answers) <= 10 * ANSWERS + 1
    assert max(map(len, answers)) <= LONGEST


@pytest.mark.parametrize(
    ("host", "near"),
    [
        ("127.0.0.1", True),
        ("::1", True),
        ("192.168.1.20", True),
        ("10.1.2.3", True),
        ("169.254.3.4", True),
        ("fe80::1%eth0", True),
        ("8.8.8.8", False),
        ("2600::1", False),
        ("0.0.0.0", False),
        ("224.0.0.1", False),
        ("nonsense", False),
    ],
)
def test_only_this_network_is_answered(host: str, near: bool) -> None:
    assert _is_near(host) is near


def test_messages_and_what_they_ask_for() -> None:
    def ask(address: str, *arguments: object) -> Request | None:
        return request_of(Message(address, "", arguments))

    assert ask("/bunraku/mirror") == ask("/bunraku/mirror", 1) == Request("mirror")
    assert ask("/bunraku/mirror", 0) is ask("/bunraku/mirror", False) is None
    assert ask("/bunraku/mirror/set", 0) == Request("mirror", 0.0)
    assert (
        ask("/bunraku/cartoon", 0.3) == ask("/bunraku/cartoon/set", 0.3) == Request("cartoon", 0.3)
    )
    wrong = [
        "/bunraku/none", "/bunraku/", "/bunraku", "/mirror", "mirror", "/bunraku/mirror/",
        "/bunraku/accept/set", "/bunraku/mirror/set/set", "/bunraku/state/mirror", "/bunraku/*",
    ]  # fmt: skip
    for address in wrong:
        with pytest.raises(RequestError):
            ask(address, 1)
    for value in ("1", b"1", None, float("nan")):
        with pytest.raises(RequestError):
            ask("/bunraku/mirror", value)


def test_hostile_datagrams_neither_stop_nor_steer_it(show: Staged) -> None:
    chance = random.Random(4)
    good = write_message("/bunraku/mirror", "f", 1.0)
    junk = [b"", b"\0", b"/bunraku/mirror", b"#bundle\0" + bytes(12), bytes(65507)]
    junk += [chance.randbytes(chance.randrange(200)) for _ in range(500)]
    for _ in range(500):
        bad = bytearray(good)
        bad[chance.randrange(len(bad))] ^= 1 << chance.randrange(8)
        junk.append(bytes(bad))
    state = {name: action.read(show.controls) for name, action in ACTIONS.items() if action.read}
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as sender:
        for start in range(0, len(junk), 50):  # no faster than they are read
            for data in junk[start : start + 50]:
                sender.sendto(data, (LOOPBACK, show.remote.port))
            before = show.loop.frozen
            sender.sendto(write_message("/bunraku/freeze"), (LOOPBACK, show.remote.port))
            show.until(lambda before=before: show.loop.frozen is not before)
    assert show.remote.refused > 500
    assert len(show.told) <= MOST_WARNINGS
    assert all(line.isascii() and "\n" not in line and len(line) < 400 for line in show.told)
    after = {name: action.read(show.controls) for name, action in ACTIONS.items() if action.read}
    changed = {name for name in state if state[name] != after[name]}
    assert changed <= {"freeze", "mirror"}, "a flipped bit of a value may leave it a press"


def test_a_flood_is_bounded_and_a_tick_does_a_little_of_it(show: Staged) -> None:
    press = Request("mirror")
    for _ in range(10 * WAITING):
        show.remote._keep(press)
        show.remote._keep(Request("cartoon", 0.5))
    assert len(show.remote._requests) == WAITING + 1
    assert show.remote.dropped == 9 * WAITING
    for left in range(WAITING - AT_ONCE, -1, -AT_ONCE):
        show.remote.serve(show.controls)
        assert show.remote._waiting == left
    assert not show.remote._requests


def test_an_unknown_address_is_told_once_with_what_to_do(show: Staged) -> None:
    for _ in range(3):
        show.client.send_message("/bunraku/applause", 1)
    show.until(lambda: show.remote.refused == 3)
    (line,) = show.told
    assert "'/bunraku/applause'" in line
    assert "docs/remote.md" in line


def test_a_port_that_is_taken_is_one_line(capsys: pytest.CaptureFixture[str]) -> None:
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as taken:
        taken.bind((LOOPBACK, 0))
        port = taken.getsockname()[1]
        show = ["demo", "--character", "squid", "--headless", "--fast"]
        assert main([*show, "--remote", f"{LOOPBACK}:{port}"]) == 2
    line = capsys.readouterr().err.strip()
    assert "\n" not in line
    assert f"UDP port {port} is taken" in line


@pytest.mark.parametrize(
    ("options", "reason"),
    [
        (["--remote", "127.0.0.1:99999"], "expected HOST:PORT"),
        (["--remote", "9100:"], "expected HOST:PORT"),
        (["--remote", "203.0.113.9:9100"], "no address of this machine"),
        (["--remote", "127.0.0.1:9100", "--remote-feedback", "0"], "a port from 1 to 65535"),
        (["--remote-feedback", "9000"], "add --remote"),
    ],
)
def test_what_cannot_be_listened_on_is_one_line(
    options: list[str], reason: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["demo", "--character", "squid", "--headless", "--fast", *options]) == 2
    line = capsys.readouterr().err
    assert reason in line
    assert line.count("\n") == 1


def test_it_ends_with_its_thread_and_gives_the_port_back(show: Staged) -> None:
    show.remote.close()
    show.remote.close()
    assert not show.remote._thread.is_alive()
    Remote(LOOPBACK, show.remote.port, tell=show.told.append).close()
