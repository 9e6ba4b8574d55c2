"""Exact arithmetic for the reference vectors: every double is taken as the rational number it is.

Results are rounded to the nearest double once, at the end. Only square roots are not rational: they
get 60 digits. No library beyond Python's own, and nothing of libm, which differs between machines.
"""

import math
from decimal import Decimal, getcontext
from fractions import Fraction as F

getcontext().prec = 60


# ---- points and numbers


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


def cross(a, b):
    return [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]


def dot(a, b):
    return sum(x * y for x, y in zip(a, b))


def decimal(x):
    return Decimal(x.numerator) / Decimal(x.denominator)


def root(x):
    """The square root of a rational number, to 60 digits."""
    return decimal(x).sqrt()


def polygon(rng, count, dimension, size=1.0, place=(0.0, 0.0, 0.0)):
    """Random control points around a place."""
    return [[place[k] + size * rng.uniform(-1, 1) for k in range(dimension)] for _ in range(count)]


# ---- linear algebra


def applied(matrix, points):
    """The combinations of points that the rows of a matrix name."""
    axes = range(len(points[0]))
    return [[sum(m * p[axis] for m, p in zip(row, points) if m) for axis in axes] for row in matrix]


def eliminated(matrix, columns):
    """Gauss-Jordan elimination of rows to unit columns; None where the rank is too small."""
    rows = [list(row) for row in matrix]
    for k in range(columns):
        pivot = next((i for i in range(k, len(rows)) if rows[i][k]), None)
        if pivot is None:
            return None
        rows[k], rows[pivot] = rows[pivot], rows[k]
        filled = [j for j in range(k, len(rows[k])) if rows[k][j]]
        inverse = 1 / rows[k][k]
        for j in filled:
            rows[k][j] *= inverse
        for i, row in enumerate(rows):
            factor = row[k]
            if i != k and factor:
                for j in filled:
                    row[j] -= factor * rows[k][j]
    return rows


def solved(matrix, right):
    """The points x with `matrix x = right`, for a square matrix."""
    rows = eliminated([row + list(point) for row, point in zip(matrix, right)], len(matrix))
    return [row[len(matrix):] for row in rows]


# ---- families: a shape matrix takes control points to Bezier points


def beta_matrix(n, beta):
    """Cheng et al. 2021 eq. (3): column k multiplies linear factors in Bernstein form."""
    columns = []
    for k in range(n + 1):
        factors = [(1 + i * beta, i * beta) for i in range(n - k)]
        factors += [(j * beta, 1 + j * beta) for j in range(k)]
        product = [F(1)]
        for m, (at0, at1) in enumerate(factors):
            low, high = product + [F(0)], [F(0)] + product
            product = [(a * at0 + b * at1) / (1 + m * beta) for a, b in zip(low, high)]
        columns.append([product[i] * math.comb(n, k) / math.comb(n, i) for i in range(n + 1)])
    return [[columns[k][i] for k in range(n + 1)] for i in range(n + 1)]


def straight_matrix(n):
    """Where beta is infinite: the segment between the end points, its degree elevated to n."""
    return [[F(n - i, n)] + [F(0)] * (n - 1) + [F(i, n)] for i in range(n + 1)]


def mirrored(degree, upper_rows):
    """All rows of a symmetric shape matrix: Chen 2013, m_ij = m_(d-i)(n-j)."""
    order = len(upper_rows[0]) - 1
    upper = [[F(j == 0) for j in range(order + 1)]] + exact(upper_rows)
    return upper + [row[::-1] for row in upper[:degree + 1 - len(upper)][::-1]]


def raised(matrix):
    """Chen 2013 eq. (36): one order and one degree more."""
    degree, order = len(matrix), len(matrix[0])
    old = [row + [F(0)] for row in matrix] + [[F(0)] * (order + 1)]
    shifted = [[F(0)] * (order + 1)] + [[F(0)] + row for row in matrix]
    return [lerp(a, b, F(i, degree)) for i, (a, b) in enumerate(zip(old, shifted))]


