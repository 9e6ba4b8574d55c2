//! The arguments of the core's functions, as a fault names them.

use std::fmt;

macro_rules! arguments {
    ($($(#[$doc:meta])* $name:ident $words:literal,)*) => {
        /// An argument of a function of the core, or a part of one.
        #[derive(Debug, Clone, Copy, PartialEq, Eq)]
        pub enum Argument {
            $($(#[$doc])* $name,)*
        }

        impl Argument {
            /// Every argument.
            pub const ALL: &[Argument] = &[$(Argument::$name),*];
        }

        impl fmt::Display for Argument {
            fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
                f.write_str(match self {
                    $(Argument::$name => $words,)*
                })
            }
        }
    };
}

arguments! {
    /// The shape parameter alpha.
    Alpha "alpha",
    /// The bases of several segments.
    Bases "bases",
    /// A basis.
    Basis "basis",
    /// The shape parameter beta.
    Beta "beta",
    /// Whether a curve closes.
    Closed "closed",
    /// The control points of a surface, in rows.
    ControlNet "control net",
    /// The control points of a curve.
    ControlPoints "control points",
    /// How many are asked for.
    Count "count",
    /// A curve.
    Curve "curve",
    /// Several curves.
    Curves "curves",
    /// Where to cut.
    Cuts "cuts",
    /// The degree of a curve or a family.
    Degree "degree",
    /// How often to halve.
    Depth "depth",
    /// The order of derivatives.
    Derivatives "derivatives",
    /// What holds at the ends.
    Ends "ends",
    /// What holds at the end.
    End "end",
    /// A family of bases.
    Family "family",
    /// The form of pieces.
    Form "form",
    /// What a change keeps.
    Keep "keep",
    /// A knot vector.
    Knots "knots",
    /// The shape parameter lambda.
    Lambda "lambda",
    /// The shape parameters of a Quasi-Bezier curve by elevation.
    Lambdas "lambdas",
    /// The order of a basis.
    Order "order",
    /// Whether parameters are corrected.
    ParameterCorrection "parameter correction",
    /// How points get their parameters.
    Parameterization "parameterization",
    /// Parameters along a curve or a surface.
    Parameters "parameters",
    /// Where a surface is evaluated.
    Places "places",
    /// Points to pass or to come near.
    Points "points",
    /// What is evaluated.
    Quantities "quantities",
    /// The rows of a shape matrix.
    Rows "rows",
    /// Where a curve is evaluated.
    Sampling "sampling",
    /// The shape matrix that a recursion starts from.
    Seed "seed",
    /// The class that joints are given.
    Smoothness "smoothness",
    /// What a fit looks for.
    Solve "solve",
    /// How near is near enough.
    Tolerance "tolerance",
    /// The first direction of a surface.
    U "u",
    /// What holds at the start.
    Start "start",
    /// The upper half of a symmetric shape matrix.
    UpperRows "upper rows",
    /// The second direction of a surface.
    V "v",
    /// Weights, one for each point.
    Weights "weights",
}
