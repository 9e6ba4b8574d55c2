//! The operations on the command line: help, files, numbers, errors, batches that are read while
//! they are written.

use std::io::{BufRead, BufReader, Read, Write};
use std::path::PathBuf;
use std::process::{Command, Output, Stdio};
use std::sync::mpsc;
use std::thread;
use std::time::Duration;

use crate::support::*;
use serde_json::{Value, json};
use springline::api::operations::{Entry, TABLE};

const LINE: &str = r#"{"id": 7, "op": "evaluate", "body": {"curve": {"family": "bezier", "control_points": [[0, 0], [1, 3]]}, "sampling": {"kind": "count", "count": 3}}}"#;
const REQUEST: &str = r#"{"curve": {"family": "bezier", "control_points": [[0, 0], [1, 3]]}, "sampling": {"kind": "count", "count": 3}}"#;
const ANSWER: &str = "{\"domain\":[0.0,1.0],\"parameters\":[0.0,0.5,1.0],\"points\":[[0.0,0.0],[0.5,1.5],[1.0,3.0]]}\n";

/// Runs the program with these arguments and this input.
fn run(arguments: &[&str], input: &str) -> Output {
    let mut command = binary();
    command.args(arguments).stdin(Stdio::piped()).stdout(Stdio::piped()).stderr(Stdio::piped());
    let mut child = command.spawn().unwrap();
    let mut stdin = child.stdin.take().unwrap();
    let input = input.to_owned();
    let writing = thread::spawn(move || _ = stdin.write_all(input.as_bytes()));
    let output = child.wait_with_output().unwrap();
    writing.join().unwrap();
    output
}

fn out(output: &Output) -> String {
    String::from_utf8(output.stdout.clone()).unwrap()
}

fn err(output: &Output) -> String {
    String::from_utf8(output.stderr.clone()).unwrap()
}

fn answered(arguments: &[&str], input: &str) -> String {
    let output = run(arguments, input);
    assert_eq!(output.status.code(), Some(0), "{arguments:?}: {}", err(&output));
    assert_eq!(err(&output), "", "{arguments:?}");
    out(&output)
}

fn names() -> impl Iterator<Item = &'static str> {
    TABLE.iter().map(Entry::name)
}

/// A file of its own for each test.
fn file(name: &str, text: &str) -> PathBuf {
    let path = PathBuf::from(env!("CARGO_TARGET_TMPDIR")).join(name);
    std::fs::write(&path, text).unwrap();
    path
}

#[test]
fn every_operation_is_a_command_with_the_bytes_of_the_service() {
    let server = Server::start();
    for (path, name, body) in examples() {
        let printed = answered(&[path.trim_start_matches("/v1/")], &body.to_string());
        let served = server.post_json(path, &body).text();
        // A picture is a whole file as it is.
        let newline = if path == "/v1/render" { "" } else { "\n" };
        assert!(printed == served + newline, "{name}: {printed}");
    }
}

#[test]
fn a_picture_is_printed_as_svg() {
    let body =
        r#"{"curves": [{"curve": {"family": "bezier", "control_points": [[0, 0], [1, 3]]}}]}"#;
    let svg = answered(&["render"], body);
    assert!(svg.starts_with("<svg xmlns=") && svg.ends_with("</svg>\n"), "{svg}");
}

#[test]
fn help_lists_every_operation_and_each_has_its_own_with_an_example_that_runs() {
    let (all, api) = (answered(&["--help"], ""), specification());
    for name in names() {
        let summary = api["paths"][format!("/v1/{name}")]["post"]["summary"].as_str().unwrap();
        let listed = all.lines().any(|line| {
            line.trim_start()
                .split_once(' ')
                .is_some_and(|(n, about)| n == name && about.trim() == summary)
        });
        assert!(listed, "{name} is not in {all}");
        let help = answered(&[name, "--help"], "");
        assert!(
            help.starts_with(summary) && help.contains("[FILE]") && !help.contains("--listen"),
            "{help}"
        );
        assert_eq!(answered(&["help", name], ""), help);
        example_runs(name, &help);
    }
}