def elevated(lambdas):
    """Chen 2013 Table 1, Yang and Zeng 2009: degree elevation with one number per edge."""
    n = len(lambdas)
    shares = [F(0)] + [(i - F(x)) / (n + 1) for i, x in enumerate(lambdas, 1)] + [F(1)]
    row = lambda i: [shares[i] * (j == i - 1) + (1 - shares[i]) * (j == i) for j in range(n + 1)]
    return [row(i) for i in range(n + 2)]


def quasi_matrix(shape, order):
    if shape["kind"] == "matrix":
        return exact(shape["rows"])
    if shape["kind"] == "symmetric":
        return mirrored(shape["degree"], shape["upper_rows"])
    if shape["kind"] == "elevation":
        return elevated(shape["lambdas"])
    matrix = exact(shape["seed"])
    while len(matrix[0]) <= order:
        matrix = raised(matrix)
    return matrix


def matrix_of(basis, order):
    """The shape matrix of a basis in the JSON of the API; None for the identity."""
    if basis["family"] == "beta-bezier":
        if "lambda" in basis:
            inverse = F(basis["lambda"])
            return beta_matrix(order, 1 / inverse) if inverse else straight_matrix(order)
        return beta_matrix(order, F(basis["beta"]))
    if basis["family"] == "alpha-beta-bezier":
        # Li 2014: both parameters act on the shape through their product alone.
        s = F(basis["alpha"]) * F(basis["beta"]) / 3
        return [[1, 0, 0, 0], [1 - s, s, 0, 0], [0, 0, s, 1 - s], [0, 0, 0, 1]]
    if basis["family"] == "quasi-bezier":
        return quasi_matrix(basis["shape"], order)
    return None


def length_of(basis):
    """The native domain is [0, length]."""
    return basis.get("alpha", 1.0)


def bezier_of(basis, points):
    matrix = matrix_of(basis, len(points) - 1)
    return applied(matrix, points) if matrix else points


# ---- Bezier segments


def de_casteljau(points, u):
    """Every stage of the scheme, from the points to the one at u."""
    stages = [points]
    while len(stages[-1]) > 1:
        stages.append([lerp(a, b, u) for a, b in zip(stages[-1], stages[-1][1:])])
    return stages


def halves(points, u):
    """The Bezier points of the two parts at u."""
    stages = de_casteljau(points, u)
    return [stage[0] for stage in stages], [stage[-1] for stage in stages[::-1]]


def bezier_jet(points, u, length, orders, sign=-1):
    """The point at u and its derivatives, by a parameter on a domain of this length.

    The scheme of de Casteljau on integers over one denominator, as a common divisor for every
    number would take most of the time. With a sign of 1 differences become sums: of the sizes of
    points they give the size of what a derivative adds up.
    """
    degree, u = len(points) - 1, F(u)
    denominator = math.lcm(*(x.denominator for p in points for x in p))
    axes = [[x.numerator * (denominator // x.denominator) for x in axis] for axis in zip(*points)]
    low, high = u.denominator - u.numerator, u.numerator
    jet = []
    for stage in range(degree + 1):
        k = degree - stage
        if k <= orders:
            scale = math.perm(degree, k) / F(length) ** k / denominator
            signs = [sign ** (k - i) * math.comb(k, i) for i in range(k + 1)]
            jet.insert(0, [scale * dot(signs, axis) for axis in axes])
        axes = [[low * a + high * b for a, b in zip(axis, axis[1:])] for axis in axes]
        denominator *= u.denominator
    return jet + [[F(0)] * len(points[0])] * (orders - degree)


# ---- random shape matrices: multiples of a power of two, so that rows sum to 1 exactly


def dyadic_row(rng, count, parts):
    cuts = sorted(rng.randint(0, parts) for _ in range(count - 1))
    return [(b - a) / parts for a, b in zip([0] + cuts, cuts + [parts])]


def dyadic_matrix(rng, order, degree):
    """Rows of multiples of 1/64 that sum to 1 exactly, unit rows at the ends."""
    rows = []
    for i in range(degree + 1):
        row = dyadic_row(rng, order + 1, 64)
        if i in (0, degree):
            row = [float(j == (0 if i == 0 else order)) for j in range(order + 1)]
        rows.append(row)
    return rows
