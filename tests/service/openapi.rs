//! The specification: committed as generated, complete, and of one mind with the server.

use std::collections::BTreeSet;

use crate::support::*;
use serde_json::{Map, Value, json};
use springline::api::operations::TABLE;

#[test]
fn the_committed_specification_is_the_generated_one() {
    let path = concat!(env!("CARGO_MANIFEST_DIR"), "/openapi/openapi.json");
    let committed = std::fs::read_to_string(path).unwrap_or_default();
    let generated = String::from_utf8(binary().arg("openapi").output().unwrap().stdout).unwrap();
    if committed != generated {
        let line = committed
            .lines()
            .zip(generated.lines())
            .take_while(|(left, right)| left == right)
            .count()
            + 1;
        panic!(
            "openapi/openapi.json differs from the code from line {line} on; run: cargo run -- openapi > openapi/openapi.json"
        );
    }
}

#[test]
fn it_is_openapi_3_1_with_one_operation_for_each_example_table() {
    let api = specification();
    assert!(api["openapi"].as_str().unwrap().starts_with("3.1."));
    let posts: BTreeSet<&str> = paths(&api)
        .filter(|(path, item)| item.get("post").is_some() && *path != "/v1/batch")
        .map(|(path, _)| path)
        .collect();
    assert_eq!(posts, TABLE.iter().map(|entry| entry.path).collect());
    for (path, examples) in TABLE.iter().map(|entry| (entry.path, entry.examples)) {
        let shown =
            &api["paths"][path]["post"]["requestBody"]["content"]["application/json"]["examples"];
        assert_eq!(shown.as_object().unwrap().len(), examples.len(), "{path}");
        assert!(!examples.is_empty(), "{path}");
        assert_eq!(api["paths"][path]["post"]["requestBody"]["required"], true, "{path}");
    }
}

fn paths(api: &Value) -> impl Iterator<Item = (&str, &Value)> {
    api["paths"].as_object().unwrap().iter().map(|(path, item)| (path.as_str(), item))
}

fn operations(api: &Value) -> impl Iterator<Item = (&str, &str, &Value)> {
    paths(api).flat_map(|(path, item)| {
        item.as_object()
            .unwrap()
            .iter()
            .map(move |(method, operation)| (path, method.as_str(), operation))
    })
}

#[test]
fn every_operation_documents_every_status() {
    let api = specification();
    for (path, method, operation) in operations(&api) {
        let known = operation["responses"].as_object().unwrap();
        let wanted: &[&str] = if method == "post" {
            &["200", "400", "401", "406", "408", "413", "415", "422", "500", "503", "504"]
        } else {
            &["200"]
        };
        for status in wanted {
            let response = known
                .get(*status)
                .unwrap_or_else(|| panic!("{method} {path} does not document {status}"));
            assert!(!response["description"].as_str().unwrap().is_empty(), "{path} {status}");
            let media_type =
                if *status == "200" { media_type(path) } else { "application/problem+json" };
            assert!(response["content"][media_type]["schema"].is_object(), "{path} {status}");
        }
    }
}

#[test]
fn operations_have_unique_ids_tags_and_summaries() {
    let api = specification();
    let ids: Vec<&str> = operations(&api)
        .map(|(_, _, operation)| operation["operationId"].as_str().unwrap())
        .collect();
    assert_eq!(ids.iter().collect::<BTreeSet<_>>().len(), ids.len(), "{ids:?}");
    let tags: BTreeSet<&str> =
        api["tags"].as_array().unwrap().iter().filter_map(|tag| tag["name"].as_str()).collect();
    for (path, _, operation) in operations(&api) {
        assert!(!operation["summary"].as_str().unwrap().is_empty(), "{path}");
        assert!(
            operation["tags"]
                .as_array()
                .unwrap()
                .iter()
                .all(|tag| tags.contains(tag.as_str().unwrap())),
            "{path}"
        );
    }
}

#[test]
fn every_reference_resolves_and_every_schema_is_used() {
    let api = specification();
    let pointers: BTreeSet<String> = places(&api)
        .iter()
        .filter(|(place, value)| {
            place.ends_with("/$ref") || (place.contains("/mapping/") && value.is_string())
        })
        .map(|(_, value)| value.as_str().unwrap().trim_start_matches('#').to_owned())
        .collect();
    for pointer in &pointers {
        assert!(api.pointer(pointer).is_some(), "{pointer} leads nowhere");
    }
    for name in schemas(&api).keys() {
        assert!(
            pointers.contains(&format!("/components/schemas/{name}")),
            "nothing refers to {name}"
        );
    }
}

