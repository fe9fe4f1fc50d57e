"""How bytes arrive: sockets, reader threads, clocks and bounded queues."""
