"""The mathematics: arrays in, arrays out; no files, no sockets, no GL, no clocks."""
