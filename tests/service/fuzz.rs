//! The laws of `fuzz/` on mutated examples and random bytes, the same ones every time;
//! `PROPTEST_RNG_SEED` chooses others.

#[path = "../../fuzz/src/lib.rs"]
mod targets;

use std::cell::Cell;

use crate::laws::law;
use crate::support::mutate::{Random, hostile, mangle, mutate};
use proptest::collection::vec;
use proptest::prelude::*;
use serde_json::Value;

/// An example, then changes of its structure and of its bytes, each by the seed of a generator.
fn mutated(examples: Vec<Value>) -> impl Strategy<Value = Vec<u8>> {
    let parts = (0..examples.len(), vec(any::<u64>(), 0..4), vec(any::<u64>(), 0..3));
    parts.prop_map(move |(which, structure, bytes)| {
        let hostile = hostile();
        let value = structure.iter().fold(examples[which].clone(), |value, &seed| {
            mutate(&value, &mut Random(seed), &hostile)
        });
        let mut text = value.to_string().into_bytes();
        bytes.iter().for_each(|&seed| mangle(&mut text, &mut Random(seed)));
        text
    })
}

#[test]
fn mutated_examples_keep_the_laws_of_every_operation() {
    const CASES: u32 = 600; // of each operation
    for (path, holds) in targets::laws() {
        let examples = crate::support::examples()
            .into_iter()
            .filter(|(of, ..)| *of == path)
            .map(|(.., body)| body)
            .collect();
        let accepted = Cell::new(0);
        law(CASES, mutated(examples), |body| {
            accepted.set(accepted.get() + u32::from(holds(&body)))
        });
        assert!(
            (CASES / 20..CASES).contains(&accepted.get()),
            "{path}: {} of {CASES} accepted",
            accepted.get()
        );
    }
}

#[test]
fn any_curve_the_core_accepts_works() {
    const CASES: u32 = 20_000;
    let accepted = Cell::new(0);
    law(CASES, vec(any::<u8>(), 0..300), |bytes| {
        accepted.set(accepted.get() + u32::from(targets::curve(&bytes)))
    });
    assert!(
        (CASES / 10..CASES).contains(&accepted.get()),
        "{} of {CASES} accepted",
        accepted.get()
    );
}
