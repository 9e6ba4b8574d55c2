//! `basis`.

use crate::api::cost::{Cost, Costed, Kind};
use crate::api::error::{Error, Locate, both};
use crate::api::json::Request;
use crate::api::operations::Example;
use crate::api::operations::{Operation, Output};
use crate::api::wire::{Basis, Whole, list, part, whole};
use crate::core::basis::Properties;
use crate::core::basis_functions as core;
use crate::core::check::within_degrees;
use crate::core::context::Context;
use crate::core::limits;

crate::object! {
    /// A basis to sample.
    pub struct BasisRequest {
        /// The basis.
        required basis: Basis,
        /// One less than the number of control points; 1 to 64.
        required order: Whole = whole(1, limits::DEGREE),
        /// How many equally spaced samples, 2 to 200,000; default 101.
        optional count: Whole = whole(2, limits::SAMPLES),
    }
}

crate::names! {
    /// A property of a basis, or of the curves it makes.
    pub enum PropertyName {
        /// Proposition 1.
        Nonnegative = "nonnegative",
        /// Proposition 2.
        PartitionOfUnity = "partition-of-unity",
        /// Proposition 3.
        Symmetric = "symmetric",
        /// Proposition 4.
        LinearlyIndependent = "linearly-independent",
        /// Proposition 5.
        DegeneratesToBernstein = "degenerates-to-bernstein",
        /// Section 2.3 (b), (c).
        AffineInvariant = "affine-invariant",
        /// Section 2.3 (e).
        ConvexHull = "convex-hull",
        /// Section 2.3 (d).
        SymmetricCurve = "symmetric-curve",
        /// Proposition 6.
        InterpolatesEndPoints = "interpolates-end-points",
        /// Proposition 7.
        TangentToEndEdges = "tangent-to-end-edges",
    }
}

crate::answer! {
    /// A row of Chen 2013 Table 1.
    pub struct Property {
        /// The property.
        required name: PropertyName,
        /// What it requires of the shape matrix M with entries m_ij, degree d and order n, and
        /// where that is shown.
        required requires: Requirement,
        /// Whether this matrix has it, to 1e-12.
        required holds: bool,
    }
}
crate::nested!(answer Property);

crate::names! {
    /// A requirement of Chen 2013.
    pub enum Requirement {
        /// Eq. (9).
        Nonnegative = "m_ij >= 0 (Proposition 1)",
        /// Eq. (11).
        RowSums = "every row sums to 1 (Proposition 2)",
        /// Eq. (13).
        Symmetry = "m_ij = m_(d-i)(n-j) (Proposition 3)",
        /// Eq. (15).
        Rank = "rank n + 1 (Proposition 4)",
        /// Eq. (18).
        Elevation = "M is the matrix of degree elevation (Proposition 5)",
        /// Propositions 1 and 2.
        ConvexCombinations = "rows are non-negative and sum to 1 (Propositions 1 and 2)",
        /// Eq. (20), (21).
        UnitEndRows = "first and last row are unit rows (Proposition 6)",
        /// Eq. (26), (27).
        EndEdges = "m_10 + m_11 = 1 with m_10 < 1, and the mirror image (Proposition 7)",
    }
}

crate::answer! {
    /// The basis functions, and what they promise.
    pub struct BasisAnswer {
        /// The degree d of the functions.
        required degree: Whole,
        /// First and last parameter.
        required domain: Vec<f64> = list::<f64>(2, 2),
        /// The parameters sampled.
        required parameters: Vec<f64>,
        /// `functions[j][i]`: basis function j at `parameters[i]`.
        required functions: Vec<Vec<f64>>,
        /// The shape matrix M, row after row: function j is the sum over i of m_ij times Bernstein
        /// polynomial i of degree d.
        required shape_matrix: Vec<Vec<f64>>,
        /// Its 2-norm condition number; left out where it lacks rank.
        optional condition: f64,
        /// Chen 2013 Table 1 for this matrix.
        required properties: Vec<Property>,
    }
}

impl Output for BasisAnswer {}

