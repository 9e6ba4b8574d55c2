//! Parameterizations and end conditions on the wire.

use crate::api::error::{Error, Locate};
use crate::api::wire::field::need;
use crate::api::wire::points::Vector;
use crate::core::interpolate::End;
use crate::core::parameterization as core;

crate::union! {
    /// How the points get their parameters; default chord-length.
    pub struct Parameterization by kind: ParameterizationKind {
        /// One knot per point, strictly increasing; a closed curve has one more, where it returns
        /// to the first point.
        knots: Vec<f64>,
    }
    /// 0, 1, 2, ...: blind to distances.
    "uniform" Uniform as UniformParameterization: [] [];
    /// Sums of the distances between neighbours.
    "chord-length" ChordLength as ChordLengthParameterization: [] [];
    /// Sums of the square roots of the distances (Lee 1989).
    "centripetal" Centripetal as CentripetalParameterization: [] [];
    /// Given.
    "knots" Knots as KnotsParameterization: [knots] [];
}

impl Parameterization {
    /// The core's rule.
    ///
    /// # Errors
    /// A missing or foreign field.
    pub fn parse(self) -> Result<core::Parameterization, Error> {
        Ok(match self.kind()? {
            ParameterizationKind::Uniform => core::Parameterization::Uniform,
            ParameterizationKind::ChordLength => core::Parameterization::ChordLength,
            ParameterizationKind::Centripetal => core::Parameterization::Centripetal,
            ParameterizationKind::Knots => {
                core::Parameterization::Given(need(self.knots, "knots")?)
            }
        })
    }

    /// What a request without one gets.
    pub fn default_rule() -> Self {
        Self::of(ParameterizationKind::ChordLength)
    }
}

crate::union! {
    /// What holds at one end of an open curve; default natural.
    pub struct EndCondition by kind: EndKind {
        /// The first derivative there, with respect to the parameter that the parameterization
        /// gives.
        vector: Vector,
    }
    /// The second derivative vanishes.
    "natural" Natural as NaturalEnd: [] [];
    /// The two segments nearest to the end are one cubic. Needs 3 points, at both ends 4.
    "not-a-knot" NotAKnot as NotAKnotEnd: [] [];
    /// The first derivative is given.
    "derivative" Derivative as DerivativeEnd: [vector] [];
}

impl EndCondition {
    /// The core's condition.
    ///
    /// # Errors
    /// A missing or foreign field, a vector of another dimension than the points.
    pub fn parse<const D: usize>(&self) -> Result<End<D>, Error> {
        Ok(match self.kind()? {
            EndKind::Natural => End::Natural,
            EndKind::NotAKnot => End::NotAKnot,
            EndKind::Derivative => {
                End::Derivative(need(self.vector, "vector")?.of_dimension().at("vector")?)
            }
        })
    }

    /// What a request without one gets.
    pub fn default_end() -> Self {
        Self::of(EndKind::Natural)
    }
}
