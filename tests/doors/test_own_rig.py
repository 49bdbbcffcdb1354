"""A robot of one's own in one file: checked, run, sealed by its hash; a wrong one is named by its check."""

from __future__ import annotations

import hashlib
import json
import math
import re
import shlex
from pathlib import Path
from types import SimpleNamespace
from typing import Any, cast

import numpy as np
import pandas as pd
import pytest
from pydantic import ValidationError

from tests.doors.carrier import CARRIED, MARK, carrier
from tests.doors.conftest import wristctl
from wristctl.commands.adoption import adopted
from wristctl.commands.export.run_data import _mass_is_said
from wristctl.commands.rig_certificate import Certificate, RigCheck
from wristctl.config.hw_run import HwRunSettings, RigRow
from wristctl.config.study import Study
from wristctl.config.wrist import TendonPlace, WristParameters
from wristctl.errors import UserError
from wristctl.records import Run
from wristctl.rig import Facts, Limits, Lost, Sensor, Spread, Tendon, VirtualClock, WallClock
from wristctl.trial.experiment import Experiment, log_of
from wristctl.trial.guarded_rig import GuardedRig, RigStop
from wristctl.trial.rig_settings import check_facts, rig_of, settings_of, wrist_of
from wristctl.trial.rig_stand import RigStand
from wristctl.trial.safety import SafetyStop
from wristctl.trial.trials import Trial
from wristctl.wrist.tendon_layout import TendonLayout

TEMPLATE = Path(__file__).parents[2] / "wristctl" / "cli" / "templates" / "rig.py.txt"
RIG = TEMPLATE.read_text(encoding="utf-8").replace("@OBJECT@", "RIG").replace("@Title@", "Test")

# Lines of the file that tests change.
TENDONS = "[Tendon(0.0, RADIUS), Tendon(120.0, RADIUS), Tendon(240.0, RADIUS)]"
LOOK = "return Look(bend + self._noise.normal(0.0, math.radians(0.02), 2), time)"
CLOCK = "self.clock = VirtualClock(self._advance, STEP)"
WITHIN = "if not (np.abs(targets) <= 1e3 * self.facts.limits.travel).all():"
PLANT = "1e-3 * sent - 3e-4)"
AGE = "<= now - DELAY"
NEWEST = "time, bend = self._seen[0] if"
SENT = "        return sent\n"
SENDS = "        self._heard, sent ="
LOOKS = "        now = self.clock.now()\n        while len"
PULLS = "        pulls = TENDON"
WAITS = "self.clock.wait_until(self.clock.now() + 0.06)"
BENT = "        if self._bend[0] > 0.15:\n            "

# Two tendons in one plane, by the same file.
ONE_PLANE = (
    ("planes=2", "planes=1"),
    (TENDONS, "[Tendon(0.0, RADIUS), Tendon(180.0, RADIUS)]"),
    ("np.full(3, -3e-4)", "np.full(2, -3e-4)"),
    ("return np.zeros(3)", "return np.zeros(2)"),
    (LOOK, LOOK.replace("bend +", "bend[:1] +").replace(", 2)", ", 1)")),
)
# All around, in this order of the targets.
FIVE = (
    (TENDONS, "[Tendon(angle, RADIUS) for angle in (0.0, 72.0, 144.0, 216.0, 288.0)]"),
    ("np.full(3, -3e-4)", "np.full(5, -3e-4)"),
    ("return np.zeros(3)", "return np.zeros(5)"),
)

