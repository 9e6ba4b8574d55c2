"""The models of datamodel-code-generator, with httpx: a curve through points, what kind of curve it is, and an error."""

import sys

import httpx
from typing_extensions import assert_never

from models import (
    Basis,
    BetaBezierBasis,
    BetaBezierCurve,
    BezierCurve,
    CountSampling,
    Curve,
    EvaluateAnswer,
    EvaluateRequest,
    InterpolateAnswer,
    InterpolateRequest,
    Point2,
    Points,
    Problem,
    Sampling,
)


def told(given: Curve) -> str:
    """Compiles only where `family` tells which fields there are, and where no family is forgotten."""
    curve = given.root
    if curve.family == "bezier":
        return f"{len(curve.control_points.root)} points"
    if curve.family == "beta-bezier":
        return f"beta {curve.beta}" if isinstance(curve, BetaBezierCurve) else f"lambda {curve.lambda_}"
    if curve.family == "alpha-beta-bezier":
        return f"alpha {curve.alpha}, beta {curve.beta}"
    if curve.family == "quasi-bezier":
        return curve.shape.root.kind
    if curve.family == "piecewise":
        return f"{len(curve.knots) - 1} segments of {curve.bases[0].root.family}"
    if curve.family == "bspline":
        return f"degree {curve.degree}"
    assert_never(curve)


def main() -> None:
    client = httpx.Client(base_url=sys.argv[1], headers={"content-type": "application/json"})

    def ask(path: str, request: EvaluateRequest | InterpolateRequest) -> httpx.Response:
        return client.post(path, content=request.model_dump_json(by_alias=True, exclude_none=True))

    points = Points(root=[Point2(root=xy) for xy in ([0.0, 0.0], [2.0, 3.0], [5.0, 3.0], [6.0, 0.0])])
    basis = Basis(root=BetaBezierBasis(beta=1.0, family="beta-bezier"))
    answer = ask("/v1/interpolate", InterpolateRequest(points=points, basis=basis))
    through = InterpolateAnswer.model_validate_json(answer.content)
    assert told(through.curve) == "3 segments of beta-bezier"

    # The output of a call is the input of the next.
    sampling = Sampling(root=CountSampling(count=5, kind="count"))
    answer = ask("/v1/evaluate", EvaluateRequest(curve=through.curve, sampling=sampling))
    samples = EvaluateAnswer.model_validate_json(answer.content)
    assert samples.points.root[4].root == [6.0, 0.0], samples.points

    short = Curve(root=BezierCurve(control_points=Points(root=[Point2(root=[0.0, 0.0])]), family="bezier"))
    answer = ask("/v1/evaluate", EvaluateRequest(curve=short, sampling=sampling))
    wrong = Problem.model_validate_json(answer.content)
    assert wrong.status == 422 and wrong.errors[0].pointer == "/curve/control_points", wrong
    print("datamodel-code-generator: ok")


main()