/// What follows `Example:` is pasted into a shell that knows the program.
fn example_runs(name: &str, help: &str) {
    let (_, script) =
        help.split_once("\n  echo '").unwrap_or_else(|| panic!("no example in {help}"));
    let script = format!("echo '{}", script.split("\n\n").next().unwrap());
    let program = PathBuf::from(env!("CARGO_BIN_EXE_springline"));
    let folder = PathBuf::from(env!("CARGO_TARGET_TMPDIR"))
        .join(format!("example-{}", name.replace('/', "-")));
    std::fs::create_dir_all(&folder).unwrap();
    let path =
        std::env::join_paths([program.parent().unwrap(), "/usr/bin".as_ref(), "/bin".as_ref()])
            .unwrap();
    let output = Command::new("sh")
        .args(["-c", &script])
        .env("PATH", path)
        .current_dir(&folder)
        .output()
        .unwrap();
    assert_eq!((output.status.code(), err(&output)), (Some(0), String::new()), "{script}");
    if script.ends_with("> picture.svg") {
        assert!(std::fs::read_to_string(folder.join("picture.svg")).unwrap().starts_with("<svg"));
    } else {
        assert!(serde_json::from_str::<Value>(&out(&output)).unwrap().is_object());
    }
}

#[test]
fn operations_on_surfaces_can_be_typed_as_two_words() {
    let (_, _, body) =
        examples().into_iter().find(|(path, ..)| *path == "/v1/surfaces/evaluate").unwrap();
    let body = body.to_string();
    assert_eq!(answered(&["surfaces", "evaluate"], &body), answered(&["surfaces/evaluate"], &body));
    let help = run(&["surfaces"], "");
    let listed = ["evaluate", "subdivide", "tessellate"];
    assert!(
        help.status.code() == Some(2) && listed.iter().all(|name| err(&help).contains(name)),
        "{help:?}"
    );
}

#[test]
fn a_misspelt_command_gets_a_suggestion() {
    for (typed, meant) in [
        ("evaluat", "'evaluate'"),
        ("to-bsplin", "'to-bspline'"),
        ("surface/evaluate", "'surfaces/evaluate'"),
        ("bach", "'batch'"),
    ] {
        let output = run(&[typed], "");
        assert!(
            output.status.code() == Some(2) && err(&output).contains(meant),
            "{typed}: {output:?}"
        );
    }
}

#[test]
fn a_request_comes_from_a_file_or_from_standard_input() {
    let path = file("request.json", REQUEST);
    let path = path.to_str().unwrap();
    assert_eq!(answered(&["evaluate", path], "not read"), ANSWER);
    assert_eq!(answered(&["evaluate", "-"], REQUEST), ANSWER);
    let lines = file("batch.ndjson", &format!("{LINE}\n"));
    let output = run(&["batch", "--quiet", lines.to_str().unwrap()], "not read");
    assert_eq!(out(&output), format!("{{\"line\":1,\"id\":7,\"answer\":{}}}\n", ANSWER.trim()));
    for wrong in ["/no/such/file", "/"] {
        for command in ["evaluate", "batch"] {
            let output = run(&[command, wrong], "");
            assert!(
                output.status.code() == Some(2) && err(&output).contains(&format!("{wrong}: ")),
                "{output:?}"
            );
        }
    }
}

#[test]
fn numbers_are_written_as_asked() {
    let thirds = REQUEST.replace("3]]", "0.1]]").replace("\"count\": 3", "\"count\": 4");
    let points = |arguments: &[&str]| {
        serde_json::from_str::<Value>(&answered(arguments, &thirds)).unwrap()["points"].clone()
    };
    assert_eq!(points(&["evaluate", "--precision", "2"])[1], json!([0.33, 0.033]));
    assert_eq!(points(&["evaluate", "--precision=single"])[1][0].to_string(), "0.33333334");
    assert_eq!(
        points(&["evaluate", "--layout", "flat", "--precision=1"]),
        json!([0.0, 0.0, 0.3, 0.03, 0.7, 0.07, 1.0, 0.1])
    );
    for wrong in ["0", "18", "double"] {
        let output = run(&["evaluate", "--precision", wrong], &thirds);
        assert!(
            output.status.code() == Some(2) && err(&output).contains("full, single, or 1 to 17"),
            "{output:?}"
        );
    }
    let batch = run(&["batch", "--layout=flat", "--precision=1"], LINE);
    assert!(out(&batch).contains("\"points\":[0.0,0.0,0.5,2.0,1.0,3.0]"), "{batch:?}");
}

