"""Between two planes a person takes ten seconds: nothing moves meanwhile, and what goes wrong ends the wait."""

from __future__ import annotations

import math
import os
from collections.abc import Callable

import numpy as np
import pytest

from tests.trial.conftest import Done, Run, settings_of
from wristctl.bench.virtual_bench import VirtualBench
from wristctl.board.board_errors import Faulted, PortLost, Restarted
from wristctl.board.emulator.chip import FREQUENCY
from wristctl.board.framing import encode
from wristctl.board.messages import ESTOP_SEQ, Command
from wristctl.errors import UserError
from wristctl.trial import testbeds
from wristctl.trial.safety import SafetyStop
from wristctl.trial.supervised_wait import Meanwhile
from wristctl.trial.testbeds import BEFORE_MOTION, EmulatedTestbed, RealTestbed
from wristctl.trial.tracking import InlineTracking
from wristctl.vision.marker import Sighting
from wristctl.vision.view import View

Happens = Callable[[VirtualBench, float], object]

SEEDS = 20 if os.environ.get("WRISTCTL_THOROUGH") else 1
BENDS = 20.0
"""A person's force [N] that bends the held wrist by some 5 deg."""
ESTOP, DISABLE = encode(Command.ESTOP, ESTOP_SEQ), encode(Command.DISABLE, 1)


class Waited:
    """What the emulated rig did in the wait between two planes; `happens` is shown the bench and the seconds waited."""

    def __init__(self, monkeypatch: pytest.MonkeyPatch, happens: Happens = lambda bench, time: None) -> None:
        self.steps: list[tuple[int, ...]] = []
        self.pulls, self.angles = np.empty((0, 4)), np.empty(0)
        self.seconds = math.nan
        person = EmulatedTestbed._person

        def asked(testbed: EmulatedTestbed, meanwhile: Meanwhile) -> None:
            bench = testbed._bench
            assert isinstance(bench, VirtualBench)
            if not any(bench.motion().energised):
                person(testbed, meanwhile)
                return
            began = bench.transport.now()

            def moment() -> None:
                self.steps.append(bench.motion().steps)
                happens(bench, bench.transport.now() - began)
                meanwhile()

            try:
                person(testbed, moment)
            finally:
                self.seconds = bench.transport.now() - began
                truth = bench.truth(began - 1e-3)
                self.pulls, self.angles = truth.pull, np.degrees(truth.angle)

        monkeypatch.setattr(EmulatedTestbed, "_person", asked)


def two_planes(experiment: Run, seed: int = 0, takes: float = 1.0, **person: float) -> Done:
    planes = ("ulnar", "flexion")
    return experiment(
        seed=seed, directions=planes, bench={"motors": {"slack": (0.0,) * 4}, "person": person | {"takes": takes}}
    )


@pytest.mark.parametrize("force", [0.0, BENDS])
@pytest.mark.parametrize("seed", range(SEEDS))
@pytest.mark.slow
def test_in_ten_seconds_no_step_is_made_and_tendons_keep_their_pull(
    experiment: Run, monkeypatch: pytest.MonkeyPatch, seed: int, force: float
) -> None:
    """Also where the person bends the wrist by 5 deg to both sides."""
    waited = Waited(monkeypatch)
    done = two_planes(experiment, seed, takes=10.0, force=force)
    assert done.error is None and done.experiment.outcomes == {0: "ok", 1: "ok"}
    assert waited.seconds == pytest.approx(10.0, abs=0.05)
    assert set(waited.steps) == {waited.steps[0]} and len(waited.steps) > 300
    bent = waited.angles.max() - waited.angles[0], waited.angles[0] - waited.angles.min()
    changed = np.abs(waited.pulls - waited.pulls[0]).max(axis=1)
    print(f"{seed} {force} bent by {bent}, pulls change by {changed.max():.2f} N, in the end by {changed[-1]:.2f} N")
    if force:
        assert min(bent) == pytest.approx(5.0, abs=1.0) and max(bent) < 6.0 and 5.0 < changed.max() < 40.0
        assert changed[-1] < 1.0
    else:
        assert changed.max() < 1.0


