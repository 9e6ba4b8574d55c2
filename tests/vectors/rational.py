"""Makes rational.json and rational_split.json: what curves with weights must give.

C = sum w_j P_j b_j / sum w_j b_j, with the basis b_j of any family: the curve with the control
points (w_j P_j, w_j), projected. Its derivatives follow by the quotient rule.
"""

import math
import random
from decimal import Decimal
from fractions import Fraction as F

from exact import (
    bezier_jet,
    bezier_of,
    decimal,
    dot,
    exact,
    halves,
    largest,
    length_of,
    polygon,
    root,
    rounded,
)
from families import alpha_beta_bases, elevation, matrix, recursive, symmetric
from splines import clamped, curvature, random_spline, span_at

DECADES = [1, 4, 8, 12]
ORDERS = 3


# ---- curves with weights


def random_weights(rng, count, decades):
    """Log-uniform over the decades around 1; two of them are the ends of the range."""
    exponents = [rng.uniform(-decades / 2, decades / 2) for _ in range(count)]
    exponents[:2] = [-decades / 2, decades / 2]
    rng.shuffle(exponents)
    # Decimal powers are the same on every machine; five digits are enough of a weight.
    return [float(f"{Decimal(10) ** Decimal(x):.4e}") for x in exponents]


def random_bases(rng, degree):
    """Bases of any family with the order of the control polygon; of this degree, or near it."""
    beta = rng.choice([0.125, 0.3, 1.0, 2.7, rng.uniform(0, 20)])
    bases = [
        (degree, {"family": "bezier"}),
        (degree, {"family": "beta-bezier", "beta": beta}),
        (degree, matrix(rng, degree, degree)),
    ]
    if degree == 3:
        bases += [(3, basis) for basis in alpha_beta_bases(rng)]
    if degree > 1:
        bases.append((degree - 1, elevation(rng, degree - 1)))
    if degree > 2:
        bases.append((degree, recursive(rng)))
        bases.append((degree - 1, symmetric(rng, degree - 1, degree)))
    return bases


def single_curves(rng, degrees):
    """Of every family and degree, with the decades and the dimensions in turn."""
    bases = [basis for degree in degrees for basis in random_bases(rng, degree)]
    for i, (order, basis) in enumerate(bases):
        for dimension in (2, 3):
            points = polygon(rng, order + 1, dimension)
            weights = random_weights(rng, order + 1, DECADES[(i + dimension) % 4])
            yield dict(basis, control_points=points, weights=weights)
    for inverse in (0.0, 0.5):
        for dimension in (2, 3):
            points, weights = polygon(rng, 5, dimension), random_weights(rng, 5, 4)
            basis = {"family": "beta-bezier", "lambda": inverse}
            yield dict(basis, control_points=points, weights=weights)


def piecewise_curves(rng):
    """Segments of different lengths with one basis for all or one for each, joined C0."""
    for degree in range(1, 13):
        for dimension in (2, 3):
            choice = random_bases(rng, degree)
            order, basis = rng.choice(choice)
            same_order = [basis for near, basis in choice if near == order]
            bases = [basis] if dimension == 2 else rng.choices(same_order, k=3)
            count = 3 * order + 1
            yield {
                "family": "piecewise",
                "bases": bases,
                "order": order,
                "knots": [-0.5, 0.25, 0.5, 2.0],
                "control_points": polygon(rng, count, dimension),
                "weights": random_weights(rng, count, DECADES[(degree + dimension) % 4]),
                "closed": False,
            }


def bsplines(rng):
    for degree in range(1, 13):
        kinds = [(2, 1.0, True), (3, 100.0, degree % 2 == 0), (2, 10.0, False)]
        for i, (dimension, ratio, ends_clamped) in enumerate(kinds):
            multiplicities = [1, min(degree, rng.randint(1, 2))]
            curve = random_spline(rng, degree, ratio, multiplicities, ends_clamped, dimension)
            count = len(curve["control_points"])
            yield dict(curve, weights=random_weights(rng, count, DECADES[(degree + i) % 4]))


# ---- exactly


def homogeneous(curve):
    """The control points (w P, w)."""
    weighted = zip(exact(curve["control_points"]), map(F, curve["weights"]))
    return [[w * x for x in p] + [w] for p, w in weighted]


def projected(point):
    return [x / point[-1] for x in point[:-1]]


