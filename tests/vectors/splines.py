"""Makes knots.json and far.json: what B-splines and far-away curves must give.

Nothing but the definitions is used: the recursion of de Boor and its blossom (Ramshaw 1987), knot
insertion (Boehm 1980), differences for derivatives, and the families of exact.py.
"""

import random
from fractions import Fraction as F

from exact import (
    bezier_jet,
    bezier_of,
    cross,
    decimal,
    difference,
    dot,
    dyadic_matrix,
    exact,
    largest,
    lerp,
    polygon,
    root,
    rounded,
)


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
        zero = [F(0)] * len(points[0])
        return difference(points[i], points[i + 1], degree / length) if length else zero

    return degree - 1, knots[1:-1], [vector(i) for i in range(len(points) - 1)]


def on_knots(degree, knots, points, new):
    """The control points on other knots, each blossom from a span that has the most of its
    arguments."""
    known = {tuple(knots[i + 1:i + degree + 1]): point for i, point in enumerate(points)}

    def point(i):
        arguments = new[i + 1:i + degree + 1]
        if tuple(arguments) in known:
            return known[tuple(arguments)]
        support = range(i, i + degree + 1)
        reaches = lambda s: any(new[k] <= knots[s] < new[k + 1] for k in support)
        middle = sum(arguments) / degree
        off = lambda s: abs((knots[s] + knots[s + 1]) / 2 - middle)
        span = min(filter(reaches, spans(degree, knots)), key=off)
        return blossom(degree, knots, points, span, arguments)

    return [point(i) for i in range(len(new) - degree - 1)]


def inserted(degree, knots, points, t):
    """One copy of a knot more (Boehm 1980)."""
    k = max(i for i in range(len(knots)) if knots[i] <= t)
    first = max(k - degree + 1, 1)
    last = min(k, len(points) - 1)

    def between(i):
        low, high = knots[i], knots[i + degree]
        return lerp(points[i - 1], points[i], (t - low) / (high - low))

    new = points[:first] + [between(i) for i in range(first, last + 1)] + points[last:]
    return knots[:k + 1] + [t] + knots[k + 1:], new


def clamped(degree, knots, points):
    """The same curve on knots that repeat its ends, without what lies beyond them."""
    a, b = knots[degree], knots[-degree - 1]
    for t in (a, b):
        while knots.count(t) < degree:
            knots, points = inserted(degree, knots, points, t)
    first = len(knots) - knots[::-1].index(a) - 1 - degree
    knots = [a] * (degree + 1) + [t for t in knots if a < t < b] + [b] * (degree + 1)
    return knots, points[first:first + len(knots) - degree - 1]


def spline(curve):
    return curve["degree"], [F(t) for t in curve["knots"]], exact(curve["control_points"])


def random_spline(rng, degree, ratio, multiplicities, ends_clamped=True, dimension=2):
    """Spans whose lengths are powers of the ratio apart, with knots of these multiplicities between
    them."""
    t, knots = rng.uniform(-1, 1), []
    for i, copies in enumerate(multiplicities):
        t += (1.0 if i % 2 else 1.0 / ratio) * rng.uniform(0.5, 1.0)
        knots += [t] * copies
    end = t + rng.uniform(0.5, 1.0)
    start = knots[0] - rng.uniform(0.3, 1.0) if knots else end - 1.0
    if ends_clamped:
        knots = [start] * (degree + 1) + knots + [end] * (degree + 1)
    else:
        before, after = [start], [end]
        for _ in range(degree):
            before.insert(0, before[0] - rng.choice([1.0, 1.0 / ratio]) * rng.uniform(0.2, 1.0))
            after.append(after[-1] + rng.choice([1.0, 1.0 / ratio]) * rng.uniform(0.2, 1.0))
        knots = before + knots + after
    points = polygon(rng, len(knots) - degree - 1, dimension)
    return {"family": "bspline", "degree": degree, "knots": knots, "control_points": points}


def knot_cases():
    rng = random.Random(20130)
    cases = []

    def add(kind, curve, new, points):
        cases.append({
            "kind": kind,
            "curve": curve,
            "knots": [float(t) for t in new],
            "control_points": rounded(points),
        })

    for degree in range(1, 26):
        for ratio in [1.0, 1e2, 1e4, 1e6]:
            some = lambda: rng.randint(1, min(degree, 3)) if rng.random() < 0.5 else 1
            mixed = [some() for _ in range(rng.randint(2, 5))]
            curve = random_spline(rng, degree, ratio, mixed)
            add("minimal", curve, *spline(curve)[1:])
            curve = random_spline(rng, degree, ratio, mixed, ends_clamped=False)
            add("open", curve, *clamped(*spline(curve)))
        # One copy too many of one knot: it goes, the others stay.
        curve = random_spline(rng, degree, 10.0, [1, min(degree, 2), 1])
        degree, knots, points = spline(curve)
        t = knots[degree + 2]
        if knots.count(t) < degree:
            more, points_more = inserted(degree, knots, points, t)
            redundant = dict(
                curve, knots=[float(x) for x in more], control_points=rounded(points_more)
            )
            add("redundant", redundant, knots, points)
        # Simple knots at equal distances inside, clamped at the ends, to uniform ones.
        if degree <= 9:
            inner = [float(i) for i in range(1, 6)]
            curve = {
                "family": "bspline",
                "degree": degree,
                "knots": [0.0] * (degree + 1) + inner + [6.0] * (degree + 1),
                "control_points": polygon(rng, degree + 6, 2),
            }
            uniform = [F(i) for i in range(-degree, 7 + degree)]
            add("uniform", curve, uniform, on_knots(*spline(curve), uniform))
    return cases


