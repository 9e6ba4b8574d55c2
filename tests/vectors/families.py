"""Makes evaluate.json, subdivide.json, to_bspline.json, interpolate.json, fit.json, surface.json:
what one segment of any family, the interpolating spline, a fit and a surface must give.
"""

import random
from fractions import Fraction as F

from exact import (
    applied,
    bezier_jet,
    bezier_of,
    de_casteljau,
    difference,
    dot,
    dyadic_matrix,
    dyadic_row,
    eliminated,
    exact,
    halves,
    length_of,
    matrix_of,
    mirrored,
    polygon,
    root,
    rounded,
    solved,
)


# ---- random bases


def random_beta(rng, most):
    """Small more often than large."""
    return rng.uniform(0, 1) * rng.uniform(0, most)


def symmetric(rng, order, degree):
    """Rows as in Chen 2013 Propositions 1-7, with row 1 as in eq. (29); drawn until independent."""
    parts = 2 ** 20
    while True:
        first = rng.randint(parts // 16, parts - parts // 16) / parts
        rows = [[first, 1 - first] + [0.0] * (order - 1)]
        for i in range(2, degree // 2 + 1):
            row = dyadic_row(rng, order + 1, parts)
            if 2 * i == degree:
                row = [(a + b) / 2 for a, b in zip(row, row[::-1])]
            rows.append(row)
        if eliminated(mirrored(degree, rows), order + 1):
            shape = {"kind": "symmetric", "degree": degree, "upper_rows": rows}
            return {"family": "quasi-bezier", "shape": shape}


def recursive(rng):
    """The seed of Wu 2006 (Chen 2013 Table 1), m_10 = (1 - l) / 3."""
    first = rng.randint(2 ** 16, 2 ** 20 - 2 ** 16) / 2 ** 20
    second = 1 - first
    seed = [[1.0, 0.0, 0.0], [first, second, 0.0], [0.0, second, first], [0.0, 0.0, 1.0]]
    return {"family": "quasi-bezier", "shape": {"kind": "recursive", "seed": seed}}


def elevation(rng, order):
    """The numbers of Yang and Zeng 2009 (Chen 2013 Table 1), each inside its range."""
    share = lambda: rng.randint(1, 15) / 16
    lambdas = [i - share() * (order + 1) for i in range(1, order + 1)]
    return {"family": "quasi-bezier", "shape": {"kind": "elevation", "lambdas": lambdas}}


def matrix(rng, order, degree):
    """Any rows between unit rows; drawn until independent."""
    while True:
        rows = dyadic_matrix(rng, order, degree)
        if eliminated(exact(rows), order + 1):
            return {"family": "quasi-bezier", "shape": {"kind": "matrix", "rows": rows}}


def beta_bases(rng, most=20.0):
    betas = [0.0, random_beta(rng, 1.0), 1.0, random_beta(rng, most), 1000.0, 1e-7]
    return [{"family": "beta-bezier", "beta": beta} for beta in betas]


def alpha_beta_bases(rng):
    pairs = [(1.0, 3.0), (0.2, 1.0), (0.5, 2.0), (rng.uniform(0.1, 1), rng.uniform(0.1, 3))]
    return [{"family": "alpha-beta-bezier", "alpha": alpha, "beta": beta} for alpha, beta in pairs]


def cubic_bases(rng):
    inverses = [{"family": "beta-bezier", "lambda": inverse} for inverse in [0.0, 0.5, 4.0]]
    return inverses + alpha_beta_bases(rng)


SYMMETRIC = [(2, 3), (2, 4), (3, 3), (3, 4), (3, 5), (4, 6), (3, 7), (5, 9)]


def quasi_bases(rng):
    """With the order of the control polygon."""
    return [(order, symmetric(rng, order, degree)) for order, degree in SYMMETRIC] + [
        (2, recursive(rng)),
        (3, recursive(rng)),
        (5, recursive(rng)),
        (3, elevation(rng, 3)),
        (6, elevation(rng, 6)),
        (4, matrix(rng, 4, 4)),
        (5, matrix(rng, 5, 7)),
    ]


def far_or_extreme(rng):
    """Curves near the ends of the range of doubles, and one far from the origin."""
    places = [(3, 1e-150, (0.0, 0.0, 0.0)), (3, 1e149, (0.0, 0.0, 0.0)), (2, 1.0, (1e9, 1e9))]
    for dimension, size, place in places:
        points = polygon(rng, 4, dimension, size, place)
        yield {"family": "beta-bezier", "beta": 1.5, "control_points": points}


def curves(rng):
    for dimension in (2, 3):
        for order in [1, 2, 3, 4, 5, 7, 10]:
            for basis in [{"family": "bezier"}] + beta_bases(rng):
                yield dict(basis, control_points=polygon(rng, order + 1, dimension))
        for order, basis in [(3, basis) for basis in cubic_bases(rng)] + quasi_bases(rng):
            yield dict(basis, control_points=polygon(rng, order + 1, dimension))
    yield from far_or_extreme(rng)


def bezier(curve):
    return bezier_of(curve, exact(curve["control_points"]))


# ---- one segment


def evaluate_cases():
    rng = random.Random(1962)
    cases = []
    for curve in curves(rng):
        length, points = length_of(curve), bezier(curve)
        parameters = [0.0, length, length / 2, 1e-9 * length]
        parameters += [length * rng.random() for _ in range(2)]
        jet = lambda t: rounded(bezier_jet(points, F(t) / F(length), F(length), 3))
        cases.append({
            "curve": curve,
            "parameters": parameters,
            "domain": [0.0, length],
            "derivatives": 3,
            "expected": [jet(t) for t in parameters],
        })
    return cases


def subdivide_cases():
    rng = random.Random(1959)
    cases = []
    for curve in curves(rng):
        at = length_of(curve) * rng.uniform(0.05, 0.95)
        left, right = halves(bezier(curve), F(at) / F(length_of(curve)))
        cases.append({"curve": curve, "at": at, "bezier": rounded(left + right[1:])})
    return cases


def to_bspline_cases():
    """Cheng et al. 2021 eq. (26): a cubic on the knots -3, -2, ..., 4."""
    rng = random.Random(1972)
    to_uniform = [[6, -7, 2, 0], [0, 2, -1, 0], [0, -1, 2, 0], [0, 2, -7, 6]]
    cubics = []
    for dimension in (2, 3):
        for basis in [{"family": "bezier"}] + beta_bases(rng) + cubic_bases(rng):
            cubics.append(dict(basis, control_points=polygon(rng, 4, dimension)))
    cases = []
    for curve in cubics + list(far_or_extreme(rng)):
        points = bezier(curve)
        cases.append({
            "curve": curve,
            "uniform_control_points": rounded(applied(to_uniform, points)),
            "bezier": rounded(points),
        })
    return cases


# ---- the interpolating spline


def knots_of(points, rule):
    """From 0. Roots of distances have 60 digits, of which the equations keep the first 40."""
    distances = [root(dot(d, d)) for d in (difference(a, b, 1) for a, b in zip(points, points[1:]))]
    gaps = {
        "uniform": lambda: [F(1) for _ in distances],
        "chord-length": lambda: [F(round(d, 40)) for d in distances],
        "centripetal": lambda: [F(round(d.sqrt(), 40)) for d in distances],
    }[rule]()
    knots = [F(0)]
    for gap in gaps:
        knots.append(knots[-1] + gap)
    return knots


def spline_velocities(points, knots, start, end):
    """The derivatives at the points of the C2 cubic spline; closed without end conditions.

    With h the lengths of the intervals and d the slopes of the chords, the second derivative is
    continuous at a point where h1 v0 + 2 (h0 + h1) v1 + h0 v2 = 3 (h1 d0 + h0 d1).
    """
    h = [b - a for a, b in zip(knots, knots[1:])]
    d = [difference(a, b, 1 / step) for a, b, step in zip(points, points[1:], h)]
    closed, segments = start is None, len(h)
    count = segments if closed else segments + 1
    rows, right = [], []

    def add(entries, point):
        row = [F(0)] * count
        for column, value in entries:
            row[column % count] += value
        rows.append(row)
        right.append(point)

    def at_end(condition, first, second, at, toward):
        """The equation at an end, whose segment is the first and the next one the second."""
        if condition["kind"] == "derivative":
            add([(at, 1)], [F(x) for x in condition["vector"]])
        elif condition["kind"] == "natural":
            add([(at, 2), (at + toward, 1)], [3 * x for x in d[first]])
        else:
            # One cubic over both segments: equal third derivatives at the joint between them.
            a, b = 1 / h[first] ** 2, 1 / h[second] ** 2
            entries = [(at, a), (at + toward, a - b), (at + 2 * toward, -b)]
            add(entries, [2 * (a * x - b * y) for x, y in zip(d[first], d[second])])

    if not closed:
        at_end(start, 0, 1, 0, 1)
    for i in range(0 if closed else 1, segments):
        low, high = h[i - 1], h[i]
        add(
            [(i - 1, high), (i, 2 * (low + high)), (i + 1, low)],
            [3 * (high * x + low * y) for x, y in zip(d[i - 1], d[i])],
        )
    if not closed:
        at_end(end, -1, -2, segments, -1)
    velocities = solved(rows, right)
    return velocities + velocities[:1] if closed else velocities


def beta_points(points, beta):
    """Back from the Bezier points of a cubic: the inverse of Cheng et al. 2021 eq. (8) and (9)."""
    b, c = F(beta), F(beta) ** 2 / 3
    near, far = (1 + b) ** 2, -b * (1 + b)
    rows = [[1, 0, 0, 0], [-b - c, near, far, c], [c, far, near, -b - c], [0, 0, 0, 1]]
    return applied(rows, points)


def interpolated(points, rule, start, end, betas):
    """The knots, and each segment as Bezier and as Beta-Bezier points."""
    points = exact(points)
    points = points + points[:1] if start is None else points
    knots = knots_of(points, rule)
    velocities = spline_velocities(points, knots, start, end)
    segments = []
    for i in range(len(knots) - 1):
        third = (knots[i + 1] - knots[i]) / 3
        (p, q), (v, w) = points[i:i + 2], velocities[i:i + 2]
        inner = [x + third * y for x, y in zip(p, v)], [x - third * y for x, y in zip(q, w)]
        segments.append([p, *inner, q])
    return {
        "knots": [float(t) for t in knots],
        "betas": betas,
        "bezier_segments": [rounded(segment) for segment in segments],
        "beta_segments": [rounded(beta_points(*pair)) for pair in zip(segments, betas)],
    }


def interpolate_cases():
    rng = random.Random(1946)
    cases = []

    def add(dimension, count, rule, start=None, end=None):
        points = polygon(rng, count, dimension)
        segments = count if start is None else count - 1
        betas = [rng.choice([0.0, 1.0, random_beta(rng, 4.0)]) for _ in range(segments)]
        cases.append({
            "points": points,
            "closed": start is None,
            "parameterization": rule,
            "start": start,
            "end": end,
            **interpolated(points, rule, start, end, betas),
        })

    rules = ["uniform", "chord-length", "centripetal"]
    natural, not_a_knot = {"kind": "natural"}, {"kind": "not-a-knot"}
    for closed in (True, False):
        for dimension in (2, 3):
            for count in [3, 4, 5, 9, 17]:
                for rule in rules:
                    if closed:
                        add(dimension, count, rule)
                        continue
                    add(dimension, count, rule, natural, natural)
                    vector = [rng.uniform(-1, 1) for _ in range(dimension)]
                    add(dimension, count, rule, {"kind": "derivative", "vector": vector}, natural)
                    if count > 3:
                        add(dimension, count, rule, not_a_knot, not_a_knot)
    return cases


# ---- least squares


def bernstein(degree, u):
    units = [[F(i == j) for j in range(degree + 1)] for i in range(degree + 1)]
    return de_casteljau(units, u)[-1][0]


def fitted(points, parameters, basis, order, ends):
    """The control points with the least sum of squares, and the largest and the quadratic mean
    distance: the normal equations, exactly."""
    data = exact(points)
    shape, length = matrix_of(basis, order), F(length_of(basis))
    rows = [bernstein(len(shape) - 1, F(t) / length) for t in parameters]
    rows = [[sum(b * m[j] for b, m in zip(row, shape)) for j in range(order + 1)] for row in rows]
    known = {0: data[0], order: data[-1]} if ends == "interpolate" else {}
    free = [j for j in range(order + 1) if j not in known]
    dimension = range(len(data[0]))
    left = [
        [p[k] - sum(row[j] * q[k] for j, q in known.items()) for k in dimension]
        for row, p in zip(rows, data)
    ]
    normal = [[sum(row[i] * row[j] for row in rows) for j in free] for i in free]
    right = [[sum(row[i] * p[k] for row, p in zip(rows, left)) for k in dimension] for i in free]
    found = {**known, **dict(zip(free, solved(normal, right)))}
    control_points = [found[j] for j in range(order + 1)]
    offsets = [difference(p, q, 1) for p, q in zip(data, applied(rows, control_points))]
    squares = [dot(offset, offset) for offset in offsets]
    return {
        "control_points": rounded(control_points),
        "max_error": float(root(max(squares))),
        "rms_error": float(root(sum(squares) / len(squares))),
    }


def fit_cases():
    rng = random.Random(1805)
    cases = []
    for dimension in (2, 3):
        for order in (3, 5):
            bases = [
                {"family": "beta-bezier", "beta": rng.uniform(0.2, 3)},
                symmetric(rng, order, order + 2),
            ]
            if order == 3:
                bases.append({"family": "alpha-beta-bezier", "alpha": 1.0, "beta": 2.0})
            for basis in bases:
                points = polygon(rng, 25, dimension)
                inside = sorted(rng.random() for _ in range(23))
                parameters = [0.0] + inside + [1.0]
                for ends in ("free", "interpolate"):
                    cases.append({
                        "points": points,
                        "parameters": parameters,
                        "basis": basis,
                        "order": order,
                        "ends": ends,
                        **fitted(points, parameters, basis, order, ends),
                    })
    return cases


# ---- surfaces


def net_jet(bases, net, u, v):
    """Point and first derivatives of the tensor product of Li 2014 eq. (15), by its parameters."""
    shapes = [matrix_of(basis, 3) for basis in bases]
    across = [applied(shapes[1], row) for row in map(exact, net)]
    columns = [applied(shapes[0], list(column)) for column in zip(*across)]
    a, b = [F(length_of(basis)) for basis in bases]
    along = [bezier_jet(column, F(u) / a, a, 1) for column in columns]
    point, dv = bezier_jet([jet[0] for jet in along], F(v) / b, b, 1)
    du = bezier_jet([jet[1] for jet in along], F(v) / b, b, 0)[0]
    return [point, du, dv]


def surface_cases():
    rng = random.Random(2014)
    cases = []
    for _ in range(6):
        alpha = [rng.uniform(0.1, 1) for _ in range(2)]
        beta = [rng.uniform(0.1, 3) for _ in range(2)]
        both = zip(alpha, beta)
        bases = [{"family": "alpha-beta-bezier", "alpha": a, "beta": b} for a, b in both]
        net = [polygon(rng, 4, 3) for _ in range(4)]
        pairs = [[a * rng.random() for a in alpha] for _ in range(5)]
        pairs += [[0.0, alpha[1]], [alpha[0], 1e-9 * alpha[1]]]
        samples = []
        for u, v in pairs:
            point, du, dv = rounded(net_jet(bases, net, u, v))
            samples.append({"u": u, "v": v, "point": point, "du": du, "dv": dv})
        cases.append({"alpha": alpha, "beta": beta, "control_net": net, "samples": samples})
    return cases
