//! The order in which values stand in a text.

use std::fmt;

use serde::de::{Deserializer, MapAccess, SeqAccess, Visitor};
use serde_json::value::RawValue;

/// Where in a text a value begins and ends, among others.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Rank {
    /// Its beginning.
    pub start: usize,
    /// Its end.
    pub end: usize,
}

/// The ranks of the values at these places, in the order of the text; of those that are nowhere,
/// the last.
pub fn ranks(text: &RawValue, pointers: &[String]) -> Vec<Rank> {
    let mut ranks = vec![Rank { start: usize::MAX, end: usize::MAX }; pointers.len()];
    rank(text, "", pointers, &mut 0, &mut ranks);
    ranks
}

/// Goes where a pointer leads, and only there.
fn rank(text: &RawValue, at: &str, pointers: &[String], next: &mut usize, ranks: &mut [Rank]) {
    let start = *next;
    *next += 1;
    rank_inside(text, at, pointers, next, ranks);
    for (pointer, rank) in pointers.iter().zip(ranks) {
        if pointer == at && rank.start == usize::MAX {
            *rank = Rank { start, end: *next };
        }
    }
    *next += 1;
}

fn rank_inside(
    text: &RawValue,
    at: &str,
    pointers: &[String],
    next: &mut usize,
    ranks: &mut [Rank],
) {
    let within = format!("{at}/");
    let inside: Vec<&str> =
        pointers.iter().filter_map(|pointer| pointer.strip_prefix(&within)).collect();
    let leads = |step: &str| {
        inside.iter().any(|rest| {
            rest.strip_prefix(step).is_some_and(|rest| rest.is_empty() || rest.starts_with('/'))
        })
    };
    if inside.is_empty() {
        return;
    }
    let mut step_in = |step: String, value: &RawValue| {
        if leads(&step) {
            rank(value, &format!("{within}{step}"), pointers, next, ranks);
        }
    };
    let mut parser = serde_json::Deserializer::from_str(text.get());
    // Neither an array nor an object has nothing inside.
    let _ = parser.deserialize_any(Walk(&mut step_in));
}

/// Hands out what is in an array or an object, with its step.
struct Walk<'a>(&'a mut dyn FnMut(String, &RawValue));

impl<'de> Visitor<'de> for Walk<'_> {
    type Value = ();

    fn expecting(&self, f: &mut fmt::Formatter) -> fmt::Result {
        f.write_str("an array or an object")
    }

    fn visit_seq<A: SeqAccess<'de>>(self, mut seq: A) -> Result<(), A::Error> {
        let mut index = 0_usize;
        while let Some(value) = seq.next_element()? {
            (self.0)(index.to_string(), value);
            index += 1;
        }
        Ok(())
    }

    fn visit_map<A: MapAccess<'de>>(self, mut map: A) -> Result<(), A::Error> {
        while let Some((key, value)) = map.next_entry::<String, &RawValue>()? {
            (self.0)(key.replace('~', "~0").replace('/', "~1"), value);
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn places_are_ranked_as_they_come() {
        let text: &RawValue = serde_json::from_str(r#"{"b": [1, {"c/d": 2}], "a": 3}"#).unwrap();
        let pointers = ["/a", "", "/b/1/c~1d", "/b", "/b/0", "/nowhere"].map(String::from);
        let ranks = ranks(text, &pointers);
        let mut order: Vec<usize> = (0..6).collect();
        order.sort_by_key(|&i| ranks[i].start);
        assert_eq!(order, [1, 3, 4, 2, 0, 5]);
        order.sort_by_key(|&i| ranks[i].end);
        assert_eq!(order, [4, 2, 3, 0, 1, 5]);
    }
}
