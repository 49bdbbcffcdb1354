"""The count of what is said of laws on posteriors against what is true of them."""

from __future__ import annotations

from tests.identification.posterior_rigs import Judged, table


def test_rigs_are_counted_by_what_was_said_of_them() -> None:
    said = [Judged("pid-ff", p, best, share) for p, best, share in
            ((0.85, True, 0.9), (0.89, False, 0.4), (1.0, True, 1.0), (0.45, True, 0.5))]  # fmt: skip
    lines = [line.split() for line in table(said)[1:]]
    assert [line[0] for line in lines] == ["0.4", "0.8", "0.9"] and [line[3] for line in lines] == ["1", "2", "1"]
    assert lines[1][4:] == ["0.87", "0.50", "0.65"] and lines[2][4:] == ["1.00", "1.00", "1.00"]
