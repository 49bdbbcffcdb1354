"""`python -m elsewhere ...` is `wristctl ...` with what this package adds."""

from __future__ import annotations

import sys

import elsewhere  # noqa: F401 puts its newcomers into the tables
from wristctl.cli.app import main

sys.argv[0] = "wristctl"
main()
