//! Bases and shape matrices on the wire.

use crate::api::error::{Error, Fault, Locate, both, every};
use crate::api::wire::field::{Whole, need, number, whole};
use crate::core::basis as core;
use crate::core::context::Context;
use crate::core::fault::Fault as CoreFault;
use crate::core::limits;

crate::union! {
    /// A shape matrix: how the basis functions of a quasi-bezier curve are made of Bernstein
    /// polynomials. Entries are 0 or more, every row sums to 1 (within 1e-12), and the matrix has
    /// full rank.
    pub struct Shape by kind: ShapeKind {
        /// Every row, first to last: degree + 1 rows of one entry per control point.
        rows: Vec<Vec<f64>>,
        /// The degree of the curve, at least 2 and at most 64.
        degree: Whole = whole(2, limits::DEGREE),
        /// Rows 1 to floor(degree / 2); row 0 is the unit row and the lower rows mirror the upper
        /// ones. For an even degree the last row given is its own mirror image.
        upper_rows: Vec<Vec<f64>>,
        /// Every row of a matrix of lower order, raised to the order of the control polygon by Chen
        /// 2013 eq. (36).
        seed: Vec<Vec<f64>>,
        /// lambda_1 to lambda_n, one per edge of the control polygon, with i - n - 1 <= lambda_i <=
        /// i; all 0 is plain degree elevation. Symmetric where lambda_i = -lambda_(n+1-i).
        lambdas: Vec<f64>,
    }
    /// The matrix itself.
    "matrix" Matrix as MatrixShape: [rows] [];
    /// A symmetric matrix by its free rows (Chen 2013 eq. (29)).
    "symmetric" Symmetric as SymmetricShape: [degree, upper_rows] [];
    /// A small matrix, raised to the order of the control polygon (Chen 2013 eq. (36); Wu 2006).
    "recursive" Recursive as RecursiveShape: [seed] [];
    /// Degree elevation with one parameter per edge (Yang and Zeng 2009; Chen 2013 eq. (37));
    /// degree = order + 1.
    "elevation" Elevation as ElevationShape: [lambdas] [];
}

crate::union! {
    /// A basis: a family of curves with its shape parameters, without control points.
    pub struct Basis by family: BasisFamily {
        /// The shape parameter of Cheng et al. 2021, 0 or more: 0 is the Bezier curve, larger
        /// values pull the curve towards the segment between its end points. Exactly one of `beta`
        /// and `lambda` is given.
        beta: f64 = number().minimum(Some(0.0)),
        /// 1 / beta, 0 or more; 0 is the limit beta = infinity, the straight segment. Exactly one
        /// of `beta` and `lambda` is given.
        lambda: f64 = number().minimum(Some(0.0)),
        /// The length of the parameter domain, 0 < alpha <= 1. Together with beta it bends the
        /// curve through the product alpha * beta.
        alpha: f64 = number().exclusive_minimum(Some(0.0)).maximum(Some(1.0)),
        /// The shape matrix.
        shape: Shape,
    }
    /// Bernstein polynomials: no shape parameter.
    "bezier" Bezier as BezierBasis: [] [];
    /// Cheng et al. 2021: one shape parameter, any order.
    "beta-bezier" Beta as BetaBezierBasis: [] [beta, lambda] either [beta as BetaBezierBasis, lambda as BetaBezierBasisByLambda];
    /// Li 2014: two shape parameters, cubic.
    "alpha-beta-bezier" AlphaBeta as AlphaBetaBezierBasis: [alpha, beta] [] where {
        /// The second shape parameter of Li 2014, 0 < beta <= 3; alpha = 1, beta = 3 is the Bezier
        /// curve.
        beta = li_beta(),
    };
    /// Chen 2013: the shape matrix is the parameter.
    "quasi-bezier" Quasi as QuasiBezierBasis: [shape] [];
}

/// The schema of the shape parameter beta of Li 2014.
pub fn li_beta() -> utoipa::openapi::schema::ObjectBuilder {
    number().exclusive_minimum(Some(0.0)).maximum(Some(3.0))
}

