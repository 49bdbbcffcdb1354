"""`wristctl ARGUMENTS`, its bench in real time leaving a record: python real_time_hw_run.py RECORD ARGUMENTS."""

from __future__ import annotations

import functools
import sys
from pathlib import Path
from unittest import mock

if __name__ == "__main__":
    from wristctl.bench.real_time_bench import connect
    from wristctl.cli.app import main
    from wristctl.trial import testbeds

    recorded = functools.partial(connect, record=Path(sys.argv.pop(1)))
    with mock.patch.object(testbeds, "connect", recorded):
        main()
