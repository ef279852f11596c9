"""Writes the problems in examples/data: an obstacle problem and an American put option.

    python make_data.py [FOLDER]    writes the .mtx files (default: data, beside this script)
    python make_data.py --check     also says how far the discrete solutions are from the exact ones

Needs NumPy only. Nothing is random: running it again changes no file (a C library with another
logarithm may change the last digit of obstacle_q.mtx).
"""

import math
import os
import sys

import numpy as np

# Radius where a membrane leaves the unit hemisphere if it is held at 0 on the circle of radius 2:
# a^2 (1 - ln(a/2)) = 1, from a continuous slope at r = a.
CONTACT_RADIUS = 0.69796514822337357


def write(path, comments, rows, columns, lines, symmetry=None):
    """One Matrix Market file: coordinate if a symmetry is given, else an array."""
    with open(path, "w", encoding="ascii", newline="\n") as file:
        kind = f"coordinate real {symmetry}" if symmetry else "array real general"
        file.write(f"%%MatrixMarket matrix {kind}\n")
        file.writelines(f"% {comment}\n" for comment in comments)
        file.write(f"{rows} {columns}" + (f" {len(lines)}" if symmetry else "") + "\n")
        file.writelines(line + "\n" for line in lines)


def number(value):
    """The shortest decimal that reads back as the same double."""
    text = repr(float(value))
    return text[:-2] if text.endswith(".0") else text


def membrane(x, y):
    """Height of the membrane: the hemisphere up to the contact radius, harmonic from there on."""
    r = math.sqrt(x * x + y * y)
    a = CONTACT_RADIUS
    if r <= a:
        return math.sqrt(1.0 - r * r)
    return -a * a / math.sqrt(1.0 - a * a) * math.log(r / 2.0)


def obstacle(n=64):
    """The five-point Laplacian (times h^2) on an n by n grid inside of [-2,2]^2: the entries of the
    lower triangle of M, q (from the boundary values), the obstacle, and the exact heights."""
    h = 4.0 / (n + 1)
    at = [-2.0 + h * (k + 1) for k in range(n)]
    entries, q, lower, exact = [], [], [], []
    for j in range(n):
        for i in range(n):
            row = i + n * j
            entries.append((row, row, 4.0))
            if i + 1 < n:
                entries.append((row + 1, row, -1.0))
            if j + 1 < n:
                entries.append((row + n, row, -1.0))
            neighbours = ((i - 1, j), (i + 1, j), (i, j - 1), (i, j + 1))
            outside = [(k, m) for k, m in neighbours if not (0 <= k < n and 0 <= m < n)]
            q.append(-sum(membrane(-2.0 + h * (k + 1), -2.0 + h * (m + 1)) for k, m in outside))
            r2 = at[i] ** 2 + at[j] ** 2
            lower.append(math.sqrt(1.0 - r2) if r2 < 1.0 else -math.inf)
            exact.append(membrane(at[i], at[j]))
    return entries, np.array(q), np.array(lower), np.array(exact)


def tridiagonal_solve(below, diagonal, above, b):
    """Gaussian elimination without exchanges (Thomas)."""
    n = len(b)
    d, x = list(diagonal), list(b)
    for i in range(1, n):
        factor = below[i] / d[i - 1]
        d[i] -= factor * above[i - 1]
        x[i] -= factor * x[i - 1]
    x[n - 1] /= d[n - 1]
    for i in range(n - 2, -1, -1):
        x[i] = (x[i] - above[i] * x[i + 1]) / d[i]
    return x


def tridiagonal_lcp(below, diagonal, above, q, lower):
    """z >= lower, M z + q >= 0, by policy iteration; M is a tridiagonal M-matrix."""
    n = len(q)
    active = [False] * n
    while True:
        z = tridiagonal_solve(
            [0.0 if on else b for on, b in zip(active, below)],
            [1.0 if on else d for on, d in zip(active, diagonal)],
            [0.0 if on else a for on, a in zip(active, above)],
            [low if on else -c for on, low, c in zip(active, lower, q)],
        )
        w = [
            diagonal[i] * z[i]
            + (below[i] * z[i - 1] if i > 0 else 0.0)
            + (above[i] * z[i + 1] if i + 1 < n else 0.0)
            + q[i]
            for i in range(n)
        ]
        now = [z[i] - lower[i] < (w[i] if active[i] else 0.0) for i in range(n)]
        if now == active:
            return z
        active = now


