"""One step of RODAS3 with the exact Jacobian for arrays of lanes, as wristctl.wrist.integrator."""

from __future__ import annotations

from typing import Any

from dynamics import bias, jacobians, mass_matrix, posture
from equations import Segment


def factorise(a: list[list[Any]]) -> list[list[Any]]:
    """LU factors without pivoting, reciprocals of the pivots on the diagonal."""
    a, n = [list(row) for row in a], len(a)
    for k in range(n):
        a[k][k] = 1.0 / a[k][k]
        for i in range(k + 1, n):
            a[i][k] = a[i][k] * a[k][k]
            for j in range(k + 1, n):
                a[i][j] = a[i][j] - a[i][k] * a[k][j]
    return a


def solve(lu: list[list[Any]], b: list[Any]) -> list[Any]:
    """Solution of a x = b."""
    x, n = list(b), len(b)
    for i in range(n):
        for k in range(i):
            x[i] = x[i] - lu[i][k] * x[k]
    for i in reversed(range(n)):
        for k in range(i + 1, n):
            x[i] = x[i] - lu[i][k] * x[k]
        x[i] = x[i] * lu[i][i]
    return x


def accelerate(s: Segment, theta: list[Any], omega: list[Any], plus: Any, minus: Any) -> list[Any]:
    """theta'' at a state."""
    p = posture(s, theta, plus, minus)
    return [-a for a in solve(factorise(mass_matrix(s, p)), bias(s, theta, omega, p))]


def step(s: Segment, theta: list[Any], omega: list[Any], plus: Any, minus: Any, h: float) -> Any:
    """Angles and rates after h [s]."""
    each, hg = range(len(theta)), 0.5 * h
    p = posture(s, theta, plus, minus)
    mass = mass_matrix(s, p)
    a0 = [-a for a in solve(factorise(mass), bias(s, theta, omega, p))]
    by_theta, by_rate = jacobians(s, omega, a0, p)
    slope = [[hg * by_theta[i][j] for j in each] for i in each]
    lu = factorise([[mass[i][j] / hg + by_rate[i][j] + slope[i][j] for j in each] for i in each])

    def stage(u: list[Any], w: list[Any]) -> Any:
        rate = solve(lu, [sum(mass[i][j] * w[j] - slope[i][j] * u[j] for j in each) for i in each])
        return [hg * (u[i] + rate[i]) for i in each], rate

    k1, l1 = stage(omega, a0)
    k2, l2 = stage([omega[i] + 4.0 / h * k1[i] for i in each], [a0[i] + 4.0 / h * l1[i] for i in each])
    at, rate = [theta[i] + 2.0 * k1[i] for i in each], [omega[i] + 2.0 * l1[i] for i in each]
    a = accelerate(s, at, rate, plus, minus)
    k3, l3 = stage([rate[i] + (k1[i] - k2[i]) / h for i in each], [a[i] + (l1[i] - l2[i]) / h for i in each])
    at, rate = [at[i] + k3[i] for i in each], [rate[i] + l3[i] for i in each]
    a = accelerate(s, at, rate, plus, minus)
    k4, l4 = stage(
        [rate[i] + (k1[i] - k2[i] - 8.0 / 3.0 * k3[i]) / h for i in each],
        [a[i] + (l1[i] - l2[i] - 8.0 / 3.0 * l3[i]) / h for i in each],
    )
    return [at[i] + k4[i] for i in each], [rate[i] + l4[i] for i in each]