fn schemas(api: &Value) -> &Map<String, Value> {
    api["components"]["schemas"].as_object().unwrap()
}

#[test]
fn nothing_is_nullable() {
    for (place, value) in places(&specification()) {
        if place.ends_with("/type")
            && !place.contains("/examples/")
            && !place.contains("/mapping/")
            && !place.contains("/properties/type")
        {
            assert!(value.is_string() && value != "null", "{place} is {value}");
        }
        assert!(!place.ends_with("/nullable"), "{place}");
    }
}

#[test]
fn every_schema_and_every_property_is_described() {
    let api = specification();
    for (name, schema) in schemas(&api) {
        assert!(described(schema), "{name}");
        for (field, property) in schema["properties"].as_object().into_iter().flatten() {
            assert!(described(property), "{name}.{field}");
        }
    }
}

fn described(schema: &Value) -> bool {
    schema["description"].as_str().is_some_and(|text| !text.is_empty())
}

/// What the words of a description promise of the schema beside them.
const PROMISES: &[(&str, &[&str])] = &[
    ("0 or more", &["minimum"]),
    ("at least 2", &["minimum"]),
    ("at most 64", &["maximum"]),
    ("1 to 64", &["minimum", "maximum"]),
    ("to 64,", &["minimum", "maximum"]),
    ("2 to 200,000", &["minimum", "maximum"]),
    ("1 to 200,000", &["minItems", "maxItems"]),
    ("to 100,000", &["minItems", "maxItems"]),
    ("0 < ", &["exclusiveMinimum"]),
    ("ore than 0", &["exclusiveMinimum"]),
    ("<= 1.", &["maximum"]),
    ("<= 3)", &["maximum"]),
    ("(0, 3]", &["exclusiveMinimum", "maximum"]),
    ("0 to pi", &["minimum", "maximum"]),
    ("First and last parameter", &["minItems", "maxItems"]),
];

#[test]
fn numbers_have_the_ranges_their_text_names() {
    let api = specification();
    for (name, schema) in schemas(&api) {
        for (field, property) in schema["properties"].as_object().into_iter().flatten() {
            broken_promises(&api, name, field, property);
        }
    }
}

fn broken_promises(api: &Value, name: &str, field: &str, property: &Value) {
    let resolved = match property["$ref"].as_str() {
        Some(reference) => api.pointer(reference.trim_start_matches('#')).unwrap(),
        None => property,
    };
    let text = property["description"].as_str().unwrap();
    if resolved.get("anyOf").is_some() {
        return; // Points: one schema for all lists of points, which have no common length.
    }
    for (words, keywords) in PROMISES.iter().filter(|(words, _)| text.contains(words)) {
        for keyword in *keywords {
            assert!(
                has_keyword(property, keyword) || has_keyword(resolved, keyword),
                "{name}.{field} says \"{words}\" but has no {keyword}"
            );
        }
    }
}

fn has_keyword(schema: &Value, keyword: &str) -> bool {
    if schema.get("items").is_some_and(|items| has_keyword(items, keyword)) {
        return true;
    }
    let stricter = match keyword {
        "minimum" => "exclusiveMinimum",
        "maximum" => "exclusiveMaximum",
        other => other,
    };
    schema.get(keyword).or(schema.get(stricter)).is_some()
}

#[test]
fn discriminators_map_every_tag_to_the_schema_that_has_it() {
    let api = specification();
    let unions = schemas(&api).iter().filter(|(_, schema)| schema.get("discriminator").is_some());
    let mut count = 0;
    for (name, union) in unions {
        count += 1;
        let tag = union["discriminator"]["propertyName"].as_str().unwrap();
        let mapping = union["discriminator"]["mapping"].as_object().unwrap();
        let variants: BTreeSet<&str> = union["oneOf"]
            .as_array()
            .unwrap()
            .iter()
            .map(|item| item["$ref"].as_str().unwrap())
            .collect();
        assert_eq!(
            variants,
            mapping.values().map(|value| value.as_str().unwrap()).collect(),
            "{name}"
        );
        for (value, reference) in mapping {
            let variant = api.pointer(reference.as_str().unwrap().trim_start_matches('#')).unwrap();
            assert_eq!(variant["properties"][tag]["const"], json!(value), "{name} {value}");
            assert!(
                variant["required"].as_array().unwrap().contains(&json!(tag)),
                "{name} {value}"
            );
        }
    }
    assert!(count >= 7, "{count} unions");
}

