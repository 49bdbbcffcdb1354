"""Sound rigs drawn at random, each homed and tried once: which are stopped all the same, and by what.

Springs, pulleys, tendons, sheaths, friction, creep, the camera's pose, lens, light and latency, and the USB adapter are
drawn: `python -m tests.trial.sound_rigs --count 40` keeps what has ended, and goes on where it was.
"""

from __future__ import annotations

import json
import sys
from typing import Any

import numpy as np

from tests.drawn_rigs import options, tried
from tests.trial.fault_runs import perform, rig_settings

SEED = 20261123


def ended_on(number: int) -> tuple[int, str, str, dict[str, Any]]:
    """A rig's number, why it was stopped, what was odd, and its settings."""
    settings = rig_settings(np.random.default_rng([SEED, number]), number)
    course = perform(settings, number)
    return number, course.reason, course.odd, settings


def main() -> int:
    """Try rigs, and name those that were stopped."""
    asked = options(__doc__, 40, "sound-rigs").parse_args()
    stopped = odd = 0
    for number, (_, reason, words, settings) in tried(asked, ended_on):
        stopped, odd = stopped + bool(reason), odd + bool(words)
        if reason:
            print(f"rig {number}: {reason}\n  {json.dumps(settings['bench'])}", flush=True)
    print(f"{asked.count - stopped} of {asked.count} sound rigs went through, {odd} with something odd")
    return stopped


if __name__ == "__main__":
    sys.exit(main())
