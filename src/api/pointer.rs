//! Where a fault is in a request: core arguments to fields.

use std::fmt;

use crate::core::argument::Argument;
use crate::core::error::Step;

/// What a step of a place is called: by the contract, or still by the core.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Name {
    /// A field.
    Field(&'static str),
    /// An argument of the core, which the operation has yet to name.
    Argument(Argument),
}

impl From<&'static str> for Step<Name> {
    fn from(field: &'static str) -> Self {
        Step::Name(Name::Field(field))
    }
}

impl fmt::Display for Name {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match *self {
            Name::Field(field) => field,
            Name::Argument(argument) => field(argument),
        })
    }
}

/// The field that an argument comes from, unless an operation says otherwise.
pub const fn field(argument: Argument) -> &'static str {
    match argument {
        Argument::Alpha => "alpha",
        Argument::Bases => "bases",
        Argument::Basis => "basis",
        Argument::Beta => "beta",
        Argument::Closed => "closed",
        Argument::ControlNet => "control_net",
        Argument::ControlPoints => "control_points",
        Argument::Count => "count",
        Argument::Curve => "curve",
        Argument::Curves => "curves",
        Argument::Cuts | Argument::Places => "at",
        Argument::Degree => "degree",
        Argument::Depth => "depth",
        Argument::Derivatives => "derivatives",
        Argument::End => "end",
        Argument::Ends => "ends",
        Argument::Family => "family",
        Argument::Form => "form",
        Argument::Keep => "keep",
        Argument::Knots => "knots",
        Argument::Lambda => "lambda",
        Argument::Lambdas => "lambdas",
        Argument::Order => "order",
        Argument::ParameterCorrection => "parameter_correction",
        Argument::Parameterization => "parameterization",
        Argument::Parameters => "values",
        Argument::Points => "points",
        Argument::Quantities => "quantities",
        Argument::Rows => "rows",
        Argument::Sampling => "sampling",
        Argument::Seed => "seed",
        Argument::Smoothness => "smoothness",
        Argument::Solve => "solve",
        Argument::Start => "start",
        Argument::Tolerance => "tolerance",
        Argument::U => "u",
        Argument::UpperRows => "upper_rows",
        Argument::V => "v",
        Argument::Weights => "weights",
    }
}

#[cfg(test)]
mod tests {
    use crate::api::chunks::Buffer;
    use crate::api::memory;
    use crate::api::operations;
    use crate::api::output::Format;
    use crate::core::context::Context;

    /// Where the operation sees the fault of a request.
    fn pointer(operation: &str, body: &str) -> String {
        let context = Context::default();
        let mut buffer = Buffer::new(&context, &memory::unlimited());
        let entry = operations::named(operation).unwrap();
        let problem = (entry.answer)(&context, body.as_bytes(), Format::default(), &mut buffer);
        let problem = serde_json::to_value(problem.unwrap_err()).unwrap();
        problem["errors"][0]["pointer"].as_str().unwrap().to_owned()
    }

    /// All of these ask the same function of the core for the way back to control points.
    #[test]
    fn operations_that_share_a_function_of_the_core_point_each_into_its_own_request() {
        const LINE: &str = r#"{"family":"bezier","control_points":[[0,0],[1,2],[2,2],[3,0]]}"#;
        const FLAT: &str = r#"{"family":"beta-bezier","beta":1e9}"#;
        let curve = FLAT.replace('}', r#","control_points":[[0,0],[1,2],[2,2],[3,0]]}"#);
        let at = |operation, body: String| pointer(operation, &body);
        assert_eq!(at("convert", format!(r#"{{"curve":{LINE},"to":{FLAT}}}"#)), "/to");
        let cut = format!(
            r#"{{"curve":{curve},"at":{{"kind":"parameters","values":[0.5]}},"form":"family"}}"#
        );
        assert_eq!(at("subdivide", cut), "/form");
        let points = "[[0,0],[1,2],[2,2],[3,0],[5,1]]";
        let body = format!(r#"{{"points":{points},"basis":{FLAT}}}"#);
        assert_eq!(at("interpolate", body), "/basis");
        let solve = format!(r#"{{"kind":"tolerance","basis":{FLAT},"tolerance":0.1}}"#);
        let body = format!(r#"{{"points":{points},"solve":{solve}}}"#);
        assert_eq!(at("fit", body), "/solve/basis");
        let body = format!(r#"{{"curve":{LINE},"basis":{FLAT},"keep":"c2"}}"#);
        assert_eq!(at("reshape", body), "/keep");
    }
}
