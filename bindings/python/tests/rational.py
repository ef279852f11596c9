"""Linear complementarity problems in rational arithmetic."""

from fractions import Fraction

import numpy as np


def solve(A, b):
    """Solves A x = b by elimination; None if A is singular."""
    n = len(b)
    rows = [[Fraction(x) for x in row] + [Fraction(y)] for row, y in zip(A, b)]
    for k in range(n):
        pivot = next((i for i in range(k, n) if rows[i][k] != 0), None)
        if pivot is None:
            return None
        rows[k], rows[pivot] = rows[pivot], rows[k]
        for i in range(n):
            factor = rows[i][k] / rows[k][k]
            if i != k and factor != 0:
                rows[i] = [x - factor * y for x, y in zip(rows[i], rows[k])]
    return [rows[k][n] / rows[k][k] for k in range(n)]


def basic_solution(M, q, lower, upper, places):
    """The solution whose variables are at "l", at "u" or "b" (between); None if there is none."""
    n = len(q)
    M = [[Fraction(x) for x in row] for row in M]
    active = [i for i in range(n) if places[i] == "b"]
    z = [Fraction({"l": lower, "u": upper}[p][i]) if p != "b" else Fraction(0)
         for i, p in enumerate(places)]
    w = [sum(a * x for a, x in zip(row, z)) + Fraction(y) for row, y in zip(M, q)]
    x = solve([[M[i][j] for j in active] for i in active], [-w[i] for i in active])
    if x is None:
        return None
    for i, value in zip(active, x):
        z[i] = value
    for i in range(n):
        w = sum(a * x for a, x in zip(M[i], z)) + Fraction(q[i])
        if lower[i] == upper[i]:
            continue
        if places[i] == "l" and w < 0 or places[i] == "u" and w > 0:
            return None
        if not (lower[i] == -np.inf or z[i] >= Fraction(lower[i])):
            return None
        if not (upper[i] == np.inf or z[i] <= Fraction(upper[i])):
            return None
    return z
