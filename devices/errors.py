"""The exceptions for invalid input that the user can correct."""


class InputError(Exception):
    """Invalid input from outside: a file, an address, an argument.

    The message is one line: what is wrong, where, and what to do. The command line prints it as
    ``bunraku: error: ...`` and exits with code 2.
    """


class ContentError(ValueError):
    """A fault in the content of a file; whoever opened it adds its name and raises InputError."""