@pytest.mark.slow
def test_a_wrist_bent_beyond_what_its_tendons_may_pull_ends_the_wait(
    experiment: Run, monkeypatch: pytest.MonkeyPatch
) -> None:
    waited = Waited(monkeypatch)
    done = two_planes(experiment, takes=10.0, force=4 * BENDS)
    assert isinstance(done.error, SafetyStop) and "tension of about" in done.error.what
    assert waited.seconds < 4.0 and waited.pulls[-1].max() < 95.0
    assert not any(done.bench.motion().energised)


@pytest.mark.slow
def test_a_marker_that_a_hand_has_covered_is_no_evidence(experiment: Run, monkeypatch: pytest.MonkeyPatch) -> None:
    """What it shows while flags are moved about does not end the wait."""
    angles = {"shown": math.nan}

    def moved(bench: VirtualBench, time: float) -> None:
        angles["shown"] = math.nan if time < 0.5 else 1.5

    waited = Waited(monkeypatch, moved)
    look = InlineTracking.look

    def looked(tracking: InlineTracking) -> list[Sighting]:
        found = look(tracking)
        if waited.steps and math.isnan(waited.seconds):
            return [each._replace(theta=angles["shown"]) for each in found]
        return found

    monkeypatch.setattr(InlineTracking, "look", looked)
    assert two_planes(experiment).error is None and waited.seconds == pytest.approx(1.0, abs=0.05)


FAULTS: dict[str, tuple[Happens, type[UserError], str]] = {
    "button": (lambda bench, time: bench.chip.drive("G", 0, True), Faulted, "emergency stop button"),
    "reset": (lambda bench, time: bench.chip.reset(), Restarted, "the board has restarted"),
    "port lost": (lambda bench, time: setattr(bench.transport, "_lost", True), PortLost, "the port is gone"),
    "stop": (lambda bench, time: bench.transport.chip.write(ESTOP), Faulted, "the host sent an emergency stop"),
    "released": (lambda bench, time: bench.transport.chip.write(DISABLE), SafetyStop, "the board is"),
}


@pytest.mark.parametrize("fault", FAULTS)
@pytest.mark.slow
def test_a_fault_ends_the_wait_within_a_tenth_of_a_second(
    experiment: Run, monkeypatch: pytest.MonkeyPatch, fault: str
) -> None:
    happens, error, said = FAULTS[fault]
    at: list[float] = []

    def once(bench: VirtualBench, time: float) -> None:
        if time > 0.3 and not at:
            at.append(time)
            happens(bench, time)

    waited = Waited(monkeypatch, once)
    done = two_planes(experiment)
    assert isinstance(done.error, error) and said in done.error.what
    assert 0.0 <= waited.seconds - at[0] <= 0.1
    done.bench.chip.run(FREQUENCY)
    assert not any(done.bench.motion().energised)
    assert done.experiment.stop is not None and done.experiment.stop.reason == done.error.what


def test_at_a_real_rig_a_person_is_asked_with_the_wait_that_a_fault_may_end(monkeypatch: pytest.MonkeyPatch) -> None:
    class Dark:
        def __init__(self, *_: object) -> None:
            """A camera, or a wire, that is there."""

    def ask(what: str, meanwhile: Meanwhile) -> None:
        asked.append(what)
        meanwhile()

    asked: list[str] = []
    monkeypatch.setattr(testbeds, "DeviceCamera", Dark)
    monkeypatch.setattr(testbeds, "open_transport", Dark)
    real = RealTestbed(settings_of(port="x", safety={"motor_pull": 30.0}), [View()], None, ask)
    assert not real.emulated and EmulatedTestbed.emulated, "faults of the bench are never injected into a real rig"
    for question in (real.confirm, lambda meanwhile: real.face("flexion", meanwhile)):
        with pytest.raises(TimeoutError):
            question(_fault)
    assert (
        asked[0] == BEFORE_MOTION.format(30.0)
        and "pull 30 N at most" in asked[0]
        and "bends toward flexion" in asked[1]
    )


def _fault() -> None:
    raise TimeoutError
