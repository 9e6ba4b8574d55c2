#!/usr/bin/env python3
"""Makes every file of reference vectors in this directory, the same bytes every time.

    python3 tests/vectors/generate.py            writes them
    python3 tests/vectors/generate.py --check    fails where a file is not what it would write
    python3 tests/vectors/generate.py fit.json   writes only this one
"""

import json
import sys
from concurrent.futures import ProcessPoolExecutor
from pathlib import Path

sys.dont_write_bytecode = True

import families
import rational
import splines

HERE = Path(__file__).parent
# Those that take longest come first.
MAKERS = {
    "rational.json": rational.rational_cases,
    "knots.json": splines.knot_cases,
    "far.json": splines.far_cases,
    "rational_split.json": rational.rational_split_cases,
    "evaluate.json": families.evaluate_cases,
    "subdivide.json": families.subdivide_cases,
    "to_bspline.json": families.to_bspline_cases,
    "interpolate.json": families.interpolate_cases,
    "fit.json": families.fit_cases,
    "surface.json": families.surface_cases,
}


def text(name):
    return "[" + ",\n".join(json.dumps(case) for case in MAKERS[name]()) + "]\n"


def main(arguments):
    check = "--check" in arguments
    asked = [name for name in arguments if name != "--check"]
    unknown = {*asked, *(path.name for path in HERE.glob("*.json"))} - set(MAKERS)
    names = [name for name in MAKERS if not asked or name in asked]
    stale = []
    with ProcessPoolExecutor() as pool:
        for name, made in zip(names, pool.map(text, names)):
            path = HERE / name
            if not check:
                path.write_text(made)
            elif not path.exists() or path.read_text() != made:
                stale.append(name)
    for name in sorted(unknown):
        print(f"{name}: nothing here makes this file", file=sys.stderr)
    for name in stale:
        print(f"{name}: not what tests/vectors/generate.py makes", file=sys.stderr)
    return 1 if unknown or stale else 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
