"""The command line: one module per command of `bunraku`."""

from runtime.cli.command_line import main, parser

__all__ = ["main", "parser"]
