"""Device ``vmc://``: the Virtual Motion Capture protocol, version 3.1, of VTuber programs.

``vmc://127.0.0.1:39539`` receives the pose of a performer's model, in the protocol's role of a
marionette: local poses of Unity's humanoid bones. ``vmc://127.0.0.1:39540?role=performer`` receives
what assistants send to a performer: poses of headset, controllers and trackers, and single bones.
OSC over UDP, in one direction.

Source: sh-akira/VirtualMotionCaptureProtocol, marionette and performer specifications.
"""

from __future__ import annotations

from urllib.parse import SplitResult

from devices.address import host_and_port, one_of, options_of, positive
from devices.errors import InputError
from devices.osc.vmc_decoder import MARIONETTE, PERFORMER, VmcDecoder
from devices.osc.vmc_trackers import bones_of_trackers
from devices.transport.live_stream import LiveStream
from devices.transport.udp import UdpTransport

PORTS = {MARIONETTE: 39539, PERFORMER: 39540}


def open_device(address: SplitResult) -> LiveStream:
    """Listen at ``vmc://HOST:PORT?role=marionette|performer&trackers=SERIAL:BONE,...&tpose=SECONDS``.

    Raises:
        InputError: the port is taken, or an option is unknown.
    """
    options = options_of(
        address,
        {
            "role": one_of(MARIONETTE, PERFORMER),
            "trackers": bones_of_trackers,
            "tpose": positive,
        },
    )
    role = options.get("role", MARIONETTE)
    if "trackers" in options and role != PERFORMER:
        raise InputError("trackers come to a performer only; add role=performer to the address")
    if "tpose" in options and role == PERFORMER:
        raise InputError("trackers have no T-pose; leave tpose out with role=performer")
    host, port = host_and_port(address, PORTS[role])
    transport = UdpTransport(host, port, scheme=address.scheme)
    return LiveStream(
        transport,
        lambda: VmcDecoder(role, trackers=options.get("trackers"), tpose=options.get("tpose")),
    )
