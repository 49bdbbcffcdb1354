"""Units of work: the same numbers wherever, in whatever order and however often they are tried; nothing is lost."""

from __future__ import annotations

import os
import shutil
from pathlib import Path

import numpy as np
import pytest

from tests.work.walks import at, contents, golden, tries, walks
from wristctl.errors import UserError
from wristctl.work import executors
from wristctl.work import worker as units_of_work
from wristctl.work.executors import Workers
from wristctl.work.fan_out import UnitsDone, perform_units
from wristctl.work.worker import Computed, Furnish, Golden, Unit, file_of, read_unit, same_arrays, write_unit


def same(one: UnitsDone, other: UnitsDone) -> bool:
    pairs = zip(one.arrays, other.arrays, strict=True)
    return all(a is not None and b is not None and np.array_equal(a["walk"], b["walk"]) for a, b in pairs)


@pytest.mark.slow
def test_a_worker_furnishes_itself_once_before_its_units() -> None:
    units = [Unit("tests.work.piecework:fetched", {"asked": k}) for k in range(5)]
    left = Furnish("tests.work.piecework:furnish", {"left": 7})
    done = perform_units(units, Workers.of("processes:1"), golden(), furnish=left)
    assert [each["left"].tolist() for each in done.arrays if each] == [[7]] * 5