def segment_at(curve, points, t):
    """The Bezier points of the segment that a parameter lies in (of two, the later one), and its
    interval."""
    if curve["family"] == "piecewise":
        knots, order = curve["knots"], curve["order"]
        i = max(i for i in range(len(knots) - 1) if knots[i] <= t)
        basis = curve["bases"][i % len(curve["bases"])]
        return bezier_of(basis, points[i * order:(i + 1) * order + 1]), *map(F, knots[i:i + 2])
    if curve["family"] == "bspline":
        degree, knots = curve["degree"], [F(x) for x in curve["knots"]]
        span = span_at(degree, knots, F(t))
        around = knots[span - degree:span + degree + 2]
        _, bezier = clamped(degree, around, points[span - degree:span + 1])
        return bezier, *knots[span:span + 2]
    return bezier_of(curve, points), F(0), F(length_of(curve))


def quotient_jet(jet):
    """The point and its derivatives, of those of the numerator and the weight."""
    found = []
    for k, row in enumerate(jet):
        rest = row[:-1]
        for j in range(1, k + 1):
            factor = math.comb(k, j) * jet[j][-1]
            rest = [x - factor * y for x, y in zip(rest, found[k - j])]
        found.append([x / jet[0][-1] for x in rest])
    return found


def scales(jet, most, found):
    """How far results move, to first order, where each weight, each weighted coordinate and each
    difference of them is off by its own size: an error divided by the scale counts roundings."""
    weight, offs = jet[0][-1], []
    sizes = [largest(p) for p in found]
    for k in range(ORDERS + 1):
        off = max(most[k][:-1])
        for j in range(k + 1):
            off += math.comb(k, j) * most[j][-1] * sizes[k - j]
            off += math.comb(k, j) * abs(jet[j][-1]) * offs[k - j] if j else 0
        offs.append(off / weight)
    speed = root(dot(found[1], found[1]))
    first, second = decimal(offs[1]), decimal(offs[2])
    bend = root(dot(found[2], found[2]))
    curvature_off = (first * bend + second * speed) / speed ** 3
    curvature_off += 3 * abs(curvature(found)) * first / speed
    return [float(f"{float(x):.2e}") for x in offs + [curvature_off]]


def sample(curve, t):
    # The sizes of the numbers go through the same sums beside them.
    points = [p + [abs(x) for x in p] for p in homogeneous(curve)]
    local, a, b = segment_at(curve, points, t)
    u, axes = (F(t) - a) / (b - a), len(points[0]) // 2
    jet = bezier_jet([p[:axes] for p in local], u, b - a, ORDERS)
    most = bezier_jet([p[axes:] for p in local], u, b - a, ORDERS, 1)
    found = quotient_jet(jet)
    return rounded(found), float(curvature(found)), scales(jet, most, found)


def parameters_of(rng, curve):
    """Both ends, near an end, every joint, and inside every segment."""
    if curve["family"] == "piecewise":
        breaks = curve["knots"]
    elif curve["family"] == "bspline":
        degree = curve["degree"]
        breaks = sorted(set(curve["knots"][degree:len(curve["knots"]) - degree]))
    else:
        length = length_of(curve)
        return [0.0, 1e-9 * length, length * rng.random(), length * rng.random(), length]
    inside = [a + (b - a) * rng.random() for a, b in zip(breaks, breaks[1:])]
    return sorted(breaks + inside)


def rational_cases():
    rng = random.Random(1975)
    curves = list(single_curves(rng, range(1, 13)))
    curves += list(piecewise_curves(rng)) + list(bsplines(rng))
    cases = []
    for curve in curves:
        parameters = parameters_of(rng, curve)
        expected, bends, sizes = zip(*[sample(curve, t) for t in parameters])
        cases.append({
            "curve": curve,
            "parameters": parameters,
            "derivatives": ORDERS,
            "expected": expected,
            "curvature": bends,
            "scale": sizes,
        })
    return cases


def rational_split_cases():
    rng = random.Random(1983)
    cases = []
    for curve in single_curves(rng, [1, 2, 3, 4, 6, 9, 12]):
        at = length_of(curve) * rng.uniform(0.05, 0.95)
        points = bezier_of(curve, homogeneous(curve))
        parts = halves(points, F(at) / F(length_of(curve)))
        part = lambda points: {
            "control_points": rounded([projected(p) for p in points]),
            "weights": [float(p[-1]) for p in points],
        }
        left, right = map(part, parts)
        cases.append({"curve": curve, "at": at, "left": left, "right": right})
    return cases
