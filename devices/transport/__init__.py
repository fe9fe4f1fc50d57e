"""Receiving bytes: sockets, sensor SDKs, reader threads, clocks and bounded queues."""
