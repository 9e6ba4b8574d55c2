#!/usr/bin/env python3
"""Makes knots.json and far.json, in this directory: what B-splines and far-away curves must give.

Exact: every double of a curve is taken as the rational number it is, and all arithmetic is that of `fractions`; results are
rounded to the nearest double once, at the end. Nothing but the definitions is used: the recursion of de Boor and its
blossom (Ramshaw 1987), differences for derivatives, Cheng et al. 2021 eq. (3) for Beta-Bezier. No library beyond Python's own.

    python3 tests/vectors/splines.py
"""

import json
import math
import os
import random
from decimal import Decimal, getcontext
from fractions import Fraction as F

getcontext().prec = 60
HERE = os.path.dirname(os.path.abspath(__file__))


def exact(points):
    return [[F(x) for x in p] for p in points]


def rounded(points):
    return [[float(x) for x in p] for p in points]


def lerp(p, q, u):
    return [a + u * (b - a) for a, b in zip(p, q)]


def difference(p, q, factor):
    return [factor * (b - a) for a, b in zip(p, q)]


def largest(p):
    return max(abs(x) for x in p)


# ---- B-splines


def blossom(degree, knots, points, span, arguments):
    """The blossom of the polynomial over [knots[span], knots[span + 1]]."""
    q = points[span - degree:span + 1]
    for r, x in enumerate(arguments, 1):
        for j in range(degree + 1 - r):
            low, high = knots[span - degree + j + r], knots[span + 1 + j]
            q[j] = lerp(q[j], q[j + 1], (x - low) / (high - low))
    return q[0]


def spans(degree, knots):
    return [i for i in range(degree, len(knots) - degree - 1) if knots[i] < knots[i + 1]]


def span_at(degree, knots, t):
    found = spans(degree, knots)
    return max([i for i in found if knots[i] <= t] or found[:1])


def derived(degree, knots, points):
    def vector(i):
        length = knots[i + degree + 1] - knots[i + 1]
        return difference(points[i], points[i + 1], degree / length) if length else [F(0)] * len(points[0])
    return degree - 1, knots[1:-1], [vector(i) for i in range(len(points) - 1)]


def on_knots(degree, knots, points, new):
    """The control points on other knots, each blossom from a span that has the most of its arguments."""
    known = {tuple(knots[i + 1:i + degree + 1]): point for i, point in enumerate(points)}

    def point(i):
        arguments = new[i + 1:i + degree + 1]
        if tuple(arguments) in known:
            return known[tuple(arguments)]
        inside = [s for s in spans(degree, knots) if any(new[k] <= knots[s] < new[k + 1] for k in range(i, i + degree + 1))]
        middle = sum(arguments) / degree
        span = min(inside, key=lambda s: abs((knots[s] + knots[s + 1]) / 2 - middle))
        return blossom(degree, knots, points, span, arguments)
    return [point(i) for i in range(len(new) - degree - 1)]


def inserted(degree, knots, points, t):
    """One copy of a knot more (Boehm 1980)."""
    k = max(i for i in range(len(knots)) if knots[i] <= t)
    new = []
    for i in range(len(points) + 1):
        low, high = (knots[i], knots[i + degree]) if i + degree < len(knots) else (t, t + 1)
        a = 1 if i <= k - degree else 0 if i > k else (t - low) / (high - low)
        new.append(points[0] if i == 0 else points[-1] if i == len(points) else lerp(points[i - 1], points[i], a))
    return knots[:k + 1] + [t] + knots[k + 1:], new


def spline(curve):
    return curve["degree"], [F(t) for t in curve["knots"]], exact(curve["control_points"])


def random_spline(rng, degree, ratio, multiplicities, clamped=True, size=1.0):
    """Spans whose lengths are powers of the ratio apart, with knots of these multiplicities between them."""
    t, knots = rng.uniform(-1, 1), []
    for i, copies in enumerate(multiplicities):
        t += (1.0 if i % 2 else 1.0 / ratio) * rng.uniform(0.5, 1.0)
        knots += [t] * copies
    end = t + rng.uniform(0.5, 1.0)
    start = knots[0] - rng.uniform(0.3, 1.0) if knots else end - 1.0
    if clamped:
        knots = [start] * (degree + 1) + knots + [end] * (degree + 1)
    else:
        before, after, t = [start], [end], start
        for _ in range(degree):
            before.insert(0, before[0] - rng.choice([1.0, 1.0 / ratio]) * rng.uniform(0.2, 1.0))
            after.append(after[-1] + rng.choice([1.0, 1.0 / ratio]) * rng.uniform(0.2, 1.0))
        knots = before + knots + after
    count = len(knots) - degree - 1
    points = [[rng.uniform(-size, size), rng.uniform(-size, size)] for _ in range(count)]
    return {"family": "bspline", "degree": degree, "knots": knots, "control_points": points}