#[test]
fn an_answer_is_laid_out_for_people_where_they_ask() {
    let long = REQUEST.replace("\"count\": 3", "\"count\": 33");
    let (pretty, compact) =
        (answered(&["evaluate", "--pretty"], &long), answered(&["evaluate", "--compact"], &long));
    assert!(pretty.lines().count() > 30 && compact.lines().count() == 1, "{pretty}");
    let bare = |text: &str| text.chars().filter(|c| !c.is_whitespace()).collect::<String>();
    assert_eq!(bare(&pretty), bare(&compact));
    assert_eq!(run(&["evaluate", "--pretty", "--compact"], &long).status.code(), Some(2));
}

#[test]
fn a_refusal_is_text_for_people_and_json_for_programs() {
    let wrong = REQUEST.replace("\"count\": 3", "\"count\": 1");
    let output = run(&["evaluate"], &wrong);
    assert_eq!((output.status.code(), out(&output)), (Some(1), String::new()));
    let text = err(&output);
    assert!(
        text.starts_with("springline evaluate: ")
            && text.contains("\n  /sampling/count: ")
            && !text.contains('{'),
        "{text}"
    );
    assert!(text.ends_with("`springline evaluate --help` shows a request that works.\n"), "{text}");
    let broken = err(&run(&["evaluate"], "{\n  \"curve\" 1}"));
    assert!(broken.contains("(line 2, column 11)"), "{broken}");
    let output = run(&["evaluate", "--json"], &wrong);
    assert_eq!((output.status.code(), out(&output)), (Some(1), String::new()));
    let problem: Value = serde_json::from_str(&err(&output)).unwrap();
    assert_eq!(problem, Server::start().post("/v1/evaluate", &wrong).json());
    let missing: Value =
        serde_json::from_str(&err(&run(&["evaluate", "--json", "/no/such/file"], ""))).unwrap();
    assert_eq!(missing["code"], "unreadable_file");
}

#[test]
fn the_page_on_the_command_line_shows_what_is_printed() {
    let page = include_str!("../../docs/command-line.md");
    let shown = page.split("```").find(|block| block.starts_with("\n$ echo '")).unwrap();
    let (command, printed) = shown.trim_start_matches("\n$ echo '").split_once('\n').unwrap();
    assert_eq!(err(&run(&["evaluate"], command.split('\'').next().unwrap())), printed);
}

#[test]
fn a_batch_ends_with_a_summary_and_strict_fails_where_a_line_did() {
    let (good, bad) = (format!("{LINE}\n\n{LINE}\n"), format!("{LINE}\n{{}}\n[]\n{LINE}\n"));
    let output = run(&["batch", "--strict"], &good);
    assert!(
        output.status.success()
            && err(&output).starts_with("springline batch: 2 lines, 0 failed, "),
        "{output:?}"
    );
    for (arguments, code) in [(["batch"].as_slice(), 0), (&["batch", "--strict"], 1)] {
        let output = run(arguments, &bad);
        assert!(
            output.status.code() == Some(code)
                && err(&output).starts_with("springline batch: 4 lines, 2 failed, "),
            "{output:?}"
        );
        assert_eq!(out(&output).lines().filter(|line| line.contains("\"problem\"")).count(), 2);
    }
    let summary: Value = serde_json::from_str(&err(&run(&["batch", "--json"], &bad))).unwrap();
    assert_eq!(
        (&summary["lines"], &summary["failed"], summary["seconds"].is_number()),
        (&json!(4), &json!(2), true)
    );
    assert_eq!(err(&run(&["batch", "--quiet"], &bad)), "");
}

#[test]
fn a_line_too_long_for_a_request_ends_the_batch() {
    let output = run(&["batch", "--strict"], &format!("{LINE}\n{}", "x".repeat(40 << 20)));
    let lines: Vec<Value> =
        out(&output).lines().map(|line| serde_json::from_str(line).unwrap()).collect();
    assert_eq!(
        (lines.len(), &lines[1]["line"], &lines[1]["problem"]["code"]),
        (2, &json!(2), &json!("too_large"))
    );
    assert_eq!(output.status.code(), Some(1));
}

/// What a reader that blocks has read; a test that never gets it fails instead of hanging.
fn soon<T: Send + 'static>(read: impl FnOnce() -> T + Send + 'static) -> T {
    let (send, receive) = mpsc::channel();
    thread::spawn(move || send.send(read()));
    receive.recv_timeout(Duration::from_secs(60)).expect("nothing came")
}

