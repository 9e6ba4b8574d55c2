//! Answers compressed on the workers, for clients that ask and where the operator allows it.

use std::io::{self, Write};
use std::sync::{Arc, Mutex, PoisonError};

use flate2::Compression;
use flate2::write::GzEncoder;
use tokio::time::Instant;
use zstd::stream::write::Encoder as ZstdEncoder;
use zstd::zstd_safe::{CParameter, ParamSwitch};

use crate::api::chunks::Chunks;
use crate::api::memory::{Memory, Reservation};
use crate::api::problem::Problem;
use crate::core::context::Context;
use crate::http::coding::Coding;
use crate::http::pool::{Failure, Pool};
use crate::http::refusal::failed;
use crate::http::service::Service;

/// Shorter texts are sent as they are: they fit into the packet of their head.
pub const WORTH_IT: u64 = 1_024;
/// What an encoder holds: zstd with the window below takes some 500 KiB, gzip less.
const MEMORY: usize = 640 << 10;
/// Numbers repeat little, so most of the gain is in writing their digits in fewer bits, which zstd
/// would leave out at this level if it were not told. For 10,000 samples this takes half the time
/// of level 1; the text is 6 % longer.
const ZSTD_LEVEL: i32 = -7;
/// Repetitions are looked for in the last 64 KiB: more would make no answer smaller, but the
/// encoder larger.
const ZSTD_WINDOW: u32 = 16;
/// The least that writes digits in fewer bits.
const GZIP_LEVEL: u32 = 2;

/// One compressed text in the making: it may be packed in parts, each of which can be read when it
/// arrives.
pub struct Packer {
    encoder: Encoder,
    coding: Coding,
    _memory: Reservation,
}

enum Encoder {
    Zstd(ZstdEncoder<'static, Vec<u8>>),
    Gzip(GzEncoder<Vec<u8>>),
}

/// What comes after a part.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Then {
    More,
    End,
}

impl Packer {
    /// Its memory is taken from the budget; nothing where there is no room. `length` is that of the
    /// whole text, if known.
    pub fn new(coding: Coding, length: Option<u64>, budget: &Arc<dyn Memory>) -> Option<Self> {
        let mut memory = Reservation::of(budget);
        memory.grow_to(MEMORY).ok()?;
        let encoder = match coding {
            Coding::Zstd => Encoder::Zstd(zstd(length).ok()?),
            Coding::Gzip => Encoder::Gzip(GzEncoder::new(Vec::new(), Compression::new(GZIP_LEVEL))),
        };
        Some(Packer { encoder, coding, _memory: memory })
    }

    /// How it packs.
    pub fn coding(&self) -> Coding {
        self.coding
    }

    /// Packs a part.
    ///
    /// # Errors
    /// Nobody waits any more.
    pub fn pack(&mut self, context: &Context, part: Chunks) -> Result<Chunks, Problem> {
        self.feed(context, part, Then::More)
    }

    /// What ends the text.
    ///
    /// # Errors
    /// None that can happen.
    pub fn finish(mut self) -> io::Result<Vec<u8>> {
        self.put(&[], Some(Then::End))
    }

    fn feed(&mut self, context: &Context, text: Chunks, then: Then) -> Result<Chunks, Problem> {
        text.packed(|chunk, is_last| {
            context.checkpoint()?;
            // Writing to memory does not fail.
            self.put(chunk, is_last.then_some(then)).map_err(|_| Problem::internal())
        })
    }

    fn put(&mut self, text: &[u8], then: Option<Then>) -> io::Result<Vec<u8>> {
        macro_rules! put {
            ($encoder:ident, $end:ident) => {{
                *$encoder.get_mut() = Vec::with_capacity(text.len() / 2);
                $encoder.write_all(text)?;
                match then {
                    None => {}
                    Some(Then::More) => $encoder.flush()?,
                    Some(Then::End) => $encoder.$end()?,
                }
                let mut packed = std::mem::take($encoder.get_mut());
                packed.shrink_to_fit();
                Ok(packed)
            }};
        }
        match &mut self.encoder {
            Encoder::Zstd(encoder) => put!(encoder, do_finish),
            Encoder::Gzip(encoder) => put!(encoder, try_finish),
        }
    }
}

