"""Linear equations of lanes. The matrices are those of damped masses and springs: no pivoting is needed."""

from typing import Any

from wristctl.lanes.compiled import compiled


@compiled
def factorise(a: Any) -> None:
    """LU factors of a square matrix, in place; the diagonal holds the pivots' reciprocals."""
    n = len(a)
    for k in range(n):
        a[k, k] = 1.0 / a[k, k]
        for i in range(k + 1, n):
            a[i, k] = a[i, k] * a[k, k]
            for j in range(k + 1, n):
                a[i, j] = a[i, j] - a[i, k] * a[k, j]


@compiled
def solve(lu: Any, b: Any) -> None:
    """Overwrite b with the solution of a x = b."""
    n = len(b)
    for i in range(1, n):
        for k in range(i):
            b[i] = b[i] - lu[i, k] * b[k]
    for i in range(n - 1, -1, -1):
        for k in range(i + 1, n):
            b[i] = b[i] - lu[i, k] * b[k]
        b[i] = b[i] * lu[i, i]
