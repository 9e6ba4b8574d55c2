//! Descents to a stationary point of the sum of squares over curve and parameters.
//!
//! Steps of Newton, or of Gauss and Newton, with the parameters eliminated (see
//! [`newton`](super::newton)), damped after Levenberg and Marquardt by the exact gain (More 1978).
//! Each is tried with the curve solved anew for the parameters it leads to: variable projection
//! (Golub and Pereyra 1973).

use super::data::Data;
use super::freedom::Freedom;
use super::newton::{At, Matrix, NewtonStep, Space};
use super::offsets::Scene;
use super::{CORRECTION_ROUNDS, STATIONARY, Solved, Solver};
use crate::core::basis::{Basis, Bezier};
use crate::core::context::Context;
use crate::core::curve::Single;
use crate::core::error::Error;
use crate::core::point::{Point, magnitude};

/// The damping of the first step.
const DAMPING: f64 = 1e-3;
/// The least damping, the least after a step that failed, and the most.
const DAMPINGS: [f64; 3] = [1e-12, 1e-6, 1e12];
/// The first rounds go without second derivatives, which far from a minimum lead astray.
const GAUSS: usize = 15;
/// Rounds without solving the curve anew.
const JOINT: usize = 80;
/// Sums of squares this close are the same up to rounding.
const SAME: f64 = 1e-13;
/// Roundings of the offsets that hide a gradient.
const ROUNDINGS: f64 = 16.0;
/// Control points further from the data than this many times their size have run away.
const FARTHEST: f64 = 1e9;
/// A gradient above this is none, however large the control points and so their roundings are.
const ALMOST: f64 = 1e-6;
/// So many rounds show whether a descent will get below the best, at this many times their pace.
const OUTLOOK: (usize, f64) = (20, 8.0);

/// A curve for some parameters, and the weighted sum of squares.
pub(super) struct State<const D: usize> {
    pub(super) solved: Solved<D>,
    pub(super) parameters: Vec<f64>,
    pub(super) squares: f64,
}

/// Where a descent ended.
pub(super) struct Descent<const D: usize> {
    pub(super) state: State<D>,
    pub(super) rounds: usize,
    /// The largest cosine between the offsets and what a free parameter does to them, and below
    /// what it is zero.
    pub(super) gradient: f64,
    pub(super) tolerance: f64,
}

/// What descents share.
pub(super) struct Search<'a, const D: usize> {
    /// The most rounds of one descent.
    pub(super) rounds: usize,
    scene: Scene<'a, D>,
    pub(super) solver: &'a dyn Solver<D>,
}

impl<'a, const D: usize> Search<'a, D> {
    pub(super) fn new(data: &'a Data<D>, solver: &'a dyn Solver<D>) -> Self {
        Search { rounds: CORRECTION_ROUNDS, scene: Scene::new(data, solver.length()), solver }
    }