PUT = dict(strike=100.0, rate=0.05, volatility=0.2, expiry=1.0, highest=400.0, cells=1000, steps=100)


def american_put(strike, rate, volatility, expiry, highest, cells, steps):
    """The last time step, the one that ends today: M (three diagonals), q and the payoff.

    Black-Scholes on equally spaced share prices with central differences; four implicit Euler
    steps, then Crank-Nicolson. The value is the strike at price 0 and 0 at the highest price."""
    dt = expiry / steps
    index = range(1, cells)
    price = [highest * i / cells for i in index]
    payoff = [max(strike - s, 0.0) for s in price]
    down = [0.5 * dt * (rate * i - volatility**2 * i * i) for i in index]
    middle = [dt * (volatility**2 * i * i + rate) for i in index]
    up = [-0.5 * dt * (rate * i + volatility**2 * i * i) for i in index]
    n = cells - 1
    value = payoff
    for step in range(steps):
        theta = 1.0 if step < 4 else 0.5
        matrix = (
            [theta * a for a in down],
            [1.0 + theta * b for b in middle],
            [theta * c for c in up],
        )
        q = []
        for i in range(n):
            left = value[i - 1] if i > 0 else strike
            right = value[i + 1] if i + 1 < n else 0.0
            old = (1.0 - theta) * (down[i] * left + middle[i] * value[i] + up[i] * right)
            q.append(old - value[i] + (theta * down[i] * strike if i == 0 else 0.0))
        value = tridiagonal_lcp(*matrix, q, payoff)
    return matrix, q, payoff, price, value


def binomial_put(strike, rate, volatility, expiry, spot, steps):
    """Cox, Ross & Rubinstein (1979): an independent value of the same option."""
    dt = expiry / steps
    u = math.exp(volatility * math.sqrt(dt))
    p = (math.exp(rate * dt) - 1.0 / u) / (u - 1.0 / u)
    prices = spot * u ** np.arange(-steps, steps + 1, 2.0)
    value = np.maximum(strike - prices, 0.0)
    for _ in range(steps):
        prices = prices[:-1] * u
        value = math.exp(-rate * dt) * (p * value[1:] + (1.0 - p) * value[:-1])
        value = np.maximum(value, strike - prices)
    return float(value[0])


def main(words):
    check = "--check" in words
    folders = [word for word in words if not word.startswith("--")]
    folder = folders[0] if folders else os.path.join(os.path.dirname(__file__), "data")
    os.makedirs(folder, exist_ok=True)

    entries, q, lower, exact = obstacle()
    n = len(q)
    about = ["Membrane over a hemisphere on [-2,2]^2, 64 by 64 grid points; see README.md"]
    lines = [f"{i + 1} {j + 1} {number(v)}" for i, j, v in entries]
    write(os.path.join(folder, "obstacle_M.mtx"), about, n, n, lines, "symmetric")
    lines = [f"{i + 1} 1 {number(v)}" for i, v in enumerate(q) if v != 0]
    write(os.path.join(folder, "obstacle_q.mtx"), about, n, 1, lines, "general")
    lines = [number(v) for v in lower]
    write(os.path.join(folder, "obstacle_lower.mtx"), about, n, 1, lines)

    (below, diagonal, above), q, payoff, price, value = american_put(**PUT)
    n = len(q)
    about = ["American put, Black-Scholes, the time step that ends today; see README.md"]
    lines = []
    for j in range(n):
        if j > 0:
            lines.append(f"{j} {j + 1} {number(above[j - 1])}")
        lines.append(f"{j + 1} {j + 1} {number(diagonal[j])}")
        if j + 1 < n:
            lines.append(f"{j + 2} {j + 1} {number(below[j + 1])}")
    write(os.path.join(folder, "put_M.mtx"), about, n, n, lines, "general")
    write(os.path.join(folder, "put_q.mtx"), about, n, 1, [number(v) for v in q])
    write(os.path.join(folder, "put_payoff.mtx"), about, n, 1, [number(v) for v in payoff])

    if check:
        tree = binomial_put(100.0, 0.05, 0.2, 1.0, 100.0, 4000)
        today = value[price.index(100.0)]
        print(f"put at 100: {today:.6f}, binomial tree {tree:.6f}")
        gap = exact - lower
        print(f"obstacle: exact heights clear the obstacle by {gap.min():.1e} at the least")


if __name__ == "__main__":
    main(sys.argv[1:])
