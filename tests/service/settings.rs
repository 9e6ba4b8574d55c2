//! The settings: flag before variable before file before default; what is wrong is refused by name.

use std::path::PathBuf;
use std::process::{Command, Output};

use crate::support::*;

/// A file of its own for each test.
fn file(name: &str, text: &str) -> PathBuf {
    let path = PathBuf::from(env!("CARGO_TARGET_TMPDIR")).join(name);
    std::fs::write(&path, text).unwrap();
    path
}

fn clean() -> Command {
    let mut command = binary();
    let ours = std::env::vars().filter(|(name, _)| name.starts_with("SPRINGLINE_"));
    ours.for_each(|(name, _)| _ = command.env_remove(name));
    command
}

fn printed(output: &Output) -> toml::Table {
    assert!(output.status.success(), "{output:?}");
    String::from_utf8_lossy(&output.stdout).parse().unwrap()
}

fn effective(command: &mut Command) -> toml::Table {
    printed(&command.arg("config").output().unwrap())
}

#[test]
fn a_flag_goes_before_a_variable_before_the_file_before_the_default() {
    let path = file("order.toml", "queue = 1\nworkers = 1\ndrain = \"1s\"\n");
    let mut command = clean();
    command
        .arg("--config")
        .arg(&path)
        .args(["--queue", "3"])
        .env("SPRINGLINE_QUEUE", "2")
        .env("SPRINGLINE_WORKERS", "2");
    let settings = effective(&mut command);
    assert_eq!(settings["queue"].as_integer(), Some(3), "the flag");
    assert_eq!(settings["workers"].as_integer(), Some(2), "the variable");
    assert_eq!(settings["drain"].as_str(), Some("1s"), "the file");
    assert_eq!(settings["grace"].as_str(), Some("5s"), "the default");
}

#[test]
fn what_is_printed_sets_the_same_again() {
    let given = [
        "--metrics-listen",
        "127.0.0.1:9",
        "--cors-origins",
        "https://a.example,https://b.example",
        "--memory",
        "3MiB",
        "--idle-time",
        "90s",
    ];
    let first = effective(clean().args(given));
    let path = file("printed.toml", &first.to_string());
    assert_eq!(effective(clean().arg("--config").arg(path)), first);
    assert_eq!(first["cors-origins"].as_array().unwrap().len(), 2);
}

#[test]
fn keys_are_not_printed() {
    let output = clean().args(["--api-keys", "secret1,secret2", "config"]).output().unwrap();
    let text = String::from_utf8_lossy(&output.stdout).into_owned();
    assert!(text.contains("api-keys: 2 given") && !text.contains("secret"), "{text}");
    let help = clean().arg("--help").env("SPRINGLINE_API_KEYS", "secret3").output().unwrap();
    assert!(!String::from_utf8_lossy(&help.stdout).contains("secret"));
}

