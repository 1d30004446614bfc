"""Exceptions of the toolkit."""


class BoomError(Exception):
    """Base class of the errors below. The message is one readable sentence."""


class InputError(BoomError, ValueError):
    """The input is wrong: not finite, of wrong shape, malformed, unknown, or a file fails."""


class InfeasibleError(BoomError):
    """The input is valid, but the answer is no: out of reach, outside a limit, or too heavy."""
