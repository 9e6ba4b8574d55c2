//! The specification for clients that speak JSON alone, which is what generators make of it.

use std::collections::BTreeSet;

use utoipa::openapi::path::Operation;
use utoipa::openapi::schema::Schema;
use utoipa::openapi::{OpenApi, RefOr};

use super::references;

/// The operations that take JSON and answer with JSON, in the nested layout: no raw format, no
/// lines, no pictures.
pub fn json_only(mut api: OpenApi) -> OpenApi {
    api.paths.paths.retain(|_, item| {
        let operation = item.post.as_mut().or(item.get.as_mut());
        operation.is_some_and(|operation| {
            strip(operation);
            super::answer(operation, "200").is_some_and(|answer| !answer.content.is_empty())
        })
    });
    leave_out_unused(&mut api);
    api
}

fn strip(operation: &mut Operation) {
    if let Some(RefOr::T(body)) = operation.request_body.as_mut() {
        body.content.retain(|media_type, _| media_type == super::JSON);
    }
    if let Some(parameters) = operation.parameters.as_mut() {
        parameters.retain(
            |parameter| matches!(parameter, RefOr::T(parameter) if parameter.name != "layout"),
        );
    }
    let Some(answer) = super::answer(operation, "200") else { return };
    answer.content.retain(|media_type, _| media_type == super::JSON);
    if let Some(content) = super::content(answer, super::JSON)
        && let Some(RefOr::T(Schema::AnyOf(either))) = content.schema.as_mut()
    {
        content.schema = Some(either.items.swap_remove(0));
    }
}

/// Leaves out the schemas that nothing leads to any more.
fn leave_out_unused(api: &mut OpenApi) {
    let Some(components) = api.components.as_mut() else { return };
    let mut used = BTreeSet::from(["Problem".to_owned()]);
    let mut open: Vec<String> = used.iter().cloned().collect();
    for item in api.paths.paths.values() {
        let operation = item.post.as_ref().or(item.get.as_ref());
        let body = operation.and_then(|operation| operation.request_body.as_ref()).into_iter();
        let bodies = body.flat_map(|body| {
            if let RefOr::T(body) = body { body.content.values().collect() } else { Vec::new() }
        });
        let answers =
            operation.into_iter().flat_map(|operation| operation.responses.responses.values());
        let answers = answers.flat_map(|answer| {
            if let RefOr::T(answer) = answer {
                answer.content.values().collect()
            } else {
                Vec::new()
            }
        });
        for content in bodies.chain(answers) {
            if let RefOr::T(content) = content {
                open.extend(content.schema.iter().flat_map(references::names).map(str::to_owned));
            }
        }
    }
    while let Some(name) = open.pop() {
        if let Some(schema) = components.schemas.get(&name) {
            let inner = references::names(schema)
                .into_iter()
                .filter(|inner| !used.contains(*inner))
                .map(str::to_owned);
            open.extend(inner.collect::<Vec<_>>());
        }
        used.insert(name);
    }
    components.schemas.retain(|name, _| used.contains(name));
}