@pytest.mark.slow
def test_workers_share_the_cores_among_them(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(executors, "cores", lambda: 7)
    with Workers.of("processes:2").open() as pool:
        assert pool.executor.submit(os.getenv, "OMP_NUM_THREADS").result() == "3"


@pytest.mark.slow
def test_serial_processes_and_an_executor_of_ones_own_give_the_same_bytes(tmp_path: Path) -> None:
    folders = {}
    for named in ("serial", "processes:2", "piecework:threads"):
        folders[named] = tmp_path / named.replace(":", "-")
        folders[named].mkdir()
        done = perform_units(walks(), Workers.of(named), golden(), folders[named])
        assert [int(each["at"]) for each in done.arrays if each] == list(range(6)), "the order of the study"
    first, *others = map(contents, folders.values())
    assert len(first) == 6 and all(each == first for each in others)


def test_what_is_there_is_copied_and_not_computed_again_but_for_one_to_check(tmp_path: Path) -> None:
    old, new = tmp_path / "old", tmp_path / "new"
    old.mkdir()
    new.mkdir()
    whole = perform_units(walks(), Workers.of("serial"), folder=old)
    file_of(old, walks()[2].key).unlink()
    computed = []

    def told(unit: Unit, done: Computed | None) -> None:
        computed.append(unit.name if done else "")

    again = perform_units(walks(), Workers.of("serial"), folder=new, earlier=old, report=told)
    assert again.tried_again is not None and len(again.taken_over) == 4 and again.found == 0
    assert {each for each in computed if each} == {"walk 2", again.tried_again.name}
    assert computed.index(again.tried_again.name) < computed.index("walk 2"), "before anything is spent"
    assert same(whole, again) and len(contents(new)) == 6
    assert all(each.stat().st_nlink == 1 for each in new.iterdir()), "no file is two runs'"
    assert {name: contents(new)[name] for name in contents(old)} == contents(old)


@pytest.mark.parametrize("named", ["serial", "processes:2"])
@pytest.mark.slow
def test_a_forged_unit_is_found_where_it_is_drawn_and_nothing_of_its_run_is_kept(
    tmp_path: Path, named: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    old, new = tmp_path / "old", tmp_path / "new"
    old.mkdir()
    new.mkdir()
    units = walks()
    for unit, arrays in zip(units, perform_units(units, Workers.of("serial")).arrays, strict=True):
        assert arrays is not None
        write_unit(old, unit.key, {**arrays, "walk": arrays["walk"] * (0.5 if unit is units[4] else 1.0)})
    monkeypatch.setattr("secrets.choice", lambda numbers: numbers[4])
    with pytest.raises(UserError, match="walk 4 gives other numbers") as caught:
        perform_units(units, Workers.of(named), golden(), new, old)
    assert caught.value.exit_code == 3 and not contents(new)
    monkeypatch.setattr("secrets.choice", lambda numbers: numbers[3])
    done = perform_units(units, Workers.of(named), golden(), new, old)
    assert done.tried_again == units[3] and len(contents(new)) == 6, "what is not drawn is believed"


def test_arrays_that_differ_in_anything_are_not_the_same() -> None:
    one = {"x": np.array([0.0, np.nan])}
    assert same_arrays(one, {"x": np.array([0.0, np.nan])})
    others = [{"x": np.array([-0.0, np.nan])}, {"x": np.array([0.0, np.nan], ">f8")}, {"x": one["x"][:, None]}, {}]
    assert not any(same_arrays(one, other) or same_arrays(other, one) for other in others)


@pytest.mark.parametrize("odd", ["link", "dangling link", "fifo", "folder"])
def test_what_is_no_file_among_the_units_of_a_stopped_run_is_refused_at_once(tmp_path: Path, odd: str) -> None:
    old = tmp_path / "old"
    old.mkdir()
    perform_units(walks(3), Workers.of("serial"), folder=old)
    file = file_of(old, walks()[1].key)
    file.rename(tmp_path / "elsewhere")
    if odd == "fifo":
        os.mkfifo(file)
    elif odd == "folder":
        file.mkdir()
    else:
        file.symlink_to(tmp_path / ("elsewhere" if odd == "link" else "gone"))
    with pytest.raises(UserError) as caught:
        perform_units(walks(3), Workers.of("serial"), earlier=old)
    assert caught.value.exit_code == 3 and caught.value.where == str(file)


@pytest.mark.parametrize("fault", ["cut", "flipped", "renamed"])
def test_a_unit_that_is_not_as_it_was_written_is_computed_again(tmp_path: Path, fault: str) -> None:
    one, other = walks(2)
    perform_units([one, other], Workers.of("serial"), folder=tmp_path)
    file = file_of(tmp_path, one.key)
    content = bytearray(file.read_bytes())
    if fault == "cut":
        file.write_bytes(content[: len(content) // 2])
    elif fault == "flipped":
        content[content.index(np.random.default_rng(0).standard_normal(5).cumsum().tobytes()) + 3] ^= 1
        file.write_bytes(content)
    else:
        shutil.copyfile(file_of(tmp_path, other.key), file)
    assert read_unit(tmp_path, one.key) is None
    again = perform_units([one, other], Workers.of("serial"), folder=tmp_path)
    assert again.found == 1 and again.arrays[0] is not None and int(again.arrays[0]["at"]) == 0


def test_the_key_goes_by_what_is_computed_from_what_and_by_which_code(monkeypatch: pytest.MonkeyPatch) -> None:
    known = Unit("a:b", {"x": 1.0, "y": [1, 2]}, "one")
    assert known.key == Unit("a:b", {"y": [1, 2], "x": 1.0}, "another name").key
    others = [Unit("a:c", {"x": 1.0, "y": [1, 2]}), Unit("a:b", {"x": 1.0 + 1e-16 * 4, "y": [1, 2]})]
    assert len({known.key, *(each.key for each in others)}) == 3
    monkeypatch.setattr(units_of_work, "code_digest", lambda: "another code")
    assert Unit("a:b", {"x": 1.0, "y": [1, 2]}).key != known.key


@pytest.mark.parametrize("named", ["serial", "processes:2"])
@pytest.mark.slow
def test_a_unit_that_fails_is_tried_three_times_and_named_and_the_others_go_on(tmp_path: Path, named: str) -> None:
    units = walks()
    units.insert(2, at(tmp_path, "fail"))
    done = perform_units(units, Workers.of(named), golden())
    assert tries(tmp_path, "fail") == 3
    (poisoned,) = done.poisoned
    assert poisoned.unit.name == "the fail" and "no walk from 99" in poisoned.why and "on " in poisoned.why
    assert [k for k, each in enumerate(done.arrays) if each is None] == [2]


@pytest.mark.slow
def test_a_unit_that_fails_once_is_as_if_it_had_not(tmp_path: Path) -> None:
    done = perform_units([at(tmp_path, "fail_once", 4)], Workers.of("processes:1"), golden())
    walked = perform_units([Unit("piecework:walk", {"seed": 4, "steps": 5})], Workers.of("serial"))
    assert not done.poisoned and same(done, walked)


@pytest.mark.slow
def test_a_unit_that_kills_its_worker_is_named_and_takes_no_other_with_it(tmp_path: Path) -> None:
    units = walks(6, takes=0.05)
    units.insert(1, at(tmp_path, "die"))
    done = perform_units(units, Workers.of("processes:2"), golden(), tmp_path)
    assert [each.unit.name for each in done.poisoned] == ["the die"] and "died" in done.poisoned[0].why
    assert sum(each is not None for each in done.arrays) == 6
    assert 3 <= tries(tmp_path, "die") <= 4, "once beside others, then alone"


@pytest.mark.slow
def test_a_worker_whose_golden_numbers_differ_computes_nothing(tmp_path: Path) -> None:
    with pytest.raises(
        UserError, match=r"computes other numbers: its golden rollout is .* - fix: workers of"
    ) as raised:
        perform_units(walks(), Workers.of("processes:1"), golden("process"), tmp_path)
    assert raised.value.exit_code == 3 and not contents(tmp_path)


@pytest.mark.parametrize("part, told", [("version", "runs wristctl"), ("code", "of the same number and other files")])
@pytest.mark.slow
def test_a_worker_of_another_version_or_other_files_computes_nothing(part: str, told: str) -> None:
    other = Golden(**{**golden()._asdict(), part: "another"})
    with pytest.raises(UserError, match=told) as raised:
        perform_units(walks(2), Workers.of("processes:1"), other)
    assert raised.value.exit_code == 3


@pytest.mark.parametrize(
    "named, told",
    [
        ("threads", "unknown executor 'threads'"),
        ("processes:0", "0 processes"),
        ("nowhere:factory", "no executor at nowhere:factory"),
        ("piecework:nothing", "no executor at piecework:nothing"),
        ("piecework:no_executor", "gives str, and no concurrent.futures.Executor"),
    ],
)
def test_an_executor_that_cannot_be_is_named(named: str, told: str) -> None:
    with pytest.raises(UserError, match=told) as raised:
        perform_units(walks(1), Workers.of(named))
    assert raised.value.exit_code == 2