    pub(super) fn data(&self) -> &'a Data<D> {
        self.scene.data
    }

    pub(super) fn state(
        &self,
        context: &Context,
        solved: Solved<D>,
        parameters: Vec<f64>,
    ) -> Result<State<D>, Error> {
        let squares = self.scene.squares(context, &solved.curve, &parameters)?;
        Ok(State { solved, parameters, squares })
    }

    /// The state for parameters; none where they determine no curve, or one that runs away.
    pub(super) fn at(
        &self,
        context: &Context,
        parameters: Vec<f64>,
    ) -> Result<Option<State<D>>, Error> {
        let solved = self.solver.solve(context, self.scene.data, &parameters);
        context.checkpoint()?;
        let Ok(solved) = solved else { return Ok(None) };
        let [points, ..] = self.scene.derivatives(&solved.curve);
        if magnitude(&points) > FARTHEST {
            return Ok(None);
        }
        let state = self.state(context, solved, parameters)?;
        Ok(Some(state).filter(|state| state.squares.is_finite()))
    }

    /// Steps until the gradient is below its tolerance, or no step leads further, or, with a sum to
    /// get below, until that is out of sight.
    pub(super) fn descend(
        &self,
        context: &Context,
        start: State<D>,
        goal: Option<f64>,
    ) -> Result<Descent<D>, Error> {
        let mut state = start;
        let (mut damping, mut before) = (DAMPING, state.squares);
        let mut round = 0;
        loop {
            let at = self.place(&state);
            let (gradient, tolerance) = self.gradient(context, &at, &state)?;
            let ends = round == self.rounds || damping > DAMPINGS[2];
            let ends = ends || gradient <= tolerance || !gradient.is_finite();
            if ends || (round % OUTLOOK.0 == OUTLOOK.0 - 1 && is_hopeless(&state, before, goal)) {
                return Ok(Descent { state, rounds: round, gradient, tolerance });
            }
            if round % OUTLOOK.0 == 0 {
                before = state.squares;
            }
            round += 1;
            let space = Space::new(
                context,
                self.solver.freedom(&state.solved.curve, self.scene.data),
                &at,
            )?;
            let matrices: &[_] =
                if round <= GAUSS { &[Matrix::Gauss] } else { &[Matrix::Newton, Matrix::Gauss] };
            let step = first_step(context, &at, &space, matrices, damping)?;
            // Near a minimum rounding hides whether a step leads down.
            let hidden = SAME * state.squares;
            let Some(NewtonStep { parameters, decrease, .. }) =
                step.filter(|step| step.decrease > -hidden)
            else {
                damping = (damping * 8.0).max(DAMPINGS[1]);
                continue;
            };
            match self.at(context, parameters)? {
                Some(trial) if self.is_better(context, &trial, &state, gradient)? => {
                    let gain = if decrease > hidden {
                        0.5 * (state.squares - trial.squares) / decrease
                    } else {
                        1.0
                    };
                    damping = damped(damping, gain);
                    state = trial;
                }
                _ => damping = (damping * 8.0).max(DAMPINGS[1]),
            }
        }
    }

    /// The better of what was found and what another start leads to.
    pub(super) fn improved(
        &self,
        context: &Context,
        best: Descent<D>,
        start: Option<State<D>>,
    ) -> Result<Descent<D>, Error> {
        let Some(start) = start else { return Ok(best) };
        let other = self.descend(context, start, Some(best.state.squares))?;
        Ok(best.or(other))
    }

    /// Parameters that steps of Gauss and Newton lead to if the curve takes them too, and is not
    /// solved anew: another way down. For curves that may be any polynomial of their degree.
    pub(super) fn jointly(&self, context: &Context, start: &State<D>) -> Result<Vec<f64>, Error> {
        let mut damping = DAMPING;
        let (mut parameters, mut squares) = (start.parameters.clone(), start.squares);
        let mut curve =
            Single::new(context, Basis::Bezier(Bezier), start.solved.curve.bezier_points())?;
        let matrix = Basis::Bezier(Bezier).shape_matrix(curve.order());
        for _ in 0..JOINT {
            let derivatives = self.scene.derivatives(&curve);
            let at = At { scene: &self.scene, derivatives, parameters: &parameters };
            let space = Space::plain(Freedom::of_control_points(&matrix, self.scene.data.ends));
            let sums = at.sums(context, &space, Matrix::Gauss, damping)?;
            let Some(step) = at.step(context, &space, &sums, Matrix::Gauss, damping, damping)?
            else {
                damping *= 4.0;
                continue;
            };
            let moved = curve.control_points().iter().zip(&step.change);
            let points = moved.map(|(&p, &v)| p + self.scene.enlarged(v)).collect();
            let Ok(next) = Single::new(context, Basis::Bezier(Bezier), points) else { break };
            let next_squares = self.scene.squares(context, &next, &step.parameters)?;
            if next_squares < squares {
                damping = (damping / 3.0).max(DAMPINGS[0]);
                (curve, parameters, squares) = (next, step.parameters, next_squares);
            } else {
                damping *= 4.0;
            }
        }
        Ok(parameters)
    }

    fn place<'b>(&'b self, state: &'b State<D>) -> At<'b, D> {
        let derivatives = self.scene.derivatives(&state.solved.curve);
        At { scene: &self.scene, derivatives, parameters: &state.parameters }
    }

    /// A smaller sum; or one that is the same up to rounding, with a smaller gradient.
    fn is_better(
        &self,
        context: &Context,
        trial: &State<D>,
        state: &State<D>,
        gradient: f64,
    ) -> Result<bool, Error> {
        if trial.squares < state.squares * (1.0 - SAME) {
            return Ok(true);
        }
        if trial.squares > state.squares * (1.0 + SAME) {
            return Ok(false);
        }
        Ok(self.gradient(context, &self.place(trial), trial)?.0 < gradient)
    }

    /// See [`Descent::gradient`].
    pub(super) fn gradient_of(
        &self,
        context: &Context,
        state: &State<D>,
    ) -> Result<(f64, f64), Error> {
        self.gradient(context, &self.place(state), state)
    }

    /// The largest cosine between the offsets and what a parameter does to them (More et al.
    /// 1980, `gtol`), and below what it is zero.
    fn gradient(
        &self,
        context: &Context,
        at: &At<D>,
        state: &State<D>,
    ) -> Result<(f64, f64), Error> {
        let length = state.squares.sqrt();
        let rounding = |points: &[Point<D>]| ROUNDINGS * self.scene.rounding(points);
        let of_data = rounding(&self.scene.data.points);
        if length <= of_data {
            return Ok((0.0, STATIONARY));
        }
        let of_curve = rounding(&state.solved.curve.bezier_points());
        let tolerance = (of_curve / length).min(ALMOST).max(of_data / length).max(STATIONARY);
        Ok((at.steepest(context)? / length, tolerance))
    }
}

impl<const D: usize> Descent<D> {
    /// The better of two, with the rounds of both. A stationary point is left for one that is not
    /// only where that lowers the sum by more than its tolerance.
    pub(super) fn or(self, other: Self) -> Self {
        let rounds = self.rounds + other.rounds;
        let leaves = self.is_stationary() && !other.is_stationary();
        let worthwhile = if leaves { self.tolerance } else { SAME };
        let lower = other.state.squares < self.state.squares * (1.0 - worthwhile);
        Descent { rounds, ..if lower { other } else { self } }
    }

    fn is_stationary(&self) -> bool {
        self.gradient <= self.tolerance
    }
}

/// Whether the pace of the last rounds, kept up for some more, would not lead below the goal.
fn is_hopeless<const D: usize>(state: &State<D>, before: f64, goal: Option<f64>) -> bool {
    goal.is_some_and(|goal| state.squares - OUTLOOK.1 * (before - state.squares) > goal)
}

/// The damping after a step that gained this part of what it promised.
fn damped(damping: f64, gain: f64) -> f64 {
    match gain {
        _ if gain > 0.75 => (damping / 5.0).max(DAMPINGS[0]),
        _ if gain < 0.25 => damping * 4.0,
        _ => damping,
    }
}

/// The step of the first matrix that is positive definite.
fn first_step<const D: usize>(
    context: &Context,
    at: &At<D>,
    space: &Space<D>,
    matrices: &[Matrix],
    damping: f64,
) -> Result<Option<NewtonStep<D>>, Error> {
    for &matrix in matrices {
        let sums = at.sums(context, space, matrix, damping)?;
        if let Some(step) = at.step(context, space, &sums, matrix, damping, 0.0)? {
            return Ok(Some(step));
        }
    }
    Ok(None)
}
