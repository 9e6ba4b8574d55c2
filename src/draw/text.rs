//! Numbers and words in XML.

use crate::core::fault::Fault;

/// A pixel coordinate, rounded to 1/100.
pub fn number(x: f64) -> String {
    let rounded = format!("{x:.2}");
    let short = rounded.trim_end_matches('0').trim_end_matches('.');
    if short == "-0" { "0".into() } else { short.into() }
}

/// Text as XML content or attribute value.
pub fn escape(text: &str) -> String {
    let mut escaped = String::with_capacity(text.len());
    for c in text.chars() {
        match c {
            '&' => escaped.push_str("&amp;"),
            '<' => escaped.push_str("&lt;"),
            '>' => escaped.push_str("&gt;"),
            '"' => escaped.push_str("&quot;"),
            '\'' => escaped.push_str("&#39;"),
            _ => escaped.push(c),
        }
    }
    escaped
}

/// Refuses text that a picture cannot show.
///
/// # Errors
/// [`Fault::UnsuitableText`]: too long, or with characters that XML does not know.
pub fn check_text(text: &str, most: usize) -> Result<(), Fault> {
    let count = text.chars().count();
    if count > most {
        return Err(Fault::UnsuitableText(format!(
            "this text has {count} characters; at most {most} are drawn"
        )));
    }
    let unknown = |c: &char| c.is_control() || matches!(c, '\u{fffe}' | '\u{ffff}');
    match text.chars().find(unknown) {
        Some(c) => Err(Fault::UnsuitableText(format!(
            "the character U+{:04X} cannot be drawn; leave it out",
            u32::from(c)
        ))),
        None => Ok(()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_are_short_and_never_minus_zero() {
        let cases = [
            (0.0, "0"),
            (-0.001, "0"),
            (1.5, "1.5"),
            (100.0, "100"),
            (2.345_678, "2.35"),
            (-7.25, "-7.25"),
        ];
        cases.iter().for_each(|(x, text)| assert_eq!(number(*x), *text));
    }

    #[test]
    fn markup_and_control_characters_do_not_pass() {
        assert_eq!(escape("<a href=\"x\">&'"), "&lt;a href=&quot;x&quot;&gt;&amp;&#39;");
        assert!(check_text("β = 1 < 2", 20).is_ok());
        assert!(
            check_text("a\u{0}", 20).is_err()
                && check_text("a\nb", 20).is_err()
                && check_text("abc", 2).is_err()
        );
    }
}