#[test]
fn a_batch_answers_each_line_before_the_next_is_sent() {
    let mut child = binary()
        .arg("batch")
        .stdin(Stdio::piped())
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .unwrap();
    let mut input = child.stdin.take().unwrap();
    let mut output = BufReader::new(child.stdout.take().unwrap());
    for number in 1..=3 {
        writeln!(input, "{LINE}").unwrap();
        let (line, back) = soon(move || {
            let mut line = String::new();
            output.read_line(&mut line).unwrap();
            (line, output)
        });
        assert!(line.starts_with(&format!("{{\"line\":{number},\"id\":7,\"answer\":")), "{line}");
        output = back;
    }
    drop(input);
    assert!(soon(move || child.wait()).unwrap().success());
}

#[test]
fn a_reader_that_has_seen_enough_ends_the_program_quietly() {
    let lines = format!("{LINE}\n").repeat(20_000);
    let commands: [(&[&str], &str); 4] =
        [(&["batch"], &lines), (&["openapi"], ""), (&["config"], ""), (&["evaluate"], REQUEST)];
    for (arguments, input) in commands {
        let mut command = binary();
        let mut child = command
            .args(arguments)
            .stdin(Stdio::piped())
            .stdout(Stdio::piped())
            .stderr(Stdio::piped())
            .spawn()
            .unwrap();
        let mut stdin = child.stdin.take().unwrap();
        let mut stdout = child.stdout.take().unwrap();
        if arguments == ["batch"] {
            let input = input.to_owned();
            thread::spawn(move || _ = stdin.write_all(input.as_bytes()));
            stdout.read_exact(&mut [0; 1]).unwrap();
            drop(stdout);
        } else {
            // Closed before anything is printed, where the program waits for its request; a race it
            // may win otherwise.
            drop(stdout);
            let _ = stdin.write_all(input.as_bytes());
            drop(stdin);
        }
        let output = soon(move || child.wait_with_output()).unwrap();
        assert_eq!((output.status.code(), err(&output)), (Some(0), String::new()), "{arguments:?}");
    }
}

#[cfg(unix)]
mod on_a_terminal {
    use std::fs::File;

    use nix::pty::openpty;

    use super::*;

    #[test]
    fn an_operation_says_that_it_waits_for_its_request() {
        for (command, what) in [("evaluate", "a request"), ("batch", "lines of JSON")] {
            let terminal = openpty(None, None).unwrap();
            let mut keyboard = File::from(terminal.master);
            let mut program = binary();
            program
                .arg(command)
                .stdin(terminal.slave)
                .stdout(Stdio::piped())
                .stderr(Stdio::piped());
            let mut child = program.spawn().unwrap();
            let mut stderr = BufReader::new(child.stderr.take().unwrap());
            let hint = soon(move || {
                let mut line = String::new();
                stderr.read_line(&mut line).unwrap();
                line
            });
            assert!(
                hint.contains(&format!("reads {what} from standard input"))
                    && hint.contains("Ctrl-D"),
                "{hint}"
            );
            let typed = if command == "batch" { LINE } else { REQUEST };
            keyboard.write_all(format!("{typed}\n\x04").as_bytes()).unwrap();
            let output = soon(move || child.wait_with_output()).unwrap();
            assert!(out(&output).contains(ANSWER.trim()), "{output:?}");
        }
    }

    /// The end of a terminal that nobody writes to any more is an error of input and output.
    fn shown(mut screen: File) -> String {
        let (mut all, mut piece) = (Vec::new(), [0; 4096]);
        while let Ok(count @ 1..) = screen.read(&mut piece) {
            all.extend_from_slice(&piece[..count]);
        }
        String::from_utf8(all).unwrap()
    }

    #[test]
    fn an_answer_is_laid_out_unless_it_is_to_be_compact() {
        let path = file("long.json", &REQUEST.replace("\"count\": 3", "\"count\": 33"));
        for (spacing, lines) in [(None, 30..99), (Some("--compact"), 1..2)] {
            let terminal = openpty(None, None).unwrap();
            let mut program = binary();
            program
                .arg("evaluate")
                .arg(&path)
                .args(spacing)
                .stdin(Stdio::null())
                .stdout(terminal.slave);
            let mut child = program.spawn().unwrap();
            // It holds the terminal open.
            drop(program);
            let screen = File::from(terminal.master);
            let text = soon(move || shown(screen));
            assert!(child.wait().unwrap().success());
            assert!(lines.contains(&text.lines().count()), "{text}");
        }
    }
}