fn zstd(length: Option<u64>) -> io::Result<ZstdEncoder<'static, Vec<u8>>> {
    let mut encoder = ZstdEncoder::new(Vec::new(), ZSTD_LEVEL)?;
    encoder.set_parameter(CParameter::LiteralCompressionMode(ParamSwitch::Enable))?;
    encoder.set_parameter(CParameter::WindowLog(ZSTD_WINDOW))?;
    encoder.set_pledged_src_size(length)?;
    Ok(encoder)
}

/// That an answer is to be packed.
#[derive(Debug, Clone)]
pub struct Packing {
    /// How.
    pub coding: Coding,
    /// With whose workers and memory.
    pub service: Arc<Service>,
    /// Until when.
    pub deadline: Instant,
}

impl Packing {
    /// The text packed, within a computation; as it is where it is short, packed already, or there
    /// is no room for an encoder.
    ///
    /// # Errors
    /// Nobody waits any more.
    pub fn pack(&self, context: &Context, text: Chunks) -> Result<Chunks, Problem> {
        if !worth_it(&text) {
            return Ok(text);
        }
        match Packer::new(self.coding, Some(text.len()), &self.service.memory) {
            Some(mut packer) => packer.feed(context, text, Then::End),
            None => Ok(text),
        }
    }

    /// The same on a worker, for a text written elsewhere; as it is where no worker has time for
    /// it.
    ///
    /// # Errors
    /// The deadline.
    pub async fn on_a_worker(self, text: Chunks) -> Result<Chunks, Problem> {
        if !worth_it(&text) {
            return Ok(text);
        }
        let (service, deadline) = (self.service.clone(), self.deadline);
        match hand_over(&service.pool, deadline, text, move |context, text| {
            self.pack(context, text)
        })
        .await
        {
            Ok(packed) => packed,
            Err(Refused::Full(text)) => Ok(text),
            Err(Refused::Failed(failure)) => Err(failed(&service, failure)),
        }
    }
}

fn worth_it(text: &Chunks) -> bool {
    text.len() >= WORTH_IT && !text.is_packed()
}

/// Why a worker did not do it.
pub enum Refused<T> {
    /// There was no room for it; here it is again.
    Full(T),
    /// It is lost.
    Failed(Failure),
}

/// Has a worker do something with a value, which comes back where there is no room.
///
/// # Errors
/// As [`Pool::run`].
pub async fn hand_over<T: Send + 'static, R: Send + 'static>(
    pool: &Pool,
    deadline: Instant,
    value: T,
    job: impl FnOnce(&Context, T) -> R + Send + 'static,
) -> Result<R, Refused<T>> {
    let held = Arc::new(Mutex::new(Some(value)));
    let take = |held: &Mutex<Option<T>>| held.lock().unwrap_or_else(PoisonError::into_inner).take();
    let taken = held.clone();
    match pool.run(deadline, move |context| take(&taken).map(|value| job(context, value))).await {
        Ok(Some(done)) => Ok(done),
        Err(Failure::Full) => {
            Err(take(&held).map_or(Refused::Failed(Failure::Full), Refused::Full))
        }
        Ok(None) => Err(Refused::Failed(Failure::Panicked)),
        Err(failure) => Err(Refused::Failed(failure)),
    }
}

#[cfg(test)]
mod tests {
    use std::io::Read;

    use super::*;
    use crate::api::chunks::{Buffer, CHUNK};
    use crate::api::memory;
    use crate::core::cancellation::Cancellation;

    const BOTH: [Coding; 2] = [Coding::Zstd, Coding::Gzip];

    fn numbers(count: usize) -> Vec<u8> {
        (0..count).flat_map(|i| format!("{},", (i as f64).sin()).into_bytes()).collect()
    }

    fn chunks(text: &[u8], budget: &Arc<dyn Memory>) -> Chunks {
        let mut buffer = Buffer::new(&Context::default(), budget);
        text.chunks(1_000).for_each(|piece| buffer.write_all(piece).unwrap());
        buffer.finish()
    }

    /// One member or frame and not a byte more: that is all that many clients read.
    fn unpacked(coding: Coding, packed: &[u8]) -> Vec<u8> {
        let (mut rest, mut text) = (packed, Vec::new());
        match coding {
            Coding::Zstd => {
                let mut decoder =
                    ::zstd::stream::read::Decoder::with_buffer(&mut rest).unwrap().single_frame();
                decoder.read_to_end(&mut text).unwrap();
            }
            Coding::Gzip => {
                _ = flate2::bufread::GzDecoder::new(&mut rest).read_to_end(&mut text).unwrap()
            }
        }
        assert!(rest.is_empty(), "{coding:?}: {} bytes after the end", rest.len());
        text
    }

