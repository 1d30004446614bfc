"""What the toolkit says when it cannot do what was asked."""


class BoomError(Exception):
    """Base of the errors below; its message is one readable sentence."""


class InputError(BoomError, ValueError):
    """The input itself is wrong: not finite, of the wrong shape, malformed, unknown, not readable or not writable."""


class InfeasibleError(BoomError):
    """The input is sound and the answer is no: out of reach, outside a limit, too fast, too heavy."""
