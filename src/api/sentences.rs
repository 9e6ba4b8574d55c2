//! What the parser of JSON says, in sentences.

/// What the parser says, and what that means.
const SENTENCES: &[(&str, &str)] = &[
    ("EOF while parsing a list", "the body ends in the middle of an array"),
    ("EOF while parsing an object", "the body ends in the middle of an object"),
    ("EOF while parsing a string", "the body ends in the middle of a string"),
    ("EOF while parsing a value", "the body ends where a value is expected"),
    ("expected value", "a JSON value is expected here; NaN, Infinity and bare words are none"),
    ("expected ident", "this word is not JSON, which knows true, false and null"),
    ("expected `:`", "a colon is expected after the name of a field"),
    ("expected `,` or `]`", "a comma or a closing bracket is expected here"),
    ("expected `,` or `}`", "a comma or a closing brace is expected here"),
    ("trailing comma", "there is a comma before a closing bracket or brace; leave it out"),
    ("trailing characters", "there is more after the end of the JSON; send one value"),
    ("key must be a string", "the name of a field must be a string in double quotes"),
    (
        "control character",
        "there is a control character in a string; write it as an escape, such as \\n or \\u0009",
    ),
    ("invalid escape", "there is an unknown escape in a string; a backslash is written \\\\"),
    (
        "invalid number",
        "this is not a number of JSON, which has no leading zeros or plus signs, and digits on both sides of a point",
    ),
    ("invalid unicode code point", "the text is not UTF-8"),
    ("lone leading surrogate", "half of a surrogate pair stands alone in a \\u escape"),
    ("unexpected end of hex escape", "half of a surrogate pair stands alone in a \\u escape"),
    ("number out of range", "this number is out of range: doubles end at 1.8e308"),
    ("recursion limit", "the JSON is nested too deeply"),
];

/// The parser's message as a sentence.
pub(crate) fn in_json_terms(error: &serde_json::Error) -> String {
    let text = error.to_string();
    let message = text.rsplit_once(" at line ").map_or(text.as_str(), |(message, _)| message);
    let known = SENTENCES.iter().find(|(begins, _)| message.starts_with(begins));
    known.map_or_else(|| shortened(message), |(_, sentence)| (*sentence).into())
}

/// The beginning and the end of a long text.
pub(crate) fn shortened(text: &str) -> String {
    const KEPT: usize = 200;
    let count = text.chars().count();
    if count <= 2 * KEPT {
        return text.to_owned();
    }
    let (start, end): (String, String) =
        (text.chars().take(KEPT).collect(), text.chars().skip(count - KEPT).collect());
    format!("{start} [...] {end}")
}