#[test]
fn a_choice_of_one_is_a_constant_and_a_shape_parameter_is_given_once() {
    let api = specification();
    for (place, value) in places(&api) {
        let one = place.ends_with("/enum") && value.as_array().is_some_and(|names| names.len() < 2);
        assert!(!one, "{place} is {value}");
    }
    for union in ["Curve", "Basis"] {
        let schema = validator(&api, &json!({"$ref": format!("#/components/schemas/{union}")}));
        let with = |parameters: Value| {
            let mut value = parameters.as_object().unwrap().clone();
            value.insert("family".into(), json!("beta-bezier"));
            if union == "Curve" {
                value.insert("control_points".into(), json!([[0, 0], [1, 1]]));
            }
            schema.is_valid(&Value::Object(value))
        };
        assert!(with(json!({"beta": 1})) && with(json!({"lambda": 1})), "{union}");
        assert!(!with(json!({})) && !with(json!({"beta": 1, "lambda": 1})), "{union}");
    }
}

#[test]
fn names_are_of_one_style_and_none_is_one_that_generators_make() {
    let api = specification();
    for (_, _, operation) in operations(&api) {
        let id = operation["operationId"].as_str().unwrap();
        assert!(
            id.starts_with(|c: char| c.is_ascii_lowercase())
                && id.chars().all(|c| c.is_ascii_alphanumeric()),
            "{id}"
        );
        let capital = id[..1].to_uppercase() + &id[1..];
        for suffix in
            ["Data", "Error", "Errors", "Response", "Responses", "Body", "Params", "Options"]
        {
            assert!(
                !schemas(&api).contains_key(&format!("{capital}{suffix}")),
                "{capital}{suffix}"
            );
        }
    }
    for name in schemas(&api).keys() {
        assert!(
            name.starts_with(|c: char| c.is_ascii_uppercase())
                && name.chars().all(|c| c.is_ascii_alphanumeric()),
            "{name}"
        );
    }
}

#[test]
fn answers_and_refusals_are_shown_as_they_are() {
    let (api, server) = (specification(), Server::start());
    for (path, examples) in TABLE.iter().map(|entry| (entry.path, entry.examples)) {
        let answers = &api["paths"][path]["post"]["responses"];
        if path != "/v1/render" {
            let shown =
                answers["200"]["content"]["application/json"]["examples"].as_object().unwrap();
            assert!(!shown.is_empty(), "{path}");
            for (name, example) in shown {
                assert_valid(&answer_validator(&api, path), &example["value"], name);
                let body = examples.iter().find(|example| example.name == name).unwrap().body;
                let answer = server.post(&format!("{path}?precision=6"), body).json();
                assert_eq!(quiet(&answer), example["value"], "{path} {name}");
            }
        }
        let refused =
            &answers["422"]["content"]["application/problem+json"]["examples"]["refused"]["value"];
        assert_valid(&problem_validator(&api), refused, path);
        assert_eq!(refused["status"], 422, "{path}");
    }
}

/// Without what is nothing but rounding.
fn quiet(value: &Value) -> Value {
    let small = |(place, value): &(String, Value)| {
        value.as_f64().is_some_and(|x| x != 0.0 && x.abs() < 1e-12).then(|| place.clone())
    };
    places(value)
        .iter()
        .filter_map(small)
        .fold(value.clone(), |value, place| with(&value, &place, json!(0.0)))
}

#[test]
fn flat_answers_are_described() {
    let (api, server) = (specification(), Server::start());
    for (path, name, body) in examples().into_iter().filter(|(path, ..)| *path != "/v1/render") {
        let flat = server.post_json(&format!("{path}?layout=flat"), &body).json();
        assert_valid(&answer_validator(&api, path), &flat, name);
        // Not for want of strictness: the one schema refuses what the other is for.
        let both =
            api["paths"][path]["post"]["responses"]["200"]["content"]["application/json"]["schema"]
                ["anyOf"]
                .as_array()
                .cloned();
        let is_nested_only = server.ok(path, &body) == flat;
        assert_eq!(both.is_none(), is_nested_only, "{path}");
        if let Some(schemas) = both {
            let fits: Vec<bool> =
                schemas.iter().map(|schema| validator(&api, schema).is_valid(&flat)).collect();
            assert_eq!(fits, [false, true], "{path}");
        }
    }
}

