//! JSON for people: the same text with spaces and lines between its parts. No number is read or
//! written again.

/// Columns that a line should keep to.
const WIDTH: usize = 100;

/// Lays out compact JSON. What fits on the rest of a line stays on it; so do lists of numbers,
/// however long.
pub fn pretty(compact: &[u8]) -> Vec<u8> {
    let mut page =
        Page { text: compact, at: 0, out: Vec::with_capacity(2 * compact.len()), indent: 0 };
    while page.at < page.text.len() {
        page.part();
    }
    page.out
}

struct Page<'a> {
    text: &'a [u8],
    at: usize,
    out: Vec<u8>,
    indent: usize,
}

impl Page<'_> {
    /// The next bracket, separator, text or plain value.
    fn part(&mut self) {
        match self.text[self.at] {
            b'{' | b'[' => {
                let end = end_of(self.text, self.at);
                if self.fits(end) { self.on_one_line(end) } else { self.open() }
            }
            byte @ (b'}' | b']') => {
                self.indent = self.indent.saturating_sub(1);
                self.line();
                self.push(byte);
            }
            b',' => {
                self.push(b',');
                self.line();
            }
            b':' => self.push_all(b": "),
            b'"' => self.copy(end_of_text(self.text, self.at)),
            byte => self.push(byte),
        }
    }

    fn open(&mut self) {
        self.push(self.text[self.at]);
        self.indent += 1;
        self.line();
    }

    fn push(&mut self, byte: u8) {
        self.push_all(&[byte]);
    }

    /// Takes the next byte as these.
    fn push_all(&mut self, bytes: &[u8]) {
        self.out.extend_from_slice(bytes);
        self.at += 1;
    }

    fn copy(&mut self, end: usize) {
        self.out.extend_from_slice(&self.text[self.at..end]);
        self.at = end;
    }

    fn line(&mut self) {
        self.out.push(b'\n');
        self.out.resize(self.out.len() + 2 * self.indent, b' ');
    }

    /// Whether the value up to here fits on the line, or is a list of plain values.
    fn fits(&self, end: usize) -> bool {
        let value = &self.text[self.at..end];
        let start =
            self.out.iter().rposition(|byte| *byte == b'\n').map_or(0, |newline| newline + 1);
        let spaces = value.iter().filter(|byte| matches!(byte, b',' | b':')).count();
        self.out.len() - start + value.len() + spaces <= WIDTH
            || (value[0] == b'['
                && !value[1..].iter().any(|byte| matches!(byte, b'[' | b'{' | b'"')))
    }

    fn on_one_line(&mut self, end: usize) {
        while self.at < end {
            match self.text[self.at] {
                b',' => self.push_all(b", "),
                b':' => self.push_all(b": "),
                b'"' => self.copy(end_of_text(self.text, self.at)),
                byte => self.push(byte),
            }
        }
    }
}

/// Where the object or list that begins here ends.
fn end_of(text: &[u8], start: usize) -> usize {
    let (mut at, mut depth) = (start, 0_usize);
    while at < text.len() {
        match text[at] {
            b'"' => at = end_of_text(text, at) - 1,
            b'{' | b'[' => depth += 1,
            b'}' | b']' => depth = depth.saturating_sub(1),
            _ => {}
        }
        at += 1;
        if depth == 0 {
            break;
        }
    }
    at
}

/// Where the text that begins here ends.
fn end_of_text(text: &[u8], start: usize) -> usize {
    let mut at = start + 1;
    while at < text.len() && text[at] != b'"' {
        at += 1 + usize::from(text[at] == b'\\');
    }
    (at + 1).min(text.len())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn laid_out(compact: &str) -> String {
        String::from_utf8(pretty(compact.as_bytes())).unwrap()
    }

    #[test]
    fn what_fits_stays_on_its_line() {
        assert_eq!(
            laid_out(r#"{"a":[1.0,-2e-7],"b":"x,\"{:"}"#),
            r#"{"a": [1.0, -2e-7], "b": "x,\"{:"}"#
        );
        assert_eq!(laid_out("{}"), "{}");
        assert_eq!(laid_out("\"a:b\""), "\"a:b\"");
    }

    #[test]
    fn what_does_not_fit_is_laid_out_in_lines() {
        let point = format!("[{0},{0}]", "1".repeat(30));
        let spaced = point.replace(',', ", ");
        let expected = format!(
            "{{\n  \"points\": [\n    {spaced},\n    {spaced}\n  ],\n  \"closed\": false\n}}"
        );
        assert_eq!(
            laid_out(&format!("{{\"points\":[{point},{point}],\"closed\":false}}")),
            expected
        );
    }

    #[test]
    fn a_list_of_numbers_stays_on_one_line() {
        let list = format!("[{}]", vec!["0.125"; 100].join(","));
        assert_eq!(laid_out(&list), list.replace(',', ", "));
    }

    #[test]
    fn it_is_the_same_value() {
        let long = "y".repeat(90);
        for text in [
            r#"{"a":{"b":[{"c":"\\"},[],{}]},"d":null}"#.to_owned(),
            format!(r#"["{long}","\"{long}",[["{long}"]]]"#),
        ] {
            let value = |text: &str| serde_json::from_str::<serde_json::Value>(text).unwrap();
            assert_eq!(value(&laid_out(&text)), value(&text));
        }
    }
}
