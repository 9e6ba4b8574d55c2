// A client made by @hey-api/openapi-ts: a curve through points, what kind of curve it is, and an error.
import assert from 'node:assert/strict';
import { client } from './hey-api/client.gen.js';
import { evaluate, fit, interpolate } from './hey-api/index.js';
import type { Basis, Curve, Points } from './hey-api/index.js';

client.setConfig({ baseUrl: process.argv[2]! });

/** Compiles only where `family` tells which fields there are, and where no family is forgotten. */
function told(curve: Curve): string {
  switch (curve.family) {
    case 'bezier':
      return `${curve.control_points.length} points`;
    case 'beta-bezier':
      return 'beta' in curve ? `beta ${curve.beta}` : `lambda ${curve.lambda}`;
    case 'alpha-beta-bezier':
      return `alpha ${curve.alpha}, beta ${curve.beta}`;
    case 'quasi-bezier':
      return curve.shape.kind === 'matrix' ? `${curve.shape.rows.length} rows` : curve.shape.kind;
    case 'piecewise':
      return `${curve.knots.length - 1} segments of ${curve.bases[0]!.family}`;
    case 'bspline':
      return `degree ${curve.degree}`;
    default:
      return curve satisfies never;
  }
}

const basis: Basis = { family: 'beta-bezier', beta: 1 };
const points: Points = [[0, 0], [2, 3], [5, 3], [6, 0]];
const through = await interpolate({ body: { points, basis }, query: { precision: 12 } });
assert.ok(through.data, JSON.stringify(through.error));
assert.equal(told(through.data.curve), '3 segments of beta-bezier');

// The output of a call is the input of the next.
const samples = await evaluate({ body: { curve: through.data.curve, sampling: { kind: 'count', count: 5 }, quantities: ['speed'] } });
assert.deepEqual(samples.data?.points[4], [6, 0]);
assert.equal(samples.data?.speed?.length, 5);

const close = await fit({ body: { points, solve: { kind: 'control-points', basis, order: 3 } } });
assert.equal(close.data?.curve.family, 'beta-bezier');
assert.ok(close.data && close.data.error.max < 1);

const wrong = await evaluate({ body: { curve: { family: 'bezier', control_points: [[0, 0]] }, sampling: { kind: 'count', count: 1 } } });
assert.ok(wrong.error);
assert.equal(wrong.error.status, 422);
assert.deepEqual(wrong.error.errors.map((item) => item.code), ['too_few', 'too_few']);
console.log('@hey-api/openapi-ts: ok');
