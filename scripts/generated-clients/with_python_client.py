"""A client made by openapi-python-client: a curve through points, what kind of curve it is, and an error."""

import sys

from typing_extensions import assert_never

from springline_client import Client
from springline_client.api.curves import evaluate
from springline_client.api.points import interpolate
from springline_client.models import (
    AlphaBetaBezierCurve,
    BetaBezierBasis,
    BetaBezierCurve,
    BetaBezierCurveByLambda,
    BezierCurve,
    BSplineCurve,
    CountSampling,
    EvaluateAnswer,
    EvaluateRequest,
    InterpolateAnswer,
    InterpolateRequest,
    PiecewiseCurve,
    Problem,
    QuasiBezierCurve,
)

Curve = (
    BezierCurve
    | BetaBezierCurve
    | BetaBezierCurveByLambda
    | AlphaBetaBezierCurve
    | QuasiBezierCurve
    | PiecewiseCurve
    | BSplineCurve
)


def told(curve: Curve) -> str:
    """Compiles only where `family` tells which fields there are, and where no family is forgotten."""
    if curve.family == "bezier":
        return f"{len(curve.control_points)} points"
    if curve.family == "beta-bezier":
        return f"beta {curve.beta}" if isinstance(curve, BetaBezierCurve) else f"lambda {curve.lambda_}"
    if curve.family == "alpha-beta-bezier":
        return f"alpha {curve.alpha}, beta {curve.beta}"
    if curve.family == "quasi-bezier":
        return curve.shape.kind
    if curve.family == "piecewise":
        return f"{len(curve.knots) - 1} segments of {curve.bases[0].family}"
    if curve.family == "bspline":
        return f"degree {curve.degree}"
    assert_never(curve)


def main() -> None:
    client = Client(base_url=sys.argv[1])
    points = [[0.0, 0.0], [2.0, 3.0], [5.0, 3.0], [6.0, 0.0]]
    request = InterpolateRequest(points=points, basis=BetaBezierBasis(beta=1.0, family="beta-bezier"))
    through = interpolate.sync(client=client, body=request, precision=12)
    assert isinstance(through, InterpolateAnswer), through
    assert told(through.curve) == "3 segments of beta-bezier"

    # The output of a call is the input of the next.
    sampling = CountSampling(count=5, kind="count")
    samples = evaluate.sync(client=client, body=EvaluateRequest(curve=through.curve, sampling=sampling))
    assert isinstance(samples, EvaluateAnswer), samples
    assert samples.points[4] == [6.0, 0.0], samples.points

    short = BezierCurve(control_points=[[0.0, 0.0]], family="bezier")
    wrong = evaluate.sync(client=client, body=EvaluateRequest(curve=short, sampling=sampling))
    assert isinstance(wrong, Problem), wrong
    assert wrong.status == 422 and wrong.errors[0].pointer == "/curve/control_points", wrong
    print("openapi-python-client: ok")


main()
