"""The contract of every adapter in ADAPTERS; a new one joins with a line in ADDRESSES."""

from __future__ import annotations

import re
from collections.abc import Iterator

import pytest

from devices.errors import InputError
from devices.stream import ADAPTERS, SkeletonStream, open_stream

ADDRESSES = {
    "sim": "sim://walk",
    "vmc": "vmc://127.0.0.1:0",
    "vrchat": "vrchat://127.0.0.1:0",
    "nimate": "nimate://127.0.0.1:0",
    "rokoko": "rokoko://127.0.0.1:0",
    "xsens": "xsens://127.0.0.1:0",
    "xsens by TCP": "xsens://127.0.0.1:0?transport=tcp",
    "mediapipe": "mediapipe://127.0.0.1:0",
    "kinect": "kinect://v2",
    "leap": "leap://",
    "leap+ws": "leap+ws://127.0.0.1:1",
    "webcam": "webcam://0?fetch=off",
    "zmq+tcp": "zmq+tcp://127.0.0.1:1?wait=0.05",
}
"""Where each can be opened on a machine without sensors; port 0 is any free one."""

NEEDS_A_DEVICE = {"kinect", "leap", "webcam", "zmq+tcp"}
"""Those that may find nothing at their address; they then say so in one line."""


WAYS = (*ADAPTERS, "xsens by TCP")
"""Every adapter, and by every transport that it has."""


def address(scheme: str) -> str:
    assert scheme in ADDRESSES, f"give {scheme}:// an address in tests/devices/test_adapters.py"
    return ADDRESSES[scheme]


@pytest.fixture(params=WAYS)
def stream(request: pytest.FixtureRequest) -> Iterator[SkeletonStream]:
    url = address(request.param)
    try:
        opened = open_stream(url)
    except InputError as error:
        if "\n" in str(error):
            pytest.fail(f"more than one line: {error}")
        if request.param not in NEEDS_A_DEVICE and "bunraku[" not in str(error):
            pytest.fail(f"{url} must open anywhere: {error}")
        pytest.skip(f"nothing at {url}: {error}")
    with opened:
        yield opened


def test_it_tells_its_skeleton_at_once_and_polls_without_waiting(stream: SkeletonStream) -> None:
    skeleton = stream.skeleton
    assert len(skeleton.names) > 0
    assert stream.skeleton is skeleton
    assert not stream.ended
    for _ in range(100):
        frames = stream.poll()
        for frame in frames:
            assert frame.positions.shape == (len(skeleton.names), 3)
            assert frame.time <= frame.arrival + 1e-6
    assert not stream.ended


def test_it_closes_twice_and_has_then_ended(stream: SkeletonStream) -> None:
    with stream as itself:
        assert itself is stream
    assert stream.ended
    assert list(stream.poll()) == []
    stream.close()
    assert stream.ended


@pytest.mark.parametrize("scheme", sorted(set(WAYS) - {"sim"}))
def test_an_option_that_it_does_not_know_is_refused_in_one_line(scheme: str) -> None:
    url = address(scheme)
    with pytest.raises(InputError, match=re.escape("'no_such_option'")) as refused:
        open_stream(f"{url}{'&' if '?' in url else '?'}no_such_option=1")
    assert "\n" not in str(refused.value)


@pytest.mark.parametrize("scheme", ADAPTERS)
@pytest.mark.parametrize("rest", ["h:99999", "h:port", "a:b:c", "127.0.0.1:0/a/path"])
def test_an_address_that_makes_no_sense_is_refused_in_one_line(scheme: str, rest: str) -> None:
    with pytest.raises(InputError) as refused:
        open_stream(f"{scheme}://{rest}")
    assert "\n" not in str(refused.value)
