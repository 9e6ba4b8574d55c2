//! An operation of the table as the specification describes it.

use utoipa::openapi::path::{HttpMethod, Operation as Posted, OperationBuilder, PathItem};
use utoipa::openapi::request_body::RequestBodyBuilder;
use utoipa::openapi::response::ResponseBuilder;
use utoipa::openapi::schema::{ObjectBuilder, Ref, Schema, Type};
use utoipa::openapi::{Content, RefOr, Required};
use utoipa::{IntoResponses, ToSchema};

use super::{JSON, describe_body, output_parameters, raw_content};
use crate::api::operations::{Operation, Output, OutputKind, Visitor};
use crate::api::output::RAW;
use crate::api::problem::Problems;

/// Describes every operation: its path, what is there, and the schemas that this refers to.
pub struct Describe;

type Schemas = Vec<(String, RefOr<Schema>)>;

impl Visitor for Describe {
    type Made = (&'static str, PathItem, Schemas);

    fn visit<O: Operation>(&self) -> Self::Made {
        let mut schemas = Schemas::new();
        collect::<O::Request>(&mut schemas);
        if O::Answer::KIND == OutputKind::Object {
            collect::<O::Answer>(&mut schemas);
        }
        (O::PATH, PathItem::new(HttpMethod::Post, described::<O>()), schemas)
    }
}

/// The schema of a type and those it refers to.
fn collect<T: ToSchema>(schemas: &mut Schemas) {
    schemas.push((T::name().into(), T::schema()));
    T::schemas(schemas);
}

fn described<O: Operation>() -> Posted {
    let json = Content::new(Some(Ref::from_schema_name(O::Request::name())));
    let mut body =
        RequestBodyBuilder::new().content(JSON, json).required(Some(Required::True)).build();
    describe_body(&mut body, O::EXAMPLES);
    let answered = ResponseBuilder::new().description(O::ANSWERED);
    let (answered, parameters) = match O::Answer::KIND {
        OutputKind::Object => {
            let json = Content::new(Some(Ref::from_schema_name(O::Answer::name())));
            (answered.content(JSON, json).content(RAW, raw_content()), Some(output_parameters()))
        }
        OutputKind::Picture => {
            let text = ObjectBuilder::new().schema_type(Type::String);
            (answered.content("image/svg+xml", Content::new(Some(text))), None)
        }
    };
    let mut operation = OperationBuilder::new()
        .tag(O::TAG)
        .summary(Some(O::SUMMARY))
        .description(Some(O::DESCRIPTION))
        .operation_id(Some(O::ID))
        .request_body(Some(body))
        .response("200", answered)
        .build();
    operation.responses.responses.extend(Problems::responses());
    operation.parameters = parameters;
    operation
}
