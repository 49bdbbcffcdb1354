"""The command line as a process: Ctrl-C ends it without a word from here on, before all that it needs is imported."""

import os
import signal
import sys
from contextlib import suppress

# The object on stdout of a command that was interrupted before it could begin, where --json was typed.
_INTERRUPTED = b"""{
  "schema": "wristctl.error/1",
  "kind": "interrupted",
  "exit_code": 130,
  "what": "interrupted",
  "where": "",
  "fix": ""
}
"""


def main() -> None:
    """Run the command line; once it has ended nothing is left that Ctrl-C could end."""
    if signal.getsignal(signal.SIGINT) is not signal.SIG_IGN:
        signal.signal(signal.SIGINT, _interrupted)
    _on_this_system()
    from wristctl.cli.app import main as command_line

    try:
        command_line()
    except KeyboardInterrupt:  # in the very moment of its ending
        _leave(130)
    except SystemExit as ended:
        if ended.code == 130:
            _leave(130)
        raise
    finally:
        signal.signal(signal.SIGINT, signal.SIG_IGN)


def _on_this_system() -> None:
    """End with a sentence where the system is none that wristctl runs on."""
    from wristctl.cli.json_output import print_error
    from wristctl.errors import UserError
    from wristctl.platforms import check

    try:
        check()
    except UserError as error:
        sys.stderr.write(f"error: {error}\n")
        print_error(error)
        raise SystemExit(error.exit_code) from None


def _interrupted(*_: object) -> None:
    """End at once."""
    with suppress(OSError):
        os.write(1, _INTERRUPTED * ("--json" in sys.argv))
    os._exit(130)


def _leave(code: int) -> None:
    """End without the interpreter's own clearing up, which need not bear what an interruption has left half done."""
    with suppress(OSError):
        sys.stdout.flush()
        sys.stderr.flush()
    os._exit(code)


if __name__ == "__main__":
    main()