def clamped_knots(degree, knots):
    a, b = knots[degree], knots[-degree - 1]
    return [a] * (degree + 1) + [t for t in knots if a < t < b] + [b] * (degree + 1)


def knot_cases():
    rng = random.Random(20130)
    cases = []

    def add(kind, curve, new, points=None):
        degree, knots, exact_points = spline(curve)
        expected = on_knots(degree, knots, exact_points, new) if points is None else points
        cases.append({"kind": kind, "curve": curve, "knots": [float(t) for t in new], "control_points": rounded(expected)})

    for degree in range(1, 26):
        for ratio in [1.0, 1e2, 1e4, 1e6]:
            mixed = [rng.randint(1, min(degree, 3)) if rng.random() < 0.5 else 1 for _ in range(rng.randint(2, 5))]
            curve = random_spline(rng, degree, ratio, mixed)
            add("minimal", curve, [F(t) for t in curve["knots"]], exact(curve["control_points"]))
            curve = random_spline(rng, degree, ratio, mixed, clamped=False)
            add("open", curve, clamped_knots(degree, [F(t) for t in curve["knots"]]))
        # One copy too many of one knot: it goes, the others stay.
        curve = random_spline(rng, degree, 10.0, [1, min(degree, 2), 1])
        degree, knots, points = spline(curve)
        t = knots[degree + 2]
        if knots.count(t) < degree:
            more, points_more = inserted(degree, knots, points, t)
            redundant = dict(curve, knots=[float(x) for x in more], control_points=rounded(points_more))
            add("redundant", redundant, knots, points)
        # Simple knots at equal distances inside, clamped at the ends, to uniform ones.
        if degree <= 9:
            inner = [F(i) for i in range(1, 6)]
            knots = [0.0] * (degree + 1) + [float(t) for t in inner] + [6.0] * (degree + 1)
            points = [[rng.uniform(-1, 1), rng.uniform(-1, 1)] for _ in range(degree + 6)]
            curve = {"family": "bspline", "degree": degree, "knots": knots, "control_points": points}
            add("uniform", curve, [F(i) for i in range(-degree, 7 + degree)])
    return cases


# ---- curves far from the origin


def bernstein_jet(points, u, length, orders):
    """Derivatives of a Bezier segment at u, and how large each can be by the size of the segment."""
    degree = len(points) - 1
    size = max(largest(difference(points[0], p, F(1))) for p in points)
    jet, scales, q = [], [], points
    for k in range(orders + 1):
        if k:
            size = size * 2 * max(degree + 1 - k, 0) / length
            q = [difference(a, b, (degree + 1 - k) / length) for a, b in zip(q, q[1:])]
        here = list(q) or [[F(0)] * len(points[0])]
        while len(here) > 1:
            here = [lerp(a, b, u) for a, b in zip(here, here[1:])]
        jet.append(here[0])
        scales.append(size)
    return jet, scales


def spline_jet(degree, knots, points, t, orders):
    jet, scales, sizes = [], [], None
    span = span_at(degree, knots, t)
    for k in range(orders + 1):
        if k:
            if degree == 0:
                jet.append([F(0)] * len(points[0]))
                scales.append(F(0))
                continue
            old = knots, degree
            degree, knots, points = derived(degree, knots, points)
            span -= 1
            if k == 1:
                sizes = [largest(v) for v in points]
            else:
                gain = lambda i: old[1] / (old[0][i + old[1] + 1] - old[0][i + 1])
                support = lambda i: old[0][i + old[1] + 1] > old[0][i + 1]
                sizes = [(sizes[i] + sizes[i + 1]) * gain(i) if support(i) else F(0) for i in range(len(points))]
        local = points[span - degree:span + 1]
        scales.append(max(sizes[span - degree:span + 1]) if k else max(largest(difference(local[0], p, F(1))) for p in local))
        jet.append(blossom(degree, knots, points, span, [t] * degree))
    return jet, scales


def beta_matrix(n, beta):
    """Cheng et al. 2021 eq. (3): column k multiplies linear factors in Bernstein form."""
    columns = []
    for k in range(n + 1):
        factors = [(1 + i * beta, i * beta) for i in range(n - k)] + [(j * beta, 1 + j * beta) for j in range(k)]
        product = [F(1)]
        for m, (at0, at1) in enumerate(factors):
            product = [(product[i] * at0 if i < len(product) else 0) + (product[i - 1] * at1 if i else 0) for i in range(len(product) + 1)]
            product = [x / (1 + m * beta) for x in product]
        columns.append([product[i] * math.comb(n, k) / math.comb(n, i) for i in range(n + 1)])
    return [[columns[k][i] for k in range(n + 1)] for i in range(n + 1)]


def applied(matrix, points):
    return [[sum(m * p[axis] for m, p in zip(row, points)) for axis in range(len(points[0]))] for row in matrix]