# What is wrong, in the file's own text, and the check that names it.
BROKEN: dict[str, tuple[str, str, str]] = {
    "no stop": ("def stop(self)", "def halt(self)", "contract"),
    "a rate of 0": ("rate=0.2", "rate=0.0", "contract"),
    "tendons on one side": ("Tendon(240.0, RADIUS)", "Tendon(60.0, RADIUS)", "contract"),
    "a place that is no number": ("Tendon(120.0, RADIUS)", 'Tendon(float("nan"), RADIUS)', "contract"),
    "goes blind": (LOOK, LOOK.replace("bend +", "(math.nan if now > 1.2 else 1.0) * bend +"), "refuses"),
    "a clock that stands": (CLOCK, f"{CLOCK}\n        self.clock.wait_until = lambda moment: None", "clock"),
    "connect moves": ("return np.zeros(3)", "return np.array([1.5, 0.0, 0.0])", "connect"),
    "looks stand still": (LOOK, LOOK.replace(", time)", ", 0.0)"), "looks"),
    "looks of the future": (LOOK, LOOK.replace(", time)", ", time + 1.0)"), "looks"),
    "old looks": (AGE, "<= now - 0.1", "looks"),
    "no bend": (LOOK, LOOK.replace("bend +", "math.nan * bend +"), "looks"),
    "noisy": (LOOK, LOOK.replace("0.02", "0.2"), "noise"),
    "says it sent something else": (SENT, SENT.replace("sent", "0.0 * sent"), "sent"),
    "nan passes": (WITHIN, WITHIN.replace("not (", "(").replace("<=", ">").replace("all", "any"), "refuses"),
    "no limit": (WITHIN, "if not np.isfinite(targets).all():", "refuses"),
    "wrong error": ("raise Refused(", "raise ValueError(", "refuses"),
    "wrong sense": (PLANT, PLANT.replace("sent", "sent * np.array([1.0, -1.0, 1.0])"), "sense"),
    "tendons exchanged": (PLANT, PLANT.replace("sent", "sent[[0, 2, 1]]"), "sense"),
    "a motor without power": (PLANT, PLANT.replace("sent", "sent * np.array([1.0, 1.0, 0.0])"), "sense"),
    "targets of half a mm": (PLANT, PLANT.replace("1e-3", "0.5e-3"), "scale"),
    "late motors": ("self.clock.now() + DELAY", "self.clock.now() + 0.1", "delay"),
    "motors somewhat late": ("self.clock.now() + DELAY", "self.clock.now() + DELAY + 0.01", "delay"),
    "bends dated too late": (NEWEST, "time, bend = (now - DELAY, self._seen[0][1]) if", "delay"),
    "stop does nothing": ("        self._coming.clear()", "        pass", "stop"),
    "close fails": ("    def close(self):\n        self.stop()", "    def close(self):\n        1 / 0", "close"),
    "follows after silence": ('raise Fault("silence")', "pass", "silence"),
}
# Further changes that one needs.
ALSO = {"bends dated too late": (AGE, "<= now - 0.1")}


def written(folder: Path, *changes: tuple[str, str], name: str = "my_rig.py") -> str:
    text = RIG
    for before, after in changes:
        assert before in text, before
        text = text.replace(before, after)
    (folder / name).write_text(text, encoding="utf-8")
    return f"{folder / name}:RIG"


def checked(reference: str) -> dict[str, RigCheck]:
    return {check.asked: check for check in Certificate(reference, Study()).checks()}


@pytest.mark.slow
def test_the_shipped_robot_passes_every_check_and_runs(tmp_path: Path) -> None:
    done = wristctl(tmp_path, "new", "rig", "my-rig")
    assert done.returncode == 0 and "wristctl check-rig my_rig.py:MY_RIG" in done.stdout
    done = wristctl(tmp_path, "check-rig", "my_rig.py:MY_RIG", "--json")
    page = json.loads(done.stdout)
    assert done.returncode == 0 and page["fit"] and len(page["allowed"]) == 3
    assert {check["asked"]: check["passed"] for check in page["checks"]} == {"source": None} | dict.fromkeys(
        ("contract", "clock", "connect", "looks", "noise", "sent", "refuses", "sense", "scale", "delay", "stop",
         "close", "silence", "Ctrl-C", "trial"), True,
    )  # fmt: skip
    run = wristctl(
        tmp_path, "hw-run", "pid-ff", "--rig", "my_rig.py:MY_RIG", "--set", "directions=[ulnar]", "--horizon", "2", "-q"
    )
    assert run.returncode == 0, run.stderr
    sealed = Run(tmp_path / run.stdout.strip().splitlines()[-1])
    digest = hashlib.sha256((tmp_path / "my_rig.py").read_bytes()).hexdigest()
    assert sealed.manifest.code.foreign == {"code/my_rig/my_rig.py": digest}
    assert str(sealed.config.hw_run.rig).endswith("code/my_rig/my_rig.py:MY_RIG")
    log = pd.read_csv(sealed.path / "data/log.csv")
    assert [name for name in log.columns if name.startswith("tension_")] == ["tension_1", "tension_2", "tension_3"]
    trials = pd.read_csv(sealed.path / "data/trials.csv")
    assert trials["outcome"].tolist() == ["ok"] and math.degrees(trials["rmse"][0]) < 0.1


