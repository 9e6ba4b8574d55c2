//! Examples turned into hostile requests, by seed.
#![allow(dead_code, reason = "each test binary uses a part")]

use serde_json::{Value, json};

use super::{places, with, with_key, without_key};

/// A small generator (Steele et al. 2014, SplitMix64), so that a failure can be replayed.
pub struct Random(pub u64);

impl Random {
    pub fn next(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let z = (self.0 ^ (self.0 >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        let z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        z ^ (z >> 31)
    }

    pub fn below(&mut self, limit: usize) -> usize {
        (self.next() % limit as u64) as usize
    }

    pub fn pick<'a, T>(&mut self, list: &'a [T]) -> &'a T {
        &list[self.below(list.len())]
    }
}

/// Values that fit hardly anywhere.
pub fn hostile() -> Vec<Value> {
    let numbers = [
        0.0,
        -0.0,
        -1.0,
        0.5,
        2.0,
        3.0,
        64.0,
        65.0,
        5e-324,
        1e-300,
        1e-17,
        1e17,
        1e150,
        1e308,
        -1e308,
        f64::MAX,
        9007199254740993.0,
    ];
    let others = [
        json!(null),
        json!(true),
        json!(""),
        json!("bezier"),
        json!("piecewise"),
        json!("bspline"),
        json!("knots"),
        json!("derivative"),
        json!([]),
        json!({}),
        json!([[]]),
        json!([[0, 0], [0, 0]]),
        json!([0, 0]),
        json!([1, 2, 3]),
        json!([0, 0, 0, 0]),
        json!({"family": "bezier"}),
        json!({"family": "beta-bezier", "lambda": 0}),
        json!({"kind": "natural"}),
        json!({"kind": "not-a-knot"}),
        json!({"kind": "depth", "depth": 3}),
        json!({"kind": "tolerance", "tolerance": 1e-9}),
        json!(u64::MAX),
        json!(i64::MIN),
        json!([1e308, -1e308]),
        json!([[1, 0], [0, 1]]),
        json!("\u{0}"),
    ];
    numbers.into_iter().map(Value::from).chain(others).collect()
}

/// One change somewhere in a value.
pub fn mutate(value: &Value, random: &mut Random, hostile: &[Value]) -> Value {
    let known = places(value);
    let (place, at) = random.pick(&known);
    match (random.next() % 8, at) {
        (0, _) => with(value, place, random.pick(&known).1.clone()),
        (1, Value::Array(items)) if !items.is_empty() => {
            with(value, place, shuffled(items, random))
        }
        (2, Value::Object(fields)) if !fields.is_empty() => {
            let keys: Vec<_> = fields.keys().collect();
            without_key(value, place, random.pick::<&String>(&keys))
        }
        (3, Value::Object(_)) => {
            let keys = [
                "beta",
                "lambda",
                "alpha",
                "closed",
                "basis",
                "bases",
                "derivatives",
                "form",
                "knots",
                "start",
                "report",
                "weights",
            ];
            with_key(value, place, random.pick::<&str>(&keys), random.pick(hostile).clone())
        }
        (4, Value::Number(number)) => with(
            value,
            place,
            json!(number.as_f64().unwrap() * random.pick(&[-1.0, 1e10, 1e-10, 1.0 + 1e-12, 1e200])),
        ),
        _ => with(value, place, random.pick(hostile).clone()),
    }
}

/// A list with one item left out, given twice, or swapped with another.
fn shuffled(items: &[Value], random: &mut Random) -> Value {
    let mut items = items.to_vec();
    let (i, j) = (random.below(items.len()), random.below(items.len()));
    match random.next() % 3 {
        0 => drop(items.remove(i)),
        1 => items.insert(i, items[i].clone()),
        _ => items.swap(i, j),
    }
    Value::Array(items)
}

/// One change somewhere in a text: a byte replaced, put in or taken out, or a run of bytes given
/// twice or taken out.
pub fn mangle(bytes: &mut Vec<u8>, random: &mut Random) {
    let byte = *random.pick(b"{}[]\",:.-+eE019\\/ \x00\x80\xff\xc3utnfl");
    let at = random.below(bytes.len() + 1);
    let end = (at + random.below(20)).min(bytes.len());
    match random.next() % 5 {
        0 if at < bytes.len() => bytes[at] = byte,
        1 if at < bytes.len() => drop(bytes.remove(at)),
        2 => drop(bytes.drain(at..end)),
        3 => bytes.splice(at..at, bytes[at..end].to_vec()).for_each(drop),
        _ => bytes.insert(at, byte),
    }
}
