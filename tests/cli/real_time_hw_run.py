"""`wristctl ARGUMENTS`, its bench in real time leaving a record: python real_time_hw_run.py RECORD ARGUMENTS."""

from __future__ import annotations

import functools
import sys
from pathlib import Path

if __name__ == "__main__":
    from wristctl.cli.app import main
    from wristctl.trial import testbeds

    testbeds.connect = functools.partial(testbeds.connect, record=Path(sys.argv.pop(1)))
    main()