@pytest.mark.slow
@pytest.mark.parametrize("wrong", BROKEN)
def test_a_broken_rig_is_named_by_its_check(tmp_path: Path, wrong: str) -> None:
    before, after, check = BROKEN[wrong]
    found = checked(written(tmp_path, (before, after), *([ALSO[wrong]] if wrong in ALSO else [])))
    assert [name for name, one in found.items() if one.passed is False] == [check], found


@pytest.mark.parametrize(("before", "call"), [(LOOKS, "look()"), (SENDS, "send()")], ids=["look", "send"])
def test_a_call_that_waits_longer_than_a_tick_is_named(tmp_path: Path, before: str, call: str) -> None:
    """News at every poll are not often enough where a poll itself takes long."""
    found = checked(written(tmp_path, (before, f"        {WAITS}\n{before}")))
    assert [name for name, one in found.items() if one.passed is False] == ["looks"], found
    assert f"{call} takes 60 ms" in found["looks"].found and "thread" in found["looks"].fix


def test_calls_that_together_take_longer_than_a_tick_are_both_told(tmp_path: Path) -> None:
    waits = ((LOOKS, 0.007), (SENDS, 0.004))
    longer = [(before, f"        {WAITS.replace('0.06', str(seconds))}\n{before}") for before, seconds in waits]
    looks = checked(written(tmp_path, *longer))["looks"]
    assert looks.passed is False and "look() takes 7 ms and send() 4 ms" in looks.found


class _Tried:
    """A trial of a rig in memory."""

    def __init__(self, folder: Path, *changes: tuple[str, str], horizon: float = 1.0, **given: Any) -> None:
        settings = HwRunSettings.model_validate(
            {"rig": written(folder, *changes), "rows": (RigRow(controller="pid-ff"),), "horizon": horizon} | given
        )
        study = adopted(Study(hw_run=settings), "hw-run").study
        self.settings, self.wrist = study.hw_run, study.wrist
        namespace: dict[str, Any] = {}
        exec(compile((folder / "my_rig.py").read_text(), str(folder / "my_rig.py"), "exec"), namespace)
        self.rig = namespace["RIG"]()
        self.folder = folder / "data"
        self.folder.mkdir()
        self.log = log_of(self.folder, self.settings, self.wrist)
        direction = self.settings.directions[0]
        self.experiment = Experiment(self.settings, self.wrist, [Trial(0, direction, 0, 0.0, 0)], self.log)

    def run(self) -> Experiment:
        try:
            self.experiment.run(RigStand(GuardedRig(self.rig, "my_rig.py:RIG")))
        finally:
            self.log.close()
        return self.experiment


@pytest.mark.slow
@pytest.mark.parametrize("changes", [(), ONE_PLANE], ids=["three tendons, two planes", "two tendons, one plane"])
def test_a_trial_follows_its_motion_and_homing_finds_the_slack(
    tmp_path: Path, changes: tuple[tuple[str, str], ...]
) -> None:
    tried = _Tried(tmp_path, *changes)
    experiment = tried.run()
    assert experiment.outcomes == {0: "ok"} and experiment.stop is None and experiment.zero is not None
    assert np.allclose(experiment.zero.slack, 3e-4, atol=5e-5)  # the file's own
    expected = [math.radians(tendon.angle_deg) for tendon in tried.rig.facts.tendons]
    assert np.allclose(np.exp(1j * np.array(experiment.zero.directions)), np.exp(1j * np.array(expected)), atol=0.1)
    log = pd.read_csv(tried.folder / "log.csv")
    errors = log[[name for name in log.columns if name.startswith("error")]]
    assert len(log) == 100 and np.rad2deg(errors.abs().max().max()) < 0.5
    assert (pd.read_csv(tried.folder / "residuals.csv")["late"] == 0.0).all()  # virtual time


