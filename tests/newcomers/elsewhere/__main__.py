"""`python -m elsewhere ...` is `wristctl ...` with what this package adds."""

from __future__ import annotations

import sys

import elsewhere.tables  # noqa: F401 puts its newcomers where wristctl looks
from wristctl.cli.app import main

sys.argv[0] = "wristctl"
main()
