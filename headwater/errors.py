# SPDX-License-Identifier: Apache-2.0
"""Errors that a user caused or can act on: the command prints one line for them and never a traceback."""

EXIT_FAILED = 1  # the work could not be done
EXIT_USAGE = 2  # the request itself is wrong: unknown name, bad option, unreadable file
EXIT_INTERRUPTED = 130  # Ctrl-C, as shells report SIGINT


class UserError(Exception):
    """One clear sentence for the user, and the process's exit status."""

    def __init__(self, message: str, status: int = EXIT_FAILED):
        super().__init__(message)
        self.status = status


def first_line(error: BaseException, limit: int = 300) -> str:
    """The first non-empty line of an error's text, for a one-line message; the error's type where it has no text."""
    for line in str(error).splitlines():
        if line.strip():
            line = line.strip()
            return line if len(line) <= limit else line[: limit - 1] + "…"
    return type(error).__name__


def choose(what: str, name: str, valid) -> str:
    """`name` if it is one of `valid`, else UserError naming the valid ones (exit 2)."""
    valid = list(valid)
    if name not in valid:
        raise UserError(f"unknown {what} '{name}'; choose from: {', '.join(valid)}", EXIT_USAGE)
    return name
