"""The process of the command `boom`, or of `python -m planner`.

It sets its signal handlers before it imports anything slow.
"""

import os
import signal
import sys

_STOPPED = {signal.SIGINT: "interrupted", signal.SIGTERM: "terminated"}


def _stop(number: int, _: object) -> None:
    """End the process at once.

    An exception would not do, because libraries may catch it or replace it by their own.
    """
    discard = getattr(sys.modules.get("planner.files"), "discard", None)
    if discard is not None:
        discard()
    try:
        os.write(2, f"boom: {_STOPPED[signal.Signals(number)]}\n".encode())
    finally:
        os._exit(128 + number)


def main() -> None:
    """Run the command and exit as `planner.cli.main`.

    If the process is interrupted or terminated, the exit code is 130 or 143, with one line on
    standard error.
    """
    for number in _STOPPED:
        signal.signal(number, _stop)
    import warnings

    # The matrices are small: threads of linear algebra would only wait for each other.
    os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
    os.environ["MPLBACKEND"] = "agg"  # pictures go to files, whatever backend the user has set
    if hasattr(sys.stdout, "reconfigure"):
        sys.stdout.reconfigure(errors="backslashreplace")  # a file name may have any byte
    # By default NumPy only warns of an overflow, and continues with an infinity.
    warnings.filterwarnings("error", "(overflow|invalid value|divide by zero) encountered", RuntimeWarning)
    from planner.cli import main as run

    try:
        run()
    finally:
        signal.signal(signal.SIGINT, signal.SIG_IGN)  # nothing is left to interrupt
        signal.signal(signal.SIGTERM, signal.SIG_DFL)


if __name__ == "__main__":
    main()