@pytest.mark.slow
@pytest.mark.parametrize("changes", [(), ONE_PLANE], ids=["three tendons, two planes", "two tendons, one plane"])
def test_trials_of_it_wind_by_the_stretch_that_homing_measures_where_that_is_wanted(
    tmp_path: Path, changes: tuple[tuple[str, str], ...]
) -> None:
    """Its tendons are 1.6 times as stiff as its facts say: without feedback the wrist goes too far for them."""
    softer, missed = ("stiffness=TENDON", "stiffness=TENDON / 1.6"), dict[str, float]()
    for stretch in ("believed", "measured"):
        (folder := tmp_path / stretch).mkdir()
        rows = (RigRow(controller="feedforward", gains={}),)
        tried = _Tried(folder, *changes, softer, rows=rows, homing={"stretch": stretch})
        assert tried.run().outcomes == {0: "ok"}
        log = pd.read_csv(folder / "data" / "log.csv")
        errors = log[[name for name in log.columns if name.startswith("error")]].to_numpy()
        missed[stretch] = float(np.rad2deg(np.sqrt((errors**2).sum(axis=1).mean())))
    assert missed["measured"] < 0.5 * missed["believed"], missed


# The same rig with force sensors, whose scale is wrong by a factor.
WEIGHED = (
    ("        self._heard = math.inf", "        self._heard, self._pulls = math.inf, np.zeros(3)"),
    (PULLS, PULLS.replace("pulls =", "pulls = self._pulls =")),
    (LOOK, LOOK.replace(", time)", ", time, 1.5 * self._pulls)")),
)


@pytest.mark.slow
def test_measured_tensions_are_logged_held_against_the_model_and_exported(tmp_path: Path) -> None:
    reference = written(tmp_path, *WEIGHED)
    run = wristctl(
        tmp_path, "hw-run", "pid-ff", "--rig", reference, "--set", "directions=[ulnar]", "--horizon", "1.5", "-q"
    )
    assert run.returncode == 0, run.stderr
    sealed = Run(tmp_path / run.stdout.strip().splitlines()[-1])
    log, residuals = (pd.read_csv(sealed.path / f"data/{name}.csv") for name in ("log", "residuals"))
    names = [f"pull_{number}" for number in (1, 2, 3)]
    assert log[names].notna().all(axis=None) and log["pull_1"].iloc[-1] > 1.5 * 3.0
    ratio = residuals["tension_ratio"][residuals["trial"] == 0].dropna()
    assert len(ratio) > 100 and ratio.iloc[-20:].median() == pytest.approx(1.5, rel=0.1)
    done = wristctl(tmp_path, "runs", "export", str(sealed.path), "--file", "log.csv")
    assert done.returncode == 0 and done.stdout.split() == ["log.csv"], done.stderr
    next_command = shlex.split(done.stderr.partition("wristctl ")[2])
    assert next_command == ["identify", "log.csv", "--config", str(sealed.path / "config.yaml")]
    exported = pd.read_csv(tmp_path / "log.csv")
    told = exported[["time [s]", "tension_1 [N]"]].dropna()
    assert np.allclose(exported["mass [kg]"], 0.198), "as the facts say it"
    assert np.allclose(told["tension_1 [N]"], log["pull_1"]) and np.allclose(told["time [s]"], log["captured_ulnar"])
    for page in [*sealed.path.glob("*.md"), sealed.path / "data/limits.json", sealed.path / "run.json"]:
        words = re.findall(r"[^\n]*\b(?:board|markers?|cameras?|pictures?|frames? of)\b[^\n]*", page.read_text())
        assert not words, (page.name, words)


@pytest.mark.parametrize(
    ("rig", "mass", "said"), [("mine.py:MINE", 0.3, False), ("mine.py:MINE", 0.2, True), (None, 0.3, True)]
)
def test_the_default_mass_of_a_hand_is_no_mass_of_a_rig_of_ones_own(rig: str | None, mass: float, said: bool) -> None:
    study = Study(wrist=WristParameters(hand_mass=mass))
    study = study.model_copy(update={"hw_run": study.hw_run.model_copy(update={"rig": rig})})
    assert _mass_is_said(cast(Run, SimpleNamespace(config=study))) is said


