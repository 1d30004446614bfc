"""Exit code and message for an exception that ends the command."""

import errno
import os
import sys
import traceback
from contextlib import suppress

import click

from boom_model.errors import BoomError, InfeasibleError
from planner.cli.printing import ANSWER_IS_NO, BAD_INPUT, complain

INTERNAL_ERROR, INTERRUPTED = 70, 130
DEBUG = "BOOM_DEBUG"
"""Environment variable that turns on the traceback of an internal error."""


def failure(error: BaseException) -> int:
    """Print one line about an exception, and return its exit code."""
    code, message = _meaning(error)
    if code == INTERNAL_ERROR and os.environ.get(DEBUG):
        traceback.print_exception(error)
    complain(message)
    return code


def _meaning(error: BaseException) -> tuple[int, str]:
    if isinstance(error, InfeasibleError):
        return ANSWER_IS_NO, str(error)
    if isinstance(error, BoomError):
        return BAD_INPUT, str(error)
    if isinstance(error, click.ClickException):
        return BAD_INPUT, f"{error.format_message().rstrip('.')}{_usage(error)}"
    if isinstance(error, click.Abort | KeyboardInterrupt):
        return INTERRUPTED, "interrupted"
    if isinstance(error, MemoryError | OverflowError | RecursionError | FloatingPointError | RuntimeWarning):
        return BAD_INPUT, f"a number is too large or too small to compute with: {str(error) or type(error).__name__}"
    if isinstance(error, OSError):
        return BAD_INPUT, _refused(error)
    return INTERNAL_ERROR, (
        f"internal error: {type(error).__name__}: {error}; please report it with the command and its output with {DEBUG}=1"
    )


def _usage(error: click.ClickException) -> str:
    """Return how a command is called, after an argument too few or too many."""
    if type(error) not in (click.MissingParameter, click.UsageError) or error.ctx is None:  # type: ignore[attr-defined]
        return ""
    context: click.Context = error.ctx  # type: ignore[attr-defined]
    words = [word for word in context.command.collect_usage_pieces(context) if word != "[OPTIONS]"]
    options = [each for each in context.command.params if isinstance(each, click.Option) and each.required]
    needed = [f"{each.opts[0]} {each.metavar or ''}" for each in options]
    return f"; it is called as {' '.join([context.command_path, *words, *needed])}"


def _refused(error: OSError) -> str:
    """Return the message for an error of the operating system."""
    reason = error.strerror or str(error)
    if error.filename is not None:
        return f"{os.fsdecode(error.filename)}: {reason}"
    if error.errno == errno.ENOENT:
        return "the working directory does not exist any more"
    _abandon_output()
    return f"standard output cannot be written: {reason}"


def _abandon_output() -> None:
    """Discard buffered output, so that Python does not try to write it again when it ends."""
    with suppress(OSError, ValueError, AttributeError):
        nowhere = os.open(os.devnull, os.O_WRONLY)
        os.dup2(nowhere, sys.__stdout__.fileno())  # type: ignore[union-attr]
        os.close(nowhere)
