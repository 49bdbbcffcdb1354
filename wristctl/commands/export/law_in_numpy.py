"""A law in NumPy: a module of its own, without wristctl, which holds itself against vectors."""

from string import Template
from typing import Any

from wristctl.commands.export.law_programs import LawPrograms, Observed
from wristctl.commands.export.law_vectors import Vectors
from wristctl.commands.export.written_code import listed, number, numpy_function, shared_words
from wristctl.control.response import OF_A_PLANE

_MODULE = Template('''\
"""$about

NumPy alone. README.md says when to call what. `python $name.py vectors.csv` holds it against the vectors.
"""

import sys
from typing import NamedTuple

import numpy as np

PLANES, PLACES, REFERENCE, PERIOD = $planes, $places, $reference, $period
ALIKE = np.array([$alike])
$constants


def _logb(x):
    return np.frexp(x)[1] - 1.0


$functions


class Output(NamedTuple):
    """Of each plane `wanted` and `torque` [N m], of each place of tendons `pull` of all and `tension` of one [N]."""

    wanted: np.ndarray
    torque: np.ndarray
    share: float
    pull: np.ndarray
    tension: np.ndarray
    count: np.ndarray
$speed_field

class Law:
    """The controller of one wrist; it begins at rest on the straight wrist, its tendons at their least pull."""

    def __init__(self):
        self.memory = np.zeros($memory)
        self.motors = np.array([$motor_start])
        self.withheld = self.motors[$withheld : $withheld + PLANES]
        self.tick_number = 0
$reset$frame
    def tick(self, ${measured}reference):
        """One control period: the Output."""
        reference = np.asarray(reference, float)
        $see
        wanted, torque, share = np.zeros(PLANES), np.zeros(PLANES), np.zeros(1)
        pull, count = np.zeros(PLACES), np.zeros(PLACES)
        with np.errstate(all="ignore"):
            _respond(seen, reference, self.motors, self.memory, wanted, torque, pull, share)
            bend_ref, rate_ref = reference[::$of_a_plane], LEAD * reference[1::$of_a_plane]
            _actuate(bend_ref, rate_ref, pull, self.motors, count)
$predict        self.tick_number += 1
        return Output(wanted, torque, float(share[0]), pull, pull / ALIKE, count$speed)


def largest_difference(rows):
    """Largest difference from test vectors, of numbers above 1 as a share of them."""
    law, largest = Law(), 0.0
    for row in rows:
        $call
        found, expected = np.concatenate([out.wanted, out.tension, out.$driven]), row[$expected:]
        largest = np.maximum(largest, np.max(np.abs(found - expected) / np.maximum(1.0, np.abs(expected))))
    return float(largest)


def _main():
    rows = np.loadtxt(sys.argv[1] if len(sys.argv) > 1 else "vectors.csv", delimiter=",", skiprows=1, ndmin=2)
    largest = largest_difference(rows)
    print(f"{len(rows)} ticks, largest difference {largest:.3g}")
    return 0 if largest <= 1e-9 else 1


if __name__ == "__main__":
    sys.exit(_main())
''')

_FRAME = Template('''
    def frame(self, bend, age):
        """A picture's bends [rad], which is `age` old [s], before a tick; None where it shows no wrist.

        False, and nothing done, for a picture older than one that has come before.
        """
        at = max(self.tick_number - age / PERIOD, 0.0)
        captured = int(np.floor(at + 1e-6))
        since = max(at - captured, 0.0) * PERIOD
        if captured < self.fused_tick or captured > self.tick_number:
            return False
        with np.errstate(all="ignore"):
            for past in range(self.fused_tick, captured):
                _propagate(self.counts[past % $remembered], self.fused)
            for p in range(PLANES if bend is not None else 0):
                x = self.fused[$of_x * p : $of_x * (p + 1)]
                x += self.gain[$of_x * p : $of_x * (p + 1)] * (bend[p] - x[0] - since * x[1])
            self.now[:] = self.fused
            for past in range(captured, self.tick_number):
                _propagate(self.counts[past % $remembered], self.now)
        self.fused_tick = captured
        return True
''')

_PREDICT = Template("""\
            if self.tick_number - self.fused_tick >= $remembered:  # no picture for long
                _propagate(self.counts[self.fused_tick % $remembered], self.fused)
                self.fused_tick += 1
            self.counts[self.tick_number % $remembered] = count
            _propagate(count, self.now)
""")


def numpy_module(programs: LawPrograms, about: str) -> str:
    """Text of the module."""
    words = shared_words(programs) | {"about": about.replace('"', "'"), "speed_field": "", "speed": ""}
    if programs.remembered:
        first = 2 * (programs.places + programs.planes)
        words["speed_field"] = f"    {programs.driven}: np.ndarray\n"
        words["speed"] = f", self.motors[{first} :: {programs.remembered}].copy()"
    values = [(key, value) for key, value in programs.constants.items() if key != "PERIOD"]
    words["constants"] = "\n".join(f"{key} = np.float64({number(value, 'numpy')})" for key, value in values)
    functions = programs.functions.items()
    words["functions"] = "\n\n\n".join(numpy_function(f"_{key}", function) for key, function in functions)
    own = _measured(programs) if programs.observer is None else _observed(programs, programs.observer)
    return _MODULE.substitute(words | own)


def largest_difference(text: str, vectors: Vectors) -> float:
    """Largest difference of the module from its vectors, of numbers above 1 as a share of them."""
    world: dict[str, Any] = {"__name__": "law"}
    exec(compile(text, "law.py", "exec"), world)
    return float(world["largest_difference"](vectors.rows))


def _measured(programs: LawPrograms) -> dict[str, str]:
    planes, of = programs.planes, OF_A_PLANE
    bend, rate = f"row[1:{1 + planes}]", f"row[{1 + planes}:{1 + 2 * planes}]"
    return {
        "reset": "", "frame": "", "predict": "", "measured": "bend, rate, ",
        "see": f"seen = np.zeros({of} * PLANES)\n        seen[::{of}], seen[1::{of}] = bend, rate",
        "call": f"out = law.tick({bend}, {rate}, row[{1 + 2 * planes}:{programs.inputs}])",
    }  # fmt: skip


def _observed(programs: LawPrograms, observer: Observed) -> dict[str, str]:
    words, planes = {"of_x": str(OF_A_PLANE), "remembered": str(observer.remembered)}, programs.planes
    reset = [
        f"        self.gain = np.array([{listed(observer.gain)}])",
        f"        self.fused, self.now = (np.array([{listed(observer.start)}]) for _ in range(2))",
        f"        self.counts, self.fused_tick = np.zeros(({observer.remembered}, PLACES)), 0\n",
    ]
    call = [
        "if row[0] >= 0.0:",
        f"            law.frame(None if np.isnan(row[1]) else row[1:{1 + planes}], row[0])",
        f"        out = law.tick(row[{1 + planes}:{programs.inputs}])",
    ]
    return {
        "reset": "\n".join(reset), "frame": _FRAME.substitute(words), "predict": _PREDICT.substitute(words),
        "measured": "", "see": "seen = self.now", "call": "\n".join(call),
    }  # fmt: skip