impl Shape {
    fn parse(self) -> Result<core::ShapeParameters, Error> {
        Ok(match self.kind()? {
            ShapeKind::Matrix => core::ShapeParameters::Matrix { rows: need(self.rows, "rows")? },
            ShapeKind::Symmetric => core::ShapeParameters::Symmetric {
                degree: need(self.degree, "degree")?.0,
                upper_rows: need(self.upper_rows, "upper_rows")?,
            },
            ShapeKind::Recursive => {
                core::ShapeParameters::Recursive { seed: need(self.seed, "seed")? }
            }
            ShapeKind::Elevation => {
                core::ShapeParameters::Elevation { lambdas: need(self.lambdas, "lambdas")? }
            }
        })
    }
}

impl From<&core::ShapeParameters> for Shape {
    fn from(shape: &core::ShapeParameters) -> Self {
        match shape.clone() {
            core::ShapeParameters::Matrix { rows } => {
                Shape { rows: Some(rows), ..Shape::of(ShapeKind::Matrix) }
            }
            core::ShapeParameters::Symmetric { degree, upper_rows } => Shape {
                degree: Some(Whole(degree)),
                upper_rows: Some(upper_rows),
                ..Shape::of(ShapeKind::Symmetric)
            },
            core::ShapeParameters::Recursive { seed } => {
                Shape { seed: Some(seed), ..Shape::of(ShapeKind::Recursive) }
            }
            core::ShapeParameters::Elevation { lambdas } => {
                Shape { lambdas: Some(lambdas), ..Shape::of(ShapeKind::Elevation) }
            }
        }
    }
}

impl Basis {
    /// The core's basis.
    ///
    /// # Errors
    /// Fields of another family, missing fields, shape parameters out of range.
    pub fn parse(self, context: &Context) -> Result<core::Basis, Error> {
        // A request may hold a hundred thousand bases, and the rank of a shape matrix takes
        // milliseconds.
        context.checkpoint()?;
        let family = self.kind();
        both(family, self.with_family(context)).map(|(_, basis)| basis)
    }

    fn with_family(self, context: &Context) -> Result<core::Basis, Error> {
        Ok(match self.tag()? {
            BasisFamily::Bezier => core::Basis::Bezier(core::Bezier),
            BasisFamily::Beta => core::Basis::Beta(match (self.beta, self.lambda) {
                (Some(beta), None) => core::Beta::from_beta(beta)?,
                (None, Some(lambda)) => core::Beta::from_lambda(lambda)?,
                (None, None) => return Err(Fault::Missing { field: "beta` or `lambda" }.into()),
                (Some(_), Some(_)) => {
                    let why = "beta and lambda = 1 / beta say the same thing; give one of them";
                    return Err(CoreFault::Contradiction(why.into())).at("lambda");
                }
            }),
            BasisFamily::AlphaBeta => core::Basis::AlphaBeta(core::AlphaBeta::new(
                need(self.alpha, "alpha")?,
                need(self.beta, "beta")?,
            )?),
            BasisFamily::Quasi => core::Basis::Quasi(
                core::Quasi::new(context, need(self.shape, "shape")?.parse().at("shape")?)
                    .at("shape")?,
            ),
        })
    }
}

impl From<&core::Basis> for Basis {
    fn from(basis: &core::Basis) -> Self {
        match basis {
            core::Basis::Bezier(_) => Basis::of(BasisFamily::Bezier),
            core::Basis::Beta(beta) => match beta.lambda() {
                Some(lambda) => Basis { lambda: Some(lambda), ..Basis::of(BasisFamily::Beta) },
                None => Basis { beta: Some(beta.beta()), ..Basis::of(BasisFamily::Beta) },
            },
            core::Basis::AlphaBeta(basis) => Basis {
                alpha: Some(basis.alpha()),
                beta: Some(basis.beta()),
                ..Basis::of(BasisFamily::AlphaBeta)
            },
            core::Basis::Quasi(basis) => {
                Basis { shape: Some(basis.shape().into()), ..Basis::of(BasisFamily::Quasi) }
            }
        }
    }
}

