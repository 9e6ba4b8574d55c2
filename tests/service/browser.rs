//! What a browser gets that is not an operation: pages and the icon, and nothing that a program
//! would not expect.

use crate::support::*;
use serde_json::Value;

/// What browsers send when an address is typed into them.
const CHROMIUM: &str = "text/html,application/xhtml+xml,application/xml;q=0.9,image/avif,image/webp,image/apng,*/*;q=0.8,application/signed-exchange;v=b3;q=0.7";
const FIREFOX: &str = "text/html,application/xhtml+xml,application/xml;q=0.9,*/*;q=0.8";

fn get(server: &Server, path: &str, accept: Option<&str>) -> Answer {
    let accept = accept.map_or(String::new(), |accept| format!("accept: {accept}\r\n"));
    server.raw(
        format!("GET {path} HTTP/1.1\r\nhost: t\r\n{accept}connection: close\r\n\r\n").as_bytes(),
    )
}

#[test]
fn the_address_of_the_service_is_a_page_in_a_browser() {
    let server = Server::start();
    for accept in [CHROMIUM, FIREFOX, "text/html"] {
        let answer = get(&server, "/", Some(accept));
        assert_eq!(
            (answer.status, answer.header("content-type"), answer.header("vary")),
            (200, "text/html; charset=utf-8", "accept")
        );
        let page = answer.text();
        for part in [
            "<h1>Springline</h1>",
            "href=\"/docs/\"",
            "href=\"/openapi.json\"",
            "<svg ",
            "curl -s localhost:8080/v1/evaluate",
        ] {
            assert!(page.contains(part), "no {part} in {page}");
        }
        self_contained(&server, &page);
        policy_allows(answer.header("content-security-policy"));
    }
    for accept in [
        None,
        Some("*/*"),
        Some("application/json"),
        Some("application/json, text/plain, */*"),
        Some("image/png"),
    ] {
        let answer = get(&server, "/", accept);
        assert_eq!(
            (answer.status, answer.header("content-type"), answer.header("vary")),
            (200, "application/json", "accept"),
            "{accept:?}"
        );
        let (index, api): (Value, Value) = (answer.json(), specification());
        assert_valid(
            &validator(
                &api,
                &api["paths"]["/"]["get"]["responses"]["200"]["content"]["application/json"]["schema"],
            ),
            &index,
            "/",
        );
        assert_eq!(server.get(index["specification"].as_str().unwrap()).status, 200);
    }
}

/// No script, and nothing from elsewhere; what the page names is there.
fn self_contained(server: &Server, page: &str) {
    assert!(!page.contains("<script") && !page.contains("src="), "{page}");
    for name in page.split("href=\"").skip(1).filter_map(|rest| rest.split('"').next()) {
        assert!(name.starts_with('/') && server.get(name).status == 200, "{name}");
    }
}

/// The page's own style and the icon, and nothing else.
fn policy_allows(policy: &str) {
    let allows = |what: &str| policy.split("; ").any(|part| part == what);
    assert!(
        allows("default-src 'none'")
            && allows("img-src 'self'")
            && allows("style-src 'unsafe-inline'"),
        "{policy}"
    );
}

/// The call that the page shows is made as a shell would make it.
#[test]
fn the_call_on_the_page_works() {
    let server = Server::start();
    let page =
        get(&server, "/", Some(CHROMIUM)).text().replace("&quot;", "\"").replace("&#39;", "'");
    let body = page.split("-d '").nth(1).unwrap().split('\'').next().unwrap();
    assert_eq!(server.post("/v1/evaluate", body).status, 200, "{body}");
}

#[test]
fn what_is_not_there_is_a_page_in_a_browser_and_a_problem_for_programs() {
    let server = Server::start();
    for (path, status, code) in [
        ("/nothing&b", 404, "not_found"),
        ("/docs/nothing", 404, "not_found"),
        ("/v1/evaluate", 405, "method_not_allowed"),
    ] {
        let page = get(&server, path, Some(CHROMIUM));
        assert_eq!(
            (page.status, page.header("content-type"), page.header("vary")),
            (status, "text/html; charset=utf-8", "accept"),
            "{path}"
        );
        assert!(
            page.text().contains("href=\"/docs/\"") && !page.text().contains("nothing&b"),
            "{}",
            page.text()
        );
        self_contained(&server, &page.text());
        for accept in [
            None,
            Some("*/*"),
            Some("application/json"),
            Some("application/problem+json, text/html"),
            Some("image/png"),
        ] {
            let answer = get(&server, path, accept);
            assert_eq!(
                (answer.status, answer.header("content-type")),
                (status, "application/problem+json"),
                "{path} {accept:?}"
            );
            assert_eq!(answer.json()["code"], code);
        }
        assert_eq!(page.header("allow"), if status == 405 { "POST" } else { "" });
    }
}

#[test]
fn pages_and_the_icon_need_no_key() {
    let server = Server::with(&["--api-keys", "key"]);
    for (path, media_type) in [
        ("/", "application/json"),
        ("/favicon.svg", "image/svg+xml"),
        ("/favicon.ico", "image/x-icon"),
    ] {
        let answer = server.get(path);
        assert_eq!((answer.status, answer.header("content-type")), (200, media_type), "{path}");
        assert_eq!(server.method("HEAD", path).status, 200, "{path}");
    }
    assert!(server.get("/favicon.svg").header("cache-control").starts_with("max-age="));
    assert!(server.get("/favicon.ico").body.starts_with(&[0, 0, 1, 0]));
}

/// Swagger UI quotes examples of every type with `json` in its name; its start here leaves lines as
/// they are.
#[test]
fn the_example_of_a_batch_is_lines_and_is_sent_as_lines() {
    let server = Server::start();
    let example = &specification()["paths"]["/v1/batch"]["post"]["requestBody"]["content"]["application/x-ndjson"]
        ["example"];
    let lines = example.as_str().unwrap();
    let answer = server.post_as("/v1/batch", Some("application/x-ndjson"), lines).text();
    assert_eq!((answer.lines().count(), answer.matches("\"answer\":").count()), (2, 2), "{answer}");
    let script = server.get("/docs/swagger-initializer.js");
    assert_eq!(script.header("content-type"), "text/javascript");
    assert!(
        script.text().contains("/ndjson/.test(mediaType) && typeof example === 'string' ? example")
    );
}

#[test]
fn an_origin_with_a_slash_at_its_end_is_taken_without_it_and_said_so() {
    let mut command = binary();
    command.args([
        "--listen",
        "127.0.0.1:0",
        "--log-format",
        "json",
        "--cors-origins",
        "https://cad.example/",
    ]);
    let log = Log::of(&mut command);
    let server = Server::run(command);
    let line = log.wait_for("cors-origins");
    assert!(line.contains("https://cad.example/ is taken as https://cad.example:"), "{line}");
    let answer = server.raw(b"GET /livez HTTP/1.1\r\nhost: t\r\norigin: https://cad.example\r\nconnection: close\r\n\r\n");
    assert_eq!(answer.header("access-control-allow-origin"), "https://cad.example");
}
