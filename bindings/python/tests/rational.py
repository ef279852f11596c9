"""Linear complementarity problems in rational arithmetic."""

import itertools
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


def null_space(A, n):
    """A basis of {x : A x = 0} of n unknowns."""
    rows, pivots = [list(map(Fraction, row)) for row in A], []
    for j in range(n):
        k = len(pivots)
        i = next((i for i in range(k, len(rows)) if rows[i][j] != 0), None)
        if i is None:
            continue
        rows[k], rows[i] = rows[i], rows[k]
        rows[k] = [x / rows[k][j] for x in rows[k]]
        for i in range(len(rows)):
            if i != k and rows[i][j] != 0:
                rows[i] = [x - rows[i][j] * y for x, y in zip(rows[i], rows[k])]
        pivots.append(j)
    basis = []
    for j in range(n):
        if j not in pivots:
            x = [Fraction(0)] * n
            x[j] = Fraction(1)
            for k, p in enumerate(pivots):
                x[p] = -rows[k][j]
            basis.append(x)
    return basis


def faces(M, q, lower, upper):
    """The maximal polyhedra of solutions with one index set each, as pairs of frozensets:
    vertices, and rays with largest entry 1. Bounds may be infinite, but not both of a variable.
    By brute force: n <= 4 or so."""
    n = len(q)
    # x = (z, s), s = 1 for a vertex and 0 for a ray; all rows are linear in x
    slack = [list(row) + [y] for row, y in zip(M, q)]
    below = [
        [int(i == j) for j in range(n)] + [-Fraction(lower[i])] if lower[i] > -np.inf else None
        for i in range(n)
    ]
    above = [
        [-int(i == j) for j in range(n)] + [Fraction(upper[i])] if upper[i] < np.inf else None
        for i in range(n)
    ]
    found = []
    for places in itertools.product("blu", repeat=n):
        equations, others = [], [[0] * n + [1]]
        for i, place in enumerate(places):
            equations.append({"b": slack, "l": below, "u": above}[place][i])
            if place == "b":
                others += [row for row in (below[i], above[i]) if row]
            elif lower[i] < upper[i]:
                others.append(slack[i] if place == "l" else [-x for x in slack[i]])
        if None in equations:
            continue
        points = set()
        for count in range(n + 1):
            for tight in itertools.combinations(others, count):
                basis = null_space(equations + list(tight), n + 1)
                if len(basis) != 1:
                    continue
                for sign in (1, -1):
                    x = [sign * t for t in basis[0]]
                    if all(sum(a * b for a, b in zip(row, x)) >= 0 for row in others):
                        size = x[n] if x[n] > 0 else max(map(abs, x))
                        points.add(tuple(t / size for t in x))
        if any(x[n] > 0 for x in points):
            found.append((equations, points))

    def holds(outer, inner):
        return all(sum(a * b for a, b in zip(row, x)) == 0 for row in outer[0] for x in inner[1])

    kept = []
    for face in found:
        if any(holds(other, face) for other in kept):
            continue
        kept = [other for other in kept if not holds(face, other)] + [face]
    return [
        (
            frozenset(x[:n] for x in points if x[n] > 0),
            frozenset(x[:n] for x in points if x[n] == 0),
        )
        for _, points in kept
    ]
