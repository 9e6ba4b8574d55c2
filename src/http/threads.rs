//! Threads for the parts of an answer.

use std::panic::resume_unwind;
use std::thread;

use crate::api::memory::NoRoom;
use crate::api::side::Part;

/// Runs the first part here, and each other on a thread of its own.
///
/// # Errors
/// [`NoRoom`] where there is none for one more thread.
pub fn run(parts: Vec<Part>) -> Result<(), NoRoom> {
    let mut parts = parts.into_iter();
    let first = parts.next();
    thread::scope(|scope| {
        let spawn = |part| thread::Builder::new().spawn_scoped(scope, part).map_err(|_| NoRoom);
        let others = parts.map(spawn).collect::<Result<Vec<_>, _>>()?;
        if let Some(first) = first {
            first();
        }
        for other in others {
            other.join().unwrap_or_else(|panic| resume_unwind(panic));
        }
        Ok(())
    })
}

#[cfg(test)]
mod tests {
    use std::sync::Barrier;
    use std::sync::atomic::{AtomicUsize, Ordering};

    use super::*;
    use crate::api::chunks::Buffer;
    use crate::api::memory;
    use crate::api::number_text::{NumberText, Numbers};
    use crate::api::output::Format;
    use crate::core::context::Context;

    #[test]
    fn parts_run_at_once() {
        let barrier = Barrier::new(3);
        let met = AtomicUsize::new(0);
        let meet = || {
            barrier.wait();
            met.fetch_add(1, Ordering::Relaxed);
        };
        run(std::iter::repeat_with(|| Box::new(meet) as Part).take(3).collect()).unwrap();
        assert_eq!(met.into_inner(), 3);
    }

    #[test]
    fn a_list_has_the_same_bytes_on_any_number_of_threads() {
        let values: Vec<f64> = (0..100_000).map(|i| f64::from(i).sin()).collect();
        let written = |parts| {
            let memory = memory::unlimited();
            let mut buffer = Buffer::new(&Context::default(), &memory).side_by_side(parts, run);
            let numbers = Numbers { columns: 2, values: &values };
            let text = &mut NumberText::default();
            numbers.write_json(Format::default(), text, &mut buffer).unwrap();
            buffer.finish().concat()
        };
        let alone = written(1);
        assert!([2, 3, 5].into_iter().all(|parts| written(parts) == alone));
    }

    #[test]
    #[should_panic(expected = "in a part")]
    fn a_panic_of_a_part_is_one_here() {
        let _ = run(vec![Box::new(|| ()), Box::new(|| panic!("in a part"))]);
    }
}