/// Parses a list of bases; each fault at its place in the list.
///
/// # Errors
/// As [`Basis::parse`]; more bases than [`limits::SEGMENTS`].
pub fn parse_list(context: &Context, bases: Vec<Basis>) -> Result<Vec<core::Basis>, Error> {
    crate::core::check::at_most(
        "bases",
        bases.len(),
        context.limits.segments,
        "Send the curve in parts",
    )?;
    every(bases.into_iter().enumerate().map(|(i, basis)| basis.parse(context).at(i)))
}

/// The bases of a request that takes `basis` for all segments or `bases`, one for each; bezier by
/// default.
///
/// # Errors
/// Both given; faults at their place in either.
pub fn bases(
    context: &Context,
    common: Option<Basis>,
    each: Option<Vec<Basis>>,
) -> Result<crate::core::curve::Bases, Error> {
    use crate::core::curve::Bases;
    match (common, each) {
        (Some(_), Some(_)) => {
            let why = "give `basis` for all segments, or `bases` with one for each, not both";
            Err(CoreFault::Contradiction(why.into())).at("bases")
        }
        (Some(basis), None) => Ok(Bases::Common(basis.parse(context).at("basis")?)),
        (None, Some(bases)) => Ok(Bases::PerSegment(parse_list(context, bases).at("bases")?)),
        (None, None) => Ok(Bases::Common(core::Basis::Bezier(core::Bezier))),
    }
}

/// A basis to convert to: one with its shape parameters, or just `"bezier"`.
#[derive(Debug, Clone)]
pub struct Target(Basis);

impl Target {
    /// The basis.
    pub fn into_basis(self) -> Basis {
        self.0
    }
}

impl<'de> crate::api::wire::Read<'de> for Target {
    fn read<D: serde::Deserializer<'de>>(
        reading: &crate::api::wire::Reading,
        deserializer: D,
    ) -> Result<Self, D::Error> {
        struct TargetVisitor<'r>(&'r crate::api::wire::Reading<'r>);
        impl<'de> serde::de::Visitor<'de> for TargetVisitor<'_> {
            type Value = Target;

            fn expecting(&self, f: &mut std::fmt::Formatter) -> std::fmt::Result {
                f.write_str("\"bezier\" or a basis")
            }

            fn visit_str<E: serde::de::Error>(self, name: &str) -> Result<Target, E> {
                match name {
                    "bezier" => Ok(Target(Basis::of(BasisFamily::Bezier))),
                    _ => Err(E::invalid_value(serde::de::Unexpected::Str(name), &self)),
                }
            }

            fn visit_map<A: serde::de::MapAccess<'de>>(self, map: A) -> Result<Target, A::Error> {
                <Basis as crate::api::wire::Read>::read(
                    self.0,
                    serde::de::value::MapAccessDeserializer::new(map),
                )
                .map(Target)
            }
        }
        deserializer.deserialize_any(TargetVisitor(reading))
    }
}

impl crate::api::writer::Written for Target {
    fn write_to(
        &self,
        writer: &mut crate::api::writer::Writer,
    ) -> Result<(), crate::api::unwritten::Unwritten> {
        self.0.write_to(writer)
    }
}

impl crate::api::wire::Field for Target {}

impl crate::api::wire::Described for Target {
    fn schema() -> utoipa::openapi::RefOr<utoipa::openapi::Schema> {
        use utoipa::openapi::schema::OneOfBuilder;
        OneOfBuilder::new()
            .item(crate::api::wire::constant("bezier"))
            .item(<Basis as crate::api::wire::Described>::schema())
            .into()
    }

    fn collect(components: &mut crate::api::wire::field::Components) {
        <Basis as crate::api::wire::Described>::collect(components);
    }
}
