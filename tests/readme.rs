//! README and docs show real output: every `curl` in them is run, and its answer compared with the one printed.

mod support;

use serde_json::Value;

/// The `sh` blocks that call the service, each with the `json` block that follows it.
fn calls(readme: &str) -> Vec<(String, Value)> {
    let blocks: Vec<&str> = readme.split("```").skip(1).step_by(2).collect();
    let pairs = blocks.windows(2).filter(|pair| pair[0].starts_with("sh\n") && pair[1].starts_with("json\n"));
    pairs.map(|pair| (pair[0].to_owned(), serde_json::from_str(&pair[1][5..]).expect("the answer shown is JSON"))).collect()
}

/// The path and the body of a curl command.
fn request(command: &str) -> (&str, &str) {
    let path = command.split("localhost:8080").nth(1).unwrap().split_whitespace().next().unwrap();
    let body = command.split("-d '").nth(1).unwrap().split('\'').next().unwrap();
    (path, body)
}

#[test]
fn the_answers_shown_are_the_answers_given() {
    let pages = [include_str!("../README.md"), include_str!("../docs/more-calls.md")];
    let calls: Vec<_> = pages.into_iter().flat_map(calls).collect();
    let server = support::Server::start();
    for operation in springline::http::OPERATIONS.iter().map(|(path, _)| path) {
        // A picture has no answer to print.
        let drawn = support::media_type(operation) != "application/json";
        assert!(drawn || calls.iter().any(|(command, _)| request(command).0 == *operation), "no call of {operation}");
    }
    for (command, expected) in &calls {
        let (path, body) = request(command);
        assert_eq!(&server.post(path, body).json(), expected, "{path} {body}");
    }
}
