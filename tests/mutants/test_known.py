"""The committed list of wrong changes fits the code as it stands: `make mutants` tries each."""

from __future__ import annotations

from pathlib import Path

import pytest

from tests.mutants.run import ROOT, Mutant, changed, known

MUTANTS = known()


@pytest.mark.parametrize("mutant", MUTANTS, ids=[each.name for each in MUTANTS])
def test_each_change_is_another_program_that_python_reads_and_its_tests_are_there(mutant: Mutant) -> None:
    text = changed(mutant)
    assert text != (ROOT / "wristctl" / mutant.file).read_text(encoding="utf-8")
    compile(text, mutant.file, "exec")
    assert mutant.tests or mutant.equivalent
    assert all(Path(ROOT, each.partition("::")[0]).exists() for each in mutant.tests)


def test_no_change_stands_there_twice_and_few_are_equivalent() -> None:
    assert len({each.name for each in MUTANTS}) == len(MUTANTS) >= 71
    assert sum(bool(each.equivalent) for each in MUTANTS) <= 8