#[test]
fn what_is_wrong_is_refused_by_name() {
    let refused = |command: &mut Command, named: &[&str]| {
        let output = command.output().unwrap();
        let text = String::from_utf8_lossy(&output.stderr).into_owned();
        assert!(!output.status.success(), "{text}");
        named.iter().for_each(|name| assert!(text.contains(name), "no {name} in {text}"));
    };
    refused(clean().args(["--queue", "many"]), &["--queue", "many"]);
    refused(clean().args(["--deadline", "10"]), &["--deadline", "500ms"]);
    refused(clean().args(["--max-body", "1GiB"]), &["--max-body", "32.0 MiB"]);
    refused(clean().args(["--max-degree", "65"]), &["--max-degree", "64"]);
    refused(clean().args(["--quue", "1"]), &["--quue", "--queue"]);
    refused(clean().env("SPRINGLINE_DRAIN", "soon"), &["--drain", "soon"]);
    refused(
        clean().arg("--config").arg(file("unknown.toml", "quue = 1")),
        &["unknown.toml", "quue"],
    );
    refused(
        clean().arg("--config").arg(file("wrong.toml", "queue = \"many\"")),
        &["--queue", "many"],
    );
    refused(clean().arg("--config").arg(file("kind.toml", "queue = 1.5")), &["kind.toml", "queue"]);
    refused(
        clean().arg("--config").arg(file("broken.toml", "queue = ")),
        &["broken.toml", "line 1"],
    );
    refused(clean().arg("--config=/no/such/file"), &["/no/such/file"]);
    refused(clean().args(["--tls-cert", "x.pem"]), &["tls-key"]);
    refused(clean().args(["--tls-cert", "x.pem", "--tls-key", "y.pem"]), &["tls-cert", "x.pem"]);
    refused(clean().args(["--cors-origins", "example.com"]), &["cors-origins", "example.com"]);
    refused(
        clean().args(["--cors-origins", "https://example.com/app"]),
        &["cors-origins", "write https://example.com, without"],
    );
    refused(
        clean().args(["--cors-origins", "https://*.example.com"]),
        &["cors-origins", "https://*.example.com"],
    );
    refused(clean().args(["--cors-origins", "*,https://a.example"]), &["cors-origins", "*"]);
    refused(clean().args(["--api-keys", "a b"]), &["API key"]);
    refused(clean().args(["--api-keys-file", "/no/such/file"]), &["/no/such/file"]);
    refused(clean().args(["--log", "springline=loud"]), &["log"]);
    refused(clean().args(["--otlp-endpoint", "https://collector"]), &["otlp-endpoint", "http://"]);
}

#[test]
fn every_setting_has_a_variable_of_its_name() {
    let help = String::from_utf8(clean().arg("--help").output().unwrap().stdout).unwrap();
    let flags: Vec<&str> = help
        .split("--")
        .skip(1)
        .filter_map(|rest| rest.split([' ', '\n', '.', ';']).next())
        .collect();
    let settings = flags.iter().filter(|flag| !["help", "version", "tls-key"].contains(flag));
    let mut count = 0;
    for flag in settings {
        let variable = format!("[env: SPRINGLINE_{}", flag.replace('-', "_").to_uppercase());
        assert!(help.contains(&variable), "no {variable}");
        count += 1;
    }
    assert!(count > 25, "{count}");
}

#[test]
fn a_misspelt_variable_is_reported() {
    let mut command = clean();
    command.args(["--listen", "127.0.0.1:0", "--log-format", "json"]).env("SPRINGLINE_QUUE", "1");
    let log = Log::of(&mut command);
    let server = Server::run(command);
    log.wait_for("SPRINGLINE_QUUE");
    drop(server);
}

/// What `--help` says of each setting: its name and its default.
fn documented() -> Vec<(String, String)> {
    let help = String::from_utf8(clean().arg("--help").output().unwrap().stdout).unwrap();
    let settings = help.split("Settings:").nth(1).unwrap().split("\n      --").skip(1);
    let of = |text: &str| {
        let default = text.split("[default: ").nth(1).and_then(|rest| rest.split(']').next());
        (
            text.split(' ').next().unwrap().to_owned(),
            default.map_or("none".to_owned(), |default| format!("`{default}`")),
        )
    };
    settings.map(of).collect()
}

#[test]
fn the_operators_page_lists_every_setting_with_its_default() {
    let page = include_str!("../../docs/operations.md");
    let settings = documented();
    assert!(settings.len() > 25, "{settings:?}");
    for (name, default) in settings {
        assert!(
            page.contains(&format!("| `{name}` | {default} |")),
            "no row for {name} with {default}"
        );
    }
}

/// The page names its proofs: they must be there.
#[test]
fn the_operators_page_names_tests_that_exist() {
    let page = include_str!("../../docs/operations.md");
    let tests = include_str!("operation.rs");
    let named = page.split("`operation::").skip(1).filter_map(|rest| rest.split('`').next());
    let mut count = 0;
    for name in named.filter(|name| *name != "...") {
        assert!(tests.contains(&format!("fn {name}()")), "no test {name}");
        count += 1;
    }
    assert!(count > 10, "{count}");
    let scripts = page.split("`scripts/").skip(1).filter_map(|rest| rest.split('`').next());
    for script in scripts {
        assert!(
            std::path::Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/scripts"))
                .join(script)
                .exists(),
            "no {script}"
        );
    }
}