    fn whole(coding: Coding, text: &[u8], budget: &Arc<dyn Memory>) -> Chunks {
        Packer::new(coding, Some(text.len() as u64), budget)
            .unwrap()
            .feed(&Context::default(), chunks(text, budget), Then::End)
            .unwrap()
    }

    #[test]
    fn a_text_comes_out_as_it_went_in() {
        for coding in BOTH {
            for count in [0, 1, 100, 10_000, 100_000] {
                let text = numbers(count);
                let packed = whole(coding, &text, &memory::unlimited());
                assert!(packed.is_packed());
                assert!(
                    count < 100 || 2 * packed.len() < text.len() as u64,
                    "{} of {}",
                    packed.len(),
                    text.len()
                );
                assert!(unpacked(coding, &packed.concat()) == text, "{coding:?} {count}");
            }
        }
    }

    #[test]
    fn parts_are_one_text_and_each_can_be_read_at_once() {
        for coding in BOTH {
            let budget = memory::unlimited();
            let (mut packer, mut packed, mut text) =
                (Packer::new(coding, None, &budget).unwrap(), Vec::new(), Vec::new());
            for count in [1, 20_000, 3] {
                let part = numbers(count);
                packed.extend(
                    packer.pack(&Context::default(), chunks(&part, &budget)).unwrap().concat(),
                );
                text.extend(part);
                assert!(readable(coding, &packed) == text, "{coding:?} {count}");
            }
            packed.extend(packer.finish().unwrap());
            assert!(unpacked(coding, &packed) == text);
        }
    }

    /// All that can be read of a text that has not ended.
    fn readable(coding: Coding, packed: &[u8]) -> Vec<u8> {
        let mut text = Vec::new();
        let ended = match coding {
            Coding::Zstd => {
                ::zstd::stream::read::Decoder::new(packed).unwrap().read_to_end(&mut text)
            }
            Coding::Gzip => flate2::read::GzDecoder::new(packed).read_to_end(&mut text),
        };
        assert!(ended.is_err(), "it has ended");
        text
    }

    #[test]
    fn memory_is_taken_from_the_budget_and_given_back() {
        let text = numbers(100_000);
        for coding in BOTH {
            let needed = MEMORY + text.len().next_multiple_of(CHUNK);
            let budget = memory::limited(needed);
            let packed = whole(coding, &text, &budget);
            let mut rest = Reservation::of(&budget);
            assert!(
                rest.grow_to(needed - text.len() / 2).is_ok(),
                "the packed text holds less than the text did"
            );
            assert!(Packer::new(coding, None, &budget).is_none(), "there is no room for another");
            drop((packed, rest));
            assert!(Reservation::of(&budget).grow_to(needed).is_ok());
        }
    }

    #[test]
    fn what_nobody_waits_for_is_not_packed() {
        let budget = memory::unlimited();
        let (text, cancel) = (numbers(1_000), Cancellation::default());
        cancel.cancel();
        let mut packer = Packer::new(Coding::Zstd, None, &budget).unwrap();
        assert!(packer.pack(&Context::until(&cancel), chunks(&text, &budget)).is_err());
    }

    #[test]
    fn an_encoder_holds_no_more_than_is_reserved() {
        let mut context = ::zstd::zstd_safe::CCtx::create();
        context.set_parameter(CParameter::CompressionLevel(ZSTD_LEVEL)).unwrap();
        context.set_parameter(CParameter::WindowLog(ZSTD_WINDOW)).unwrap();
        let (text, mut out) = (vec![7; 300_000], vec![0; 1_000_000]);
        let (mut text, mut out) = (
            ::zstd::zstd_safe::InBuffer::around(&text),
            ::zstd::zstd_safe::OutBuffer::around(&mut out[..]),
        );
        context.compress_stream(&mut out, &mut text).unwrap();
        // The writer around it has a buffer of 32 KiB.
        assert!(context.sizeof() + 32 * 1024 <= MEMORY, "{}", context.sizeof());
    }
}