/// The request bodies that the specification shows.
pub const EXAMPLES: &[Example] = &[
    Example::new(
        "chen-figure-4",
        "Order 3 and degree 4 (Chen 2013 Figure 4)",
        include_str!("../../../openapi/examples/basis-chen-figure-4.json"),
    ),
    Example::new(
        "li-figure-1",
        "alpha = 0.4, beta = 3 (Li 2014 Figure 1)",
        include_str!("../../../openapi/examples/basis-li-figure-1.json"),
    ),
];

/// Look at a basis.
#[derive(Debug, Clone, Copy)]
pub struct BasisOperation;

impl Operation for BasisOperation {
    type Request = BasisRequest;
    type Answer = BasisAnswer;
    const PATH: &str = "/v1/basis";
    const ID: &str = "basis";
    const TAG: &str = "Curves";
    const SUMMARY: &str = "Look at a basis";
    const DESCRIPTION: &str = "\
        Its functions, sampled; its shape matrix; and which of the properties of Chen 2013 \
        Table 1 it has. Cost: samples times degree times order.";
    const ANSWERED: &str = "The basis.";
    const EXAMPLES: &[Example] = EXAMPLES;

    fn compute(context: &Context, request: BasisRequest) -> Result<BasisAnswer, Error> {
        let (basis, order, count) = parts(context, request.basis, request.order, request.count)?;
        let sampled = core::basis_functions(context, &basis, order, count)?;
        Ok(BasisAnswer {
            degree: Whole(sampled.degree),
            domain: vec![sampled.domain.0, sampled.domain.1],
            parameters: sampled.parameters,
            functions: sampled.values,
            shape_matrix: sampled.matrix.rows().map(<[f64]>::to_vec).collect(),
            condition: sampled.condition.is_finite().then_some(sampled.condition),
            properties: table(sampled.properties),
        })
    }

    fn is_small(request: &BasisRequest) -> bool {
        request.order.is_none_or(|order| order.0 <= 16)
            && request.count.is_none_or(|count| count.0 <= 100)
    }
}

impl Costed for BasisRequest {
    fn cost(&self) -> Cost {
        let order = self.order.map_or(1, |order| order.0.min(64)) as f64;
        Cost::new(
            Kind::Segments,
            30.0 * self.count.map_or(100, |count| count.0) as f64 * order * (order + 1.0),
        )
    }
}

impl Request for BasisRequest {
    fn check(self, context: &Context) -> Result<(), Error> {
        parts(context, self.basis, self.order, self.count).map(drop)
    }
}

fn parts(
    context: &Context,
    basis: Option<Basis>,
    order: Option<Whole>,
    count: Option<Whole>,
) -> Result<(crate::core::basis::Basis, usize, usize), Error> {
    let count = count.map_or(101, |whole| whole.0);
    let order =
        part(order, "order", |order| within_degrees(context, "order", order.0).map(|()| order.0));
    let ((basis, order), ()) = both(
        both(part(basis, "basis", |value| value.parse(context)), order),
        core::check_count(context, count).at("count"),
    )?;
    Ok((basis, order, count))
}

/// Chen 2013 Table 1, but for the row that counts parameters.
fn table(p: Properties) -> Vec<Property> {
    use PropertyName as N;
    use Requirement as R;
    let hull = p.nonnegative && p.partition_of_unity;
    let rows = [
        (N::Nonnegative, R::Nonnegative, p.nonnegative),
        (N::PartitionOfUnity, R::RowSums, p.partition_of_unity),
        (N::Symmetric, R::Symmetry, p.symmetric),
        (N::LinearlyIndependent, R::Rank, p.linearly_independent),
        (N::DegeneratesToBernstein, R::Elevation, p.degenerates_to_bernstein),
        (N::AffineInvariant, R::RowSums, p.partition_of_unity),
        (N::ConvexHull, R::ConvexCombinations, hull),
        (N::SymmetricCurve, R::Symmetry, p.symmetric),
        (N::InterpolatesEndPoints, R::UnitEndRows, p.interpolates_end_points),
        (N::TangentToEndEdges, R::EndEdges, p.tangent_to_end_edges),
    ];
    rows.map(|(name, requires, holds)| Property { name, requires, holds }).into()
}
