// A client of openapi-fetch with the types of openapi-typescript: a curve through points, what kind of curve it is, and an error.
import assert from 'node:assert/strict';
import createClient from 'openapi-fetch';
import type { components, paths } from './schema.d.ts';

type Curve = components['schemas']['Curve'];
type Basis = components['schemas']['Basis'];

const client = createClient<paths>({ baseUrl: process.argv[2]! });

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

const basis: Basis = { family: 'beta-bezier', lambda: 1 };
const points = [[0, 0], [2, 3], [5, 3], [6, 0]];
const through = await client.POST('/v1/interpolate', { body: { points, basis }, params: { query: { precision: 'single' } } });
assert.ok(through.data, JSON.stringify(through.error));
assert.equal(told(through.data.curve), '3 segments of beta-bezier');

// The output of a call is the input of the next.
const sampling = { kind: 'count', count: 5 } as const;
const samples = await client.POST('/v1/evaluate', { body: { curve: through.data.curve, sampling } });
assert.deepEqual(samples.data?.points[4], [6, 0]);

const wrong = await client.POST('/v1/evaluate', { body: { curve: { family: 'bezier', control_points: [[0, 0]] }, sampling } });
assert.ok(wrong.error);
assert.equal(wrong.error.status, 422);
assert.equal(wrong.error.errors[0]?.pointer, '/curve/control_points');
console.log('openapi-fetch with openapi-typescript: ok');