# What goes wrong in a trial once the wrist is bent, in the file's own text, and what is said of it.
FAILING: dict[str, tuple[str, str, type[UserError], str]] = {
    "lost": (SENDS, f"{BENT}raise Lost('no port')\n{SENDS}", RigStop, "the rig does not answer: no port"),
    "fault": (SENDS, f"{BENT}raise Fault('heat')\n{SENDS}", RigStop, "the rig has stopped by itself: heat"),
    "bug": (SENDS, f"{BENT}1 / 0\n{SENDS}", RigStop, "send() of the rig failed: ZeroDivisionError"),
    "shape": (SENT, f"{BENT}return sent[:2]\n{SENT}", RigStop, "not 3 numbers"),
    "blind": (
        LOOKS,
        f"{BENT}return Look(np.full(2, math.nan), self.clock.now())\n{LOOKS}",
        SafetyStop,
        "look() gives no number",
    ),
    "stale": (LOOKS, f"{BENT}return Look(np.zeros(2), 0.0)\n{LOOKS}", SafetyStop, "look() brings nothing new"),
    "slow look": (LOOKS, f"{BENT}{WAITS}\n{LOOKS}", SafetyStop, "late: look() takes 60 ms"),
    "slow send": (SENDS, f"{BENT}{WAITS}\n{SENDS}", SafetyStop, "late: send() takes 60 ms"),
    "tendon cut": (
        PULLS,
        f"{BENT}self._reeled = self._reeled - [1.0, 0.0, 0.0]\n{PULLS}",
        SafetyStop,
        "likely the tendon of target 1 is off its pulley, cut or slipped",
    ),
}


@pytest.mark.slow
@pytest.mark.parametrize("what", FAILING)
def test_what_goes_wrong_in_a_trial_stops_the_rig_and_is_said(tmp_path: Path, what: str) -> None:
    before, after, kind, words = FAILING[what]
    imports = ("Limits, Look, Refused", "Limits, Look, Lost, Refused")
    tried = _Tried(tmp_path, (before, after), imports)
    stops: list[float] = []
    stop = tried.rig.stop

    def noted() -> None:
        stops.append(tried.rig.clock.now())
        stop()

    tried.rig.stop = noted
    with pytest.raises(kind, match=re.escape(words)):
        tried.run()
    told = tried.experiment.stop
    assert told is not None and told.trial == 0 and stops and tried.experiment.outcomes[0] == told.reason
    log = pd.read_csv(tried.folder / "log.csv")
    assert 10 < len(log) < 100  # it went on until then, and no further


def test_another_ones_run_does_not_start_its_rig_unasked(tmp_path: Path) -> None:
    run = carrier(tmp_path, "hw-run", {"rig": CARRIED})
    done = wristctl(tmp_path, "hw-run", str(run.path / "config.yaml"))
    assert done.returncode == 2 and "nobody has said that it may run" in done.stderr
    done = wristctl(tmp_path, "check-rig", str(run.path / CARRIED))
    assert done.returncode == 2 and not (tmp_path / MARK).exists()


def _facts(**changes: Any) -> Facts:
    given: dict[str, Any] = {
        "planes": 2,
        "tendons": [Tendon(angle, 0.02) for angle in (0.0, 72.0, 144.0, 216.0, 288.0)],
        "limits": Limits(0.02, 0.1, 50.0),
        "sensor": Sensor(100.0, 0.02, 0.1),
    }
    return Facts(**given | changes)


def test_facts_are_the_settings_that_a_study_does_not_give() -> None:
    facts = _facts(wrist={"stiffness": 1.5}, unit="mm", metres_per_unit=1e-3)
    wrist = wrist_of(facts, WristParameters(length=0.1), "a.py:RIG")
    assert (wrist.stiffness, wrist.length, wrist.tension_limit, len(wrist.tendons)) == (1.5, 0.1, 50.0, 5)
    settings = settings_of(facts, HwRunSettings(), "a.py:RIG")
    assert (settings.planes, settings.push.force, settings.safety.motor_pull) == (2, 0.0, 50.0)
    assert settings.sensor.frame_rate == 100.0 and settings.sensor.delay_frames == pytest.approx(2.0)
    assert settings.actuator.step_rate * settings.actuator.step_length == pytest.approx(0.1)
    with pytest.raises(UserError, match="tendons are not those of the rig"):
        wrist_of(facts, WristParameters(tendons="four"), "a.py:RIG")


@pytest.mark.parametrize(("turned", "wider", "near"), [(2.0, 1.03, True), (-12.0, 0.95, True), (30.0, 1.0, False)])
def test_tendons_where_identification_finds_them_are_the_rigs_and_those_elsewhere_are_not(
    turned: float, wider: float, near: bool
) -> None:
    facts = _facts()
    places = tuple(
        TendonPlace(angle_deg=one.angle_deg + (turned if k == 3 else 0.0), radius=wider * one.radius)
        for k, one in enumerate(facts.tendons)
    )
    study = WristParameters(tendons=places)
    if not near:
        with pytest.raises(UserError, match="tendons are not those of the rig"):
            wrist_of(facts, study, "a.py:RIG")
        return
    here = TendonLayout.of(wrist_of(facts, study, "a.py:RIG"))
    assert here.cross_section == pytest.approx(TendonLayout.of(study).cross_section)
    with pytest.raises(UserError, match="tendons are not those of the rig"):
        wrist_of(facts, WristParameters(tendons=places[:4]), "a.py:RIG")


