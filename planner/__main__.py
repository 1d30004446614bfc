"""The process of the command `boom`, or `python -m planner`: what holds from its first moment to its last.

It imports nothing that takes time before the signals have their handler.
"""

import os
import signal
import sys

_STOPPED = {signal.SIGINT: "interrupted", signal.SIGTERM: "terminated"}


def _stop(number: int, _: object) -> None:
    """Ends the process at once.

    An exception would have to pass through libraries that swallow it, or turn it into an error of theirs.
    """
    discard = getattr(sys.modules.get("planner.files"), "discard", None)
    if discard is not None:
        discard()
    try:
        os.write(2, f"boom: {_STOPPED[signal.Signals(number)]}\n".encode())
    finally:
        os._exit(128 + number)


def main() -> None:
    """Run the command; exit 130 or 143 with one line when it is interrupted or terminated, else as `planner.cli.main`."""
    for number in _STOPPED:
        signal.signal(number, _stop)
    import warnings

    # The boom's matrices are small: threads of linear algebra only wait for each other.
    os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
    os.environ["MPLBACKEND"] = "agg"  # pictures go to files, whatever the user's windows are drawn with
    if hasattr(sys.stdout, "reconfigure"):
        sys.stdout.reconfigure(errors="backslashreplace")  # a file's name may hold any byte
    # NumPy only warns of numbers beyond what it can compute, and goes on with an infinity.
    warnings.filterwarnings("error", "(overflow|invalid value|divide by zero) encountered", RuntimeWarning)
    from planner.cli import main as run

    try:
        run()
    finally:
        signal.signal(signal.SIGINT, signal.SIG_IGN)  # all is done
        signal.signal(signal.SIGTERM, signal.SIG_DFL)


if __name__ == "__main__":
    main()
