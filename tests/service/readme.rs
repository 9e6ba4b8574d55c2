//! README.md and the pages in docs/ show real output. Every call in them is sent to the real
//! binary, and its answer compared with the one printed.

use std::fs;
use std::path::{Path, PathBuf};

use crate::support::Server;
use serde_json::Value;

fn root() -> &'static Path {
    Path::new(env!("CARGO_MANIFEST_DIR"))
}

/// README.md and every page in docs/.
fn pages() -> Vec<PathBuf> {
    let entries = fs::read_dir(root().join("docs")).unwrap().map(|entry| entry.unwrap().path());
    let mut pages: Vec<_> =
        entries.filter(|path| path.extension().is_some_and(|it| it == "md")).collect();
    pages.push(root().join("README.md"));
    pages.sort();
    pages
}

/// A fenced block: its language and its text.
type Block = (String, String);

/// The fenced blocks of all pages, in order.
fn blocks() -> Vec<Block> {
    let of_page = |page: &PathBuf| {
        let text = fs::read_to_string(page).unwrap();
        let fenced = text.split("```").skip(1).step_by(2);
        fenced.filter_map(|block| block.split_once('\n')).map(owned).collect::<Vec<_>>()
    };
    pages().iter().flat_map(of_page).collect()
}

fn owned((language, text): (&str, &str)) -> Block {
    (language.to_owned(), text.to_owned())
}

/// A curl command, with the block after it.
struct Call {
    command: String,
    next: Block,
}

impl Call {
    fn path(&self) -> &str {
        let address = self.command.split("localhost:8080").nth(1).unwrap();
        address.split_whitespace().next().unwrap()
    }

    fn body(&self) -> &str {
        self.command.split("-d '").nth(1).unwrap().split('\'').next().unwrap()
    }

    /// The file that the answer goes to.
    fn file(&self) -> Option<&str> {
        self.command.rsplit_once("' > ").map(|(_, file)| file.trim())
    }
}

fn calls() -> Vec<Call> {
    let mut blocks = blocks();
    blocks.push(Block::default());
    let is_call = |block: &Block| block.0 == "sh" && block.1.contains("curl -s localhost:8080/v1/");
    let calls = blocks.windows(2).filter(|pair| is_call(&pair[0]));
    calls.map(|pair| Call { command: pair[0].1.clone(), next: pair[1].clone() }).collect()
}

/// A call prints its answer in the block that follows, or draws a picture of docs/images.
#[test]
fn the_answers_shown_are_the_answers_given() {
    let calls = calls();
    let server = Server::start();
    for operation in springline::api::operations::TABLE.iter().map(|entry| entry.path) {
        assert!(calls.iter().any(|call| call.path() == operation), "no call of {operation}");
    }
    for call in &calls {
        let answer = server.post(call.path(), call.body());
        if let Some(file) = call.file() {
            let kept =
                fs::read_to_string(root().join("docs/images").join(file)).unwrap_or_default();
            assert!(answer.text() == kept, "docs/images/{file} is not the answer to its call");
            continue;
        }
        assert_eq!(call.next.0, "json", "no answer is shown to {}", call.command);
        let shown: Value = serde_json::from_str(&call.next.1).expect("the answer shown is JSON");
        assert_eq!(answer.json(), shown, "{}", call.command);
    }
}

/// Lines of a batch, and the lines that answer them; an ellipsis stands for what is left out.
#[test]
fn the_batches_shown_are_answered_as_shown() {
    let blocks = blocks();
    let lines: Vec<_> = blocks.iter().filter(|block| block.0 == "ndjson").collect();
    assert!(!lines.is_empty() && lines.len() % 2 == 0, "{} blocks", lines.len());
    let server = Server::start();
    for pair in lines.chunks(2) {
        let answer = server.post_as("/v1/batch", Some("application/x-ndjson"), &pair[0].1);
        let (given, shown) = (answer.text(), &pair[1].1);
        assert_eq!(given.lines().count(), shown.lines().count(), "{given}");
        for (given, shown) in given.lines().zip(shown.lines()) {
            let (start, end) = shown.split_once("...").unwrap_or((shown, ""));
            assert!(given.starts_with(start) && given.ends_with(end), "{given}\n{shown}");
        }
    }
}

/// The anchor that GitHub gives a heading.
fn anchor(heading: &str) -> String {
    let kept = heading.chars().filter(|c| c.is_alphanumeric() || " -_".contains(*c));
    kept.collect::<String>().trim().to_lowercase().replace(' ', "-")
}

fn headings(page: &Path) -> Vec<String> {
    let text = fs::read_to_string(page).unwrap();
    let prose = text.split("```").step_by(2).flat_map(str::lines);
    let headings = prose.filter(|line| line.starts_with('#'));
    headings.map(|line| anchor(line.trim_start_matches('#'))).collect()
}

/// Links to files and headings of the repository.
#[test]
fn every_link_leads_somewhere() {
    let others = ["CONTRIBUTING.md", "CHANGELOG.md", "deploy/README.md", "bench/README.md"];
    let others = others.into_iter().chain(["fuzz/README.md", "examples/README.md"]);
    let mut count = 0;
    for page in pages().into_iter().chain(others.map(|name| root().join(name))) {
        let text = fs::read_to_string(&page).unwrap();
        let targets = text.split("](").skip(1).filter_map(|rest| rest.split(')').next());
        for target in targets.filter(|target| !target.starts_with("http")) {
            let (file, heading) = target.split_once('#').unwrap_or((target, ""));
            let path = if file.is_empty() { page.clone() } else { page.with_file_name(file) };
            assert!(path.exists(), "{}: {target}", page.display());
            let leads = heading.is_empty() || headings(&path).iter().any(|it| it == heading);
            assert!(leads, "{}: {target}", page.display());
            count += 1;
        }
    }
    assert!(count > 50, "{count}");
}
