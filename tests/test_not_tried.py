"""A suite that is green says what it has not tried, and pytest's own closing line stays the last."""

from __future__ import annotations

from pathlib import Path

import pytest

pytest_plugins = ["pytester"]
SKIPPED = """
import pytest

@pytest.mark.parametrize("reason", ["simavr's board is not built", "needs simavr's board", "runs alone: make test-rig",
                                    "takes minutes: WRISTCTL_THOROUGH=1", "a reason of its own"])
def test_without(reason):
    pytest.skip(reason)

def test_whole():
    pass
"""


def test_skipped_tests_are_counted_by_what_they_lack(pytester: pytest.Pytester) -> None:
    pytester.makeconftest((Path(__file__).parent / "conftest.py").read_text(encoding="utf-8"))
    pytester.makepyfile(SKIPPED)
    *_, counted, closing = pytester.runpytest_inprocess("-p", "no:cacheprovider").outlines
    assert counted.startswith("not tried: 2 simavr; ") and "1 passed, 5 skipped" in closing
    assert {"1 WRISTCTL_THOROUGH", "1 a reason of its own"} < set(counted.removeprefix("not tried: ").split("; "))