#[test]
fn lines_of_batches_are_described() {
    let (api, server) = (specification(), Server::start());
    let content = &api["paths"]["/v1/batch"]["post"];
    let of = |content: &Value| {
        validator(&api, &content["content"]["application/x-ndjson"]["x-item-schema"])
    };
    let (line_in, line_out) = (of(&content["requestBody"]), of(&content["responses"]["200"]));
    let mut text = String::new();
    for (i, (path, name, body)) in examples().iter().enumerate() {
        let id = if i % 2 == 0 { json!(name) } else { json!(i) };
        let line = json!({"op": path.trim_start_matches("/v1/"), "id": id, "body": body});
        assert_valid(&line_in, &line, name);
        assert!(
            !line_in.is_valid(&with_key(&line, "", "more", json!(1)))
                && !line_in.is_valid(&without_key(&line, "", "op"))
        );
        text += &format!("{line}\n");
    }
    text += "{\"op\": \"fit\", \"body\": {}}\n";
    for query in ["", "?layout=flat"] {
        let answer =
            server.post_as(&format!("/v1/batch{query}"), Some("application/x-ndjson"), &text);
        for line in answer.text().lines() {
            assert_valid(&line_out, &serde_json::from_str(line).unwrap(), line);
        }
    }
}

#[test]
fn the_specification_for_json_alone_has_nothing_else() {
    let answer = Server::start().get("/openapi-json.json");
    assert_eq!((answer.status, answer.header("content-type")), (200, "application/json"));
    let (only, api) = (answer.json(), specification());
    for (place, value) in places(&only).iter().filter(|(place, _)| place.ends_with("/content")) {
        let types: Vec<&String> = value.as_object().unwrap().keys().collect();
        assert!(
            types
                .iter()
                .all(|name| ["application/json", "application/problem+json"]
                    .contains(&name.as_str())),
            "{place} {types:?}"
        );
    }
    let pointers: BTreeSet<String> = places(&only)
        .into_iter()
        .filter_map(|(_, v)| v["$ref"].as_str().map(str::to_owned))
        .collect();
    for name in schemas(&only).keys() {
        assert!(!name.starts_with("Flat") || name == "FlatnessCuts", "{name}");
        assert!(
            pointers.contains(&format!("#/components/schemas/{name}")),
            "nothing refers to {name}"
        );
        assert_eq!(
            only["components"]["schemas"][name], api["components"]["schemas"][name],
            "{name}"
        );
    }
    let left_out = ["/v1/batch", "/v1/render", "/metrics", "/favicon.ico", "/favicon.svg"];
    let kept: BTreeSet<&str> =
        paths(&api).map(|(path, _)| path).filter(|path| !left_out.contains(path)).collect();
    assert_eq!(paths(&only).map(|(path, _)| path).collect::<BTreeSet<_>>(), kept);
}

#[test]
fn every_object_is_closed() {
    let api = specification();
    for (name, schema) in
        schemas(&api).iter().filter(|(_, schema)| schema.get("properties").is_some())
    {
        let open = ["Problem", "Item"].contains(&name.as_str()); // Problem details may be extended (RFC 9457 section 3.2).
        assert!(open || schema["additionalProperties"] == false, "{name}");
    }
}

/// Both must refuse: the schema, and the server with 400 and a pointer.
struct Judges {
    server: Server,
    api: Value,
}

impl Judges {
    fn new() -> Self {
        Judges { server: Server::start(), api: specification() }
    }

    fn refuse(&self, path: &str, body: &Value, pointer: &str) {
        assert!(
            !request_validator(&self.api, path).is_valid(body),
            "the schema of {path} accepts {body}"
        );
        let answer = self.server.post_json(path, body);
        assert_eq!(answer.status, 400, "{path} {body}: {}", answer.text());
        assert_eq!(answer.pointer(), pointer, "{path} {body}: {}", answer.text());
    }
}

#[test]
fn every_example_is_accepted_by_its_schema() {
    let api = specification();
    for (path, name, body) in examples() {
        assert_valid(&request_validator(&api, path), &body, name);
    }
}

#[test]
fn an_extra_key_is_refused_in_every_object() {
    let judges = Judges::new();
    for (path, _, body) in examples() {
        for (object, _) in objects(&body) {
            for (key, escaped) in [("zzz", "zzz"), ("", ""), ("a/b~c", "a~1b~0c"), ("Beta", "Beta")]
            {
                judges.refuse(
                    path,
                    &with_key(&body, &object, key, json!(1)),
                    &format!("{object}/{escaped}"),
                );
            }
        }
    }
}

