"""The committed list of wrong changes fits the code as it stands: `make mutants` tries each."""

from __future__ import annotations

from pathlib import Path

from tests.mutants.run import ROOT, changed, known

MUTANTS = known()


def test_each_change_is_another_program_that_python_reads_and_its_tests_are_there() -> None:
    for mutant in MUTANTS:
        text = changed(mutant)
        assert text != (ROOT / "wristctl" / mutant.file).read_text(encoding="utf-8"), mutant.name
        compile(text, f"{mutant.file} ({mutant.name})", "exec")
        assert mutant.tests or mutant.equivalent, mutant.name
        assert all(Path(ROOT, each.partition("::")[0]).exists() for each in mutant.tests), mutant.name


def test_no_change_stands_there_twice_and_few_are_equivalent() -> None:
    assert len({each.name for each in MUTANTS}) == len(MUTANTS) >= 71
    assert sum(bool(each.equivalent) for each in MUTANTS) <= 0.2 * len(MUTANTS)