def dyadic_matrix(rng, order, degree):
    """Rows of multiples of 1/64 that sum to 1 exactly, unit rows at the ends."""
    rows = []
    for i in range(degree + 1):
        cuts = sorted(rng.randint(0, 64) for _ in range(order))
        row = [(b - a) / 64 for a, b in zip([0] + cuts, cuts + [64])]
        if i in (0, degree):
            row = [float(j == (0 if i == 0 else order)) for j in range(order + 1)]
        rows.append(row)
    return rows


def matrix_of(basis, order):
    if basis["family"] == "beta-bezier":
        return beta_matrix(order, F(basis["beta"]))
    if basis["family"] == "alpha-beta-bezier":
        s = F(basis["alpha"]) * F(basis["beta"]) / 3
        return [[1, 0, 0, 0], [1 - s, s, 0, 0], [0, 0, s, 1 - s], [0, 0, 0, 1]]
    if basis["family"] == "quasi-bezier":
        return [[F(m) for m in row] for row in basis["shape"]["rows"]]
    return None


def bezier_of(basis, points):
    matrix = matrix_of(basis, len(points) - 1)
    return applied(matrix, points) if matrix else points


def decimal(x):
    return Decimal(x.numerator) / Decimal(x.denominator)


def cross(a, b):
    return [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]


def dot(a, b):
    return sum(x * y for x, y in zip(a, b))


def shape(jet):
    """Speed, curvature, torsion."""
    first, second, third = jet[1:4]
    speed = decimal(dot(first, first)).sqrt()
    if not speed:
        return None
    if len(first) == 2:
        return [float(speed), float(decimal(first[0] * second[1] - first[1] * second[0]) / speed ** 3)]
    area = cross(first, second)
    square = dot(area, area)
    curvature = float(decimal(square).sqrt() / speed ** 3)
    return [float(speed), curvature] + ([float(decimal(dot(area, third) / square))] if square else [])


def far_cases():
    rng = random.Random(10662)
    cases = []

    def polygon(count, dimension, size, place):
        return [[place[k] + size * rng.uniform(-1, 1) for k in range(dimension)] for _ in range(count)]

    def add(curve, jets):
        samples = []
        for t, (jet, scales) in jets:
            samples.append({"parameter": t, "jet": rounded(jet), "scales": [float(s) for s in scales], "shape": shape(jet)})
        cases.append({"curve": curve, "samples": samples})

    for degree in range(1, 13):
        for dimension, size, place in [(2, 1e-6, (1e6, -1e6)), (3, 1e-6, (1e6, 7e5, -1e6)), (2, 1.0, (-4e5, 3.0)), (3, 1e-3, (0.0, 2e6, 5.0))]:
            bases = [{"family": "bezier"}, {"family": "beta-bezier", "beta": rng.choice([0.125, 0.3, 1.0, 2.7])},
                     {"family": "quasi-bezier", "shape": {"kind": "matrix", "rows": dyadic_matrix(rng, degree, degree + rng.randint(0, 1))}}]
            if degree == 3:
                bases.append({"family": "alpha-beta-bezier", "alpha": 0.75, "beta": rng.uniform(0.3, 2)})
            for basis in bases:
                length = basis.get("alpha", 1.0)
                ts = [0.0, 0.37 * length, 0.8125 * length, length]
                curve = dict(basis, control_points=polygon(degree + 1, dimension, size, place))
                points = bezier_of(basis, exact(curve["control_points"]))
                add(curve, [(t, bernstein_jet(points, F(t) / F(length), F(length), 3)) for t in ts])
            basis, knots = bases[rng.randint(0, 1)], [1.0, 1.75, 1.76, 3.0]
            curve = {"family": "piecewise", "bases": [basis], "order": degree, "knots": knots,
                     "control_points": polygon(3 * degree + 1, dimension, size, place), "closed": False}
            points = exact(curve["control_points"])
            jets = []
            for t in [1.0, 1.3, 1.75, 1.755, 2.5, 3.0]:
                i = max(i for i in range(3) if knots[i] <= t)
                a, b = F(knots[i]), F(knots[i + 1])
                jets.append((t, bernstein_jet(bezier_of(basis, points[i * degree:(i + 1) * degree + 1]), (F(t) - a) / (b - a), b - a, 3)))
            add(curve, jets)
            for ratio in [1.0, 1e3]:
                curve = random_spline(rng, degree, ratio, [1, min(2, degree), 1])
                curve["control_points"] = polygon(len(curve["control_points"]), dimension, size, place)
                parts = spline(curve)
                knots = curve["knots"]
                inside = [knots[s] + rng.random() * (knots[s + 1] - knots[s]) for s in spans(degree, knots)]
                add(curve, [(t, spline_jet(*parts, F(t), 3)) for t in [knots[degree]] + inside])
    return cases


def write(name, cases):
    with open(os.path.join(HERE, name), "w") as file:
        file.write("[" + ",\n".join(json.dumps(case) for case in cases) + "]\n")
    print(name, len(cases), "cases")


if __name__ == "__main__":
    write("knots.json", knot_cases())
    write("far.json", far_cases())
