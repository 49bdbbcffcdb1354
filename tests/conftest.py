"""What every test may rely on."""

from __future__ import annotations

import signal

from hypothesis import settings

# A shell starts background jobs with Ctrl-C ignored, and children inherit that: tests that interrupt need it back.
signal.signal(signal.SIGINT, signal.default_int_handler)

# How long an example takes depends on what else the machine does.
settings.register_profile("wristctl", deadline=None)
settings.load_profile("wristctl")
