"""The one exception for input that a user can put right."""


class InputError(Exception):
    """Bad input from outside: a file, an address, an argument.

    The message is one line that says what is wrong, where, and what to do about it; the command
    line prints it as ``bunraku: error: ...`` and exits with code 2.
    """