def test_settings_of_the_board_are_none_of_another_rig(tmp_path: Path) -> None:
    reference = written(tmp_path)
    wrong: dict[str, Any] = {"port": "/dev/ttyACM0", "video": True, "calibration": "RUN"}
    for name, given in wrong.items():
        with pytest.raises(ValidationError, match=f"{name} is of the board"):
            HwRunSettings(rig=reference, **{name: given})


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"planes": 3}, "facts.planes"),
        ({"sensor": Sensor(math.nan)}, "facts.sensor.rate"),
        ({"sensor": Sensor(100.0, Spread(0.02, 0.03, 0.04))}, "low <= value"),
        ({"limits": Limits(0.02, 0.1, 0.0)}, "facts.limits.tension"),
        ({"tendons": [Tendon(0.0, 0.02), Tendon(90.0, 0.02), Tendon(180.0, 0.02)]}, "no tendon pulls"),
        ({"planes": 1}, "in one plane"),
        ({"silence": 0.0}, "facts.silence"),
    ],
)
def test_facts_that_cannot_be_are_named(changes: dict[str, Any], words: str) -> None:
    with pytest.raises(UserError) as error:
        check_facts(_facts(**changes), "a.py:RIG")
    assert words in str(error.value)


@pytest.mark.parametrize(("lever", "alike"), [(0.02001, True), (0.01999, True), (0.0201, False)])
def test_levers_of_one_plane_may_differ_by_less_than_a_thousandth(lever: float, alike: bool) -> None:
    facts = _facts(planes=1, tendons=[Tendon(0.0, 0.02), Tendon(180.0, lever)])
    if alike:
        assert check_facts(facts, "a.py:RIG") is facts
        return
    with pytest.raises(UserError, match="with one lever"):
        check_facts(facts, "a.py:RIG")


class _Still:
    """A rig that answers, and does nothing."""

    facts = _facts()

    def __init__(self) -> None:
        self.clock: Any = WallClock()
        self.answer: Any = np.zeros(5)

    def connect(self) -> Any:
        return self.answer

    def send(self, targets: Any) -> Any:
        return self.answer

    def look(self) -> Any:
        return self.answer

    def stop(self) -> None:
        raise Lost("gone")

    def close(self) -> None:
        pass


@pytest.mark.parametrize("answer", [None, "five", np.zeros(4), [math.nan] * 5, {}])
def test_an_answer_that_is_none_is_named_with_what_it_was(answer: Any) -> None:
    still = _Still()
    still.answer = answer
    guarded = GuardedRig(still, "a.py:RIG")
    for call in (guarded.connect, lambda: guarded.send(np.zeros(5)), guarded.look):
        with pytest.raises(RigStop, match="returns"):
            call()
    assert guarded.stop() == "the rig does not answer: gone"


def test_a_clock_that_goes_back_is_refused() -> None:
    still = _Still()
    still.clock = VirtualClock(lambda begin, end: None)
    guarded = GuardedRig(still, "a.py:RIG")
    still.clock.wait_until(1.0)
    assert guarded.now() == 1.0
    still.clock = VirtualClock(lambda begin, end: None)
    with pytest.raises(RigStop, match="goes back"):
        guarded.now()


def test_of_a_file_rigs_alone_are_proposed(tmp_path: Path) -> None:
    with pytest.raises(UserError) as refused:
        checked(written(tmp_path).replace(":RIG", ":NOPE"))
    assert "has no NOPE" in refused.value.what and "RIG" in str(refused.value.fix)
    assert not any(constant in str(refused.value.fix) for constant in ("RADIUS", "STEP", "DELAY", "TENDON"))


def test_a_class_that_lacks_a_call_is_no_rig() -> None:
    class Half:
        facts = _facts()

    with pytest.raises(UserError, match=r"has no connect, send, look, stop, close, clock.now, clock.wait_until"):
        rig_of(Half, "a.py:RIG")