# ---- curves far from the origin


def size(points):
    """How far points lie from the first one."""
    return max(largest(difference(points[0], p, F(1))) for p in points)


def bezier_scales(points, length, orders):
    """How large each derivative can be by the size of the segment."""
    degree, scales = len(points) - 1, [size(points)]
    for k in range(orders):
        scales.append(scales[-1] * 2 * max(degree - k, 0) / length)
    return scales


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
                support = lambda i: old[0][i + old[1] + 1] - old[0][i + 1]
                gain = lambda i: old[1] / support(i) if support(i) else F(0)
                sizes = [(a + b) * gain(i) for i, (a, b) in enumerate(zip(sizes, sizes[1:]))]
        local = slice(span - degree, span + 1)
        scales.append(max(sizes[local]) if k else size(points[local]))
        jet.append(blossom(degree, knots, points, span, [t] * degree))
    return jet, scales


def curvature(jet):
    """Signed in the plane, to 60 digits; None at a standstill."""
    first, second = jet[1:3]
    speed = root(dot(first, first))
    if not speed:
        return None
    if len(first) == 2:
        return decimal(first[0] * second[1] - first[1] * second[0]) / speed ** 3
    area = cross(first, second)
    return root(dot(area, area)) / speed ** 3


def shape(jet):
    """Speed, curvature, torsion."""
    speed = root(dot(jet[1], jet[1]))
    if not speed:
        return None
    found = [float(speed), float(curvature(jet))]
    if len(jet[1]) == 3:
        area = cross(jet[1], jet[2])
        square = dot(area, area)
        found += [float(decimal(dot(area, jet[3]) / square))] if square else []
    return found


PLACES = [
    (2, 1e-6, (1e6, -1e6)),
    (3, 1e-6, (1e6, 7e5, -1e6)),
    (2, 1.0, (-4e5, 3.0)),
    (3, 1e-3, (0.0, 2e6, 5.0)),
]


def far_cases():
    rng = random.Random(10662)
    cases = []

    def add(curve, jets):
        sample = lambda t, jet, scales: {
            "parameter": t,
            "jet": rounded(jet),
            "scales": [float(s) for s in scales],
            "shape": shape(jet),
        }
        cases.append({"curve": curve, "samples": [sample(t, *jet) for t, jet in jets]})

    def segment_jet(points, t, a, b):
        t, a, b = F(t), F(a), F(b)
        jet = bezier_jet(points, (t - a) / (b - a), b - a, 3)
        return jet, bezier_scales(points, b - a, 3)

    for degree in range(1, 13):
        for dimension, spread, place in PLACES:
            beta = rng.choice([0.125, 0.3, 1.0, 2.7])
            rows = dyadic_matrix(rng, degree, degree + rng.randint(0, 1))
            bases = [
                {"family": "bezier"},
                {"family": "beta-bezier", "beta": beta},
                {"family": "quasi-bezier", "shape": {"kind": "matrix", "rows": rows}},
            ]
            if degree == 3:
                beta = rng.uniform(0.3, 2)
                bases.append({"family": "alpha-beta-bezier", "alpha": 0.75, "beta": beta})
            for basis in bases:
                length = basis.get("alpha", 1.0)
                ts = [0.0, 0.37 * length, 0.8125 * length, length]
                points = polygon(rng, degree + 1, dimension, spread, place)
                bezier = bezier_of(basis, exact(points))
                jets = [(t, segment_jet(bezier, t, 0, length)) for t in ts]
                add(dict(basis, control_points=points), jets)
            basis, knots = bases[rng.randint(0, 1)], [1.0, 1.75, 1.76, 3.0]
            curve = {
                "family": "piecewise",
                "bases": [basis],
                "order": degree,
                "knots": knots,
                "control_points": polygon(rng, 3 * degree + 1, dimension, spread, place),
                "closed": False,
            }
            points = exact(curve["control_points"])
            jets = []
            for t in [1.0, 1.3, 1.75, 1.755, 2.5, 3.0]:
                i = max(i for i in range(3) if knots[i] <= t)
                bezier = bezier_of(basis, points[i * degree:(i + 1) * degree + 1])
                jets.append((t, segment_jet(bezier, t, *knots[i:i + 2])))
            add(curve, jets)
            for ratio in [1.0, 1e3]:
                curve = random_spline(rng, degree, ratio, [1, min(2, degree), 1])
                count = len(curve["control_points"])
                curve["control_points"] = polygon(rng, count, dimension, spread, place)
                parts, knots = spline(curve), curve["knots"]
                spread_of = lambda s: knots[s + 1] - knots[s]
                inside = [knots[s] + rng.random() * spread_of(s) for s in spans(degree, knots)]
                jets = [(t, spline_jet(*parts, F(t), 3)) for t in [knots[degree]] + inside]
                add(curve, jets)
    return cases