#[test]
fn a_missing_key_is_refused_at_the_object_that_lacks_it() {
    let judges = Judges::new();
    for (path, _, body) in examples() {
        for (object, fields) in objects(&body) {
            for key in fields.keys() {
                let lacking = without_key(&body, &object, key);
                // A quasi-bezier curve sought needs a degree, and of some pairs of fields one is
                // needed; a schema for that would be no single object for generated clients.
                let one_of_two: &[&str] = match path {
                    "/v1/render" => &["curves", "surfaces"],
                    "/v1/continuity" => &["curve", "curves"],
                    "/v1/reshape" => &["basis", "bases"],
                    _ => &[],
                };
                let beyond_schema = object.is_empty() && one_of_two.contains(&key.as_str())
                    || (key == "degree"
                        && fields.get("family").is_some_and(|f| f == "quasi-bezier"));
                let needed =
                    !request_validator(&judges.api, path).is_valid(&lacking) || beyond_schema;
                let answer = judges.server.post_json(path, &lacking);
                assert_eq!(answer.status == 400, needed, "{path} {lacking}: {}", answer.text());
                if needed {
                    let problem = answer.json();
                    assert_eq!(answer.pointer(), object, "{lacking}");
                    assert_eq!(problem["code"], "missing_field", "{problem}");
                    assert!(
                        problem["detail"].as_str().unwrap().contains(key.as_str()),
                        "{problem}"
                    );
                }
            }
        }
    }
}

#[test]
fn null_is_refused_everywhere() {
    let judges = Judges::new();
    for (path, _, body) in examples() {
        for (place, _) in places(&body) {
            judges.refuse(path, &with(&body, &place, Value::Null), &place);
        }
    }
}

#[test]
fn null_is_refused_in_every_optional_field_too() {
    let judges = Judges::new();
    for (path, _, body) in examples() {
        for field in request_fields(&judges.api, path) {
            judges.refuse(path, &with_key(&body, "", &field, Value::Null), &format!("/{field}"));
        }
    }
}

fn request_fields(api: &Value, path: &str) -> Vec<String> {
    let schema =
        &api["paths"][path]["post"]["requestBody"]["content"]["application/json"]["schema"];
    let resolved =
        schema["$ref"].as_str().map_or(schema, |reference| api.pointer(&reference[1..]).unwrap());
    resolved["properties"].as_object().unwrap().keys().cloned().collect()
}

#[test]
fn a_string_or_a_boolean_is_no_number() {
    let judges = Judges::new();
    for (path, _, body) in examples() {
        for (place, value) in places(&body).into_iter().filter(|(_, value)| value.is_number()) {
            judges.refuse(path, &with(&body, &place, json!(value.to_string())), &place);
            judges.refuse(path, &with(&body, &place, json!(true)), &place);
        }
    }
}

#[test]
fn a_number_is_no_name_no_list_and_no_object() {
    let judges = Judges::new();
    for (path, _, body) in examples() {
        for (place, _) in places(&body).into_iter().filter(|(_, value)| !value.is_number()) {
            judges.refuse(path, &with(&body, &place, json!(1.5)), &place);
        }
    }
}

#[test]
fn an_array_is_no_object_and_an_object_no_array() {
    let judges = Judges::new();
    for (path, _, body) in examples() {
        for (place, value) in
            places(&body).into_iter().filter(|(_, value)| value.is_object() || value.is_array())
        {
            let other = if value.is_object() { json!(["bezier"]) } else { json!({"0": [1, 2]}) };
            judges.refuse(path, &with(&body, &place, other), &place);
        }
    }
}

#[test]
fn an_unknown_name_is_refused_where_it_stands() {
    let judges = Judges::new();
    for (path, _, body) in examples() {
        for (place, _) in places(&body).into_iter().filter(|(_, value)| value.is_string()) {
            if ["/label", "/title"].iter().any(|free| place.ends_with(free)) {
                continue; // Any text will do there.
            }
            judges.refuse(path, &with(&body, &place, json!("bezíer")), &place);
        }
    }
}

#[test]
fn points_of_one_four_or_mixed_dimensions_are_refused() {
    let judges = Judges::new();
    for (path, _, body) in examples() {
        for (place, point) in
            places(&body).into_iter().filter(|(place, value)| is_point(place, value))
        {
            let coordinates = numbers(&point);
            let other = if coordinates.len() == 2 { 3 } else { 2 };
            for count in [0, 1, 4, 5] {
                judges.refuse(path, &with(&body, &place, json!(vec![0.5; count])), &place);
            }
            // A first point of another dimension makes the next one wrong.
            if !place.ends_with("/0") && !place.ends_with("/vector") {
                judges.refuse(path, &with(&body, &place, json!(vec![0.5; other])), &place);
            }
        }
    }
}

fn is_point(place: &str, value: &Value) -> bool {
    let listed = place.rsplit_once('/').is_some_and(|(list, _)| list.ends_with("points"));
    value.is_array() && (listed || place.ends_with("/vector"))
}
