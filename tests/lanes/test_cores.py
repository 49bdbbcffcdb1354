"""How many cores a process may use."""

from __future__ import annotations

import pytest

from wristctl.processes import cores


@pytest.mark.parametrize("said, given", [("1", 1), ("1,2", 1), ("100000", None), ("", None), ("many", None), ("0", 1)])
def test_a_process_that_shares_a_machine_uses_what_it_is_told(
    monkeypatch: pytest.MonkeyPatch, said: str, given: int | None
) -> None:
    monkeypatch.delenv("OMP_NUM_THREADS", raising=False)
    every = cores()
    monkeypatch.setenv("OMP_NUM_THREADS", said)
    assert cores() == (every if given is None else given) and every >= 1
