//! What an answer is written on: chunks that are sent one after the other, each freed when it is
//! sent.

use std::collections::VecDeque;
use std::io;
use std::sync::Arc;

use bytes::Bytes;

use crate::api::memory::{Memory, Reservation};
use crate::api::side::{Run, Side};
use crate::core::context::Context;

/// The size of a chunk. An answer within one chunk is not counted against the budget.
pub const CHUNK: usize = 256 * 1024;
/// What most answers fit on.
const FIRST: usize = 4 * 1024;

/// A text being written.
#[derive(Debug)]
pub struct Buffer {
    full: VecDeque<Chunk>,
    chunk: Vec<u8>,
    budget: Arc<dyn Memory>,
    context: Context,
    reservation: Option<Reservation>,
    side: Option<Side>,
}

/// Why writing stopped.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
pub enum Stopped {
    /// The budget is spent.
    #[error("there is no room for the answer")]
    NoRoom,
    /// Nobody waits for the answer.
    #[error("nobody waits for the answer")]
    Cancelled,
}

/// A chunk with its part of the budget.
#[derive(Debug)]
pub struct Chunk {
    text: Vec<u8>,
    reservation: Option<Reservation>,
}

impl AsRef<[u8]> for Chunk {
    fn as_ref(&self) -> &[u8] {
        &self.text
    }
}

/// A finished text; the body of an answer.
#[derive(Debug, Default)]
pub struct Chunks {
    chunks: VecDeque<Chunk>,
    left: u64,
    is_packed: bool,
}

impl Buffer {
    /// A blank chunk.
    pub fn new(context: &Context, budget: &Arc<dyn Memory>) -> Self {
        let (budget, context) = (budget.clone(), context.clone());
        Buffer {
            full: VecDeque::new(),
            chunk: Vec::with_capacity(FIRST),
            budget,
            context,
            reservation: None,
            side: None,
        }
    }

    /// The same, in whose text long lists are written in so many parts at once, by `run`.
    pub fn side_by_side(self, parts: usize, run: Run) -> Self {
        Buffer { side: (parts > 1).then_some(Side { parts, run }), ..self }
    }

    /// How parts of it are written at once; if at all.
    pub fn side(&self) -> Option<Side> {
        self.side
    }

    /// Another blank chunk, paid from the same budget.
    pub fn sibling(&self) -> Self {
        let (budget, context) = (self.budget.clone(), self.context.clone());
        Buffer {
            full: VecDeque::new(),
            chunk: Vec::new(),
            budget,
            context,
            reservation: None,
            side: self.side,
        }
    }

    /// The same, with its first chunk counted against the budget too.
    ///
    /// # Errors
    /// [`Stopped::NoRoom`].
    pub fn paid_sibling(&self) -> io::Result<Self> {
        let mut reservation = Reservation::of(&self.budget);
        reservation.grow_to(CHUNK).map_err(|_| io::Error::other(Stopped::NoRoom))?;
        Ok(Buffer { reservation: Some(reservation), ..self.sibling() })
    }

    /// So much is about to be written: takes the room at once instead of bit by bit.
    ///
    /// # Errors
    /// [`Stopped::NoRoom`].
    pub fn reserve(&mut self, bytes: usize) -> io::Result<()> {
        let needed = (self.chunk.len() + bytes).min(CHUNK);
        if self.chunk.len() >= CHUNK / 4 && self.chunk.len() + bytes > CHUNK {
            // To make room on this one would be to copy it.
            return self.turn().map_err(io::Error::other);
        }
        // At least twice the size: many short texts are expected one after the other.
        if needed > self.chunk.capacity() {
            self.grow(needed.max((2 * self.chunk.capacity()).min(CHUNK)))
        } else {
            Ok(())
        }
    }

    /// Makes the chunk as large as this; any but the first of a text is paid for.
    fn grow(&mut self, size: usize) -> io::Result<()> {
        if !self.full.is_empty() {
            let reservation = self.reservation.get_or_insert_with(|| Reservation::of(&self.budget));
            reservation.grow_to(size).map_err(|_| io::Error::other(Stopped::NoRoom))?;
        }
        self.chunk.reserve_exact(size.saturating_sub(self.chunk.len()));
        Ok(())
    }

    /// Adds a finished text at the end.
    pub fn append(&mut self, chunks: Chunks) {
        let text = std::mem::take(&mut self.chunk);
        self.full.push_back(Chunk { text, reservation: self.reservation.take() });
        self.full.extend(chunks.chunks);
    }

    /// Adds a finished text at the end: short ones are copied, so that a long text of short ones is
    /// not sent in scraps.
    ///
    /// # Errors
    /// As writing.
    pub fn take(&mut self, chunks: Chunks) -> io::Result<()> {
        if chunks.len() > (CHUNK / 4) as u64 {
            self.append(chunks);
            return Ok(());
        }
        chunks.chunks.iter().try_for_each(|chunk| io::Write::write_all(self, &chunk.text))
    }

    /// A larger chunk, or a new one.
    #[cold]
    fn make_room(&mut self, bytes: usize) -> io::Result<()> {
        let needed = self.chunk.len() + bytes;
        if needed > CHUNK && !self.chunk.is_empty() {
            return self.turn().map_err(io::Error::other);
        }
        self.grow((2 * self.chunk.capacity()).clamp(FIRST, CHUNK).max(needed))
    }

    /// Puts the full chunk away and takes a blank one that is paid for.
    fn turn(&mut self) -> Result<(), Stopped> {
        self.context.checkpoint().map_err(|_| Stopped::Cancelled)?;
        let mut reservation = Reservation::of(&self.budget);
        reservation.grow_to(CHUNK).map_err(|_| Stopped::NoRoom)?;
        let text = std::mem::replace(&mut self.chunk, Vec::with_capacity(CHUNK));
        self.full.push_back(Chunk { text, reservation: self.reservation.replace(reservation) });
        Ok(())
    }

    /// The text, to be sent.
    pub fn finish(mut self) -> Chunks {
        self.full.push_back(Chunk { text: self.chunk, reservation: self.reservation });
        Chunks::of(self.full)
    }
}

impl io::Write for Buffer {
    #[inline]
    fn write(&mut self, text: &[u8]) -> io::Result<usize> {
        self.write_all(text).map(|()| text.len())
    }

    #[inline]
    fn write_all(&mut self, text: &[u8]) -> io::Result<()> {
        if self.chunk.capacity() - self.chunk.len() < text.len() {
            self.make_room(text.len())?;
        }
        self.chunk.extend_from_slice(text);
        Ok(())
    }

    fn flush(&mut self) -> io::Result<()> {
        Ok(())
    }
}

impl Chunks {
    fn of(chunks: VecDeque<Chunk>) -> Self {
        let left = chunks.iter().map(|chunk| chunk.text.len() as u64).sum();
        Chunks { chunks, left, is_packed: false }
    }

    /// Whether the text is compressed.
    pub fn is_packed(&self) -> bool {
        self.is_packed
    }

    /// The next chunk to be sent; nothing at the end.
    pub fn pop(&mut self) -> Option<Bytes> {
        let chunk = self.chunks.pop_front()?;
        self.left -= chunk.text.len() as u64;
        Some(Bytes::from_owner(chunk))
    }

    /// Whether there is nothing more to be sent, not even an empty chunk.
    pub fn is_at_end(&self) -> bool {
        self.chunks.is_empty()
    }

    /// Whether all is on one chunk.
    pub fn is_single(&self) -> bool {
        self.chunks.len() <= 1
    }

    /// The text compressed, chunk by chunk: `pack` is told whether it is the last. Each chunk is
    /// freed when it is packed, and what the packed one needs less goes back to the budget.
    ///
    /// # Errors
    /// That of `pack`.
    pub fn packed<E>(
        self,
        mut pack: impl FnMut(&[u8], bool) -> Result<Vec<u8>, E>,
    ) -> Result<Self, E> {
        let mut behind = self.chunks.len();
        let one = |mut chunk: Chunk| {
            behind -= 1;
            chunk.text = pack(&chunk.text, behind == 0)?;
            if let Some(reservation) = &mut chunk.reservation {
                reservation.shrink_to(chunk.text.capacity());
            }
            Ok(chunk)
        };
        let chunks = self.chunks.into_iter().map(one).collect::<Result<_, E>>()?;
        Ok(Chunks { is_packed: true, ..Chunks::of(chunks) })
    }

    /// Bytes not yet sent.
    pub fn len(&self) -> u64 {
        self.left
    }

    /// Whether all is sent.
    pub fn is_empty(&self) -> bool {
        self.left == 0
    }

    /// Adds another text at the end.
    pub fn extend(&mut self, other: Chunks) {
        self.left += other.left;
        self.chunks.extend(other.chunks);
    }

    /// The text in one piece.
    pub fn concat(&self) -> Vec<u8> {
        self.chunks.iter().flat_map(|chunk| chunk.text.iter().copied()).collect()
    }
}

impl IntoIterator for Chunks {
    type Item = Bytes;
    type IntoIter =
        std::iter::Map<std::collections::vec_deque::IntoIter<Chunk>, fn(Chunk) -> Bytes>;

    fn into_iter(self) -> Self::IntoIter {
        self.chunks.into_iter().map(Bytes::from_owner)
    }
}

#[cfg(test)]
mod tests {
    use std::io::Write;

    use super::*;
    use crate::api::memory;

    fn budget(chunks: usize) -> Arc<dyn Memory> {
        memory::limited(chunks * CHUNK)
    }

    #[test]
    fn a_chunk_after_an_appended_text_is_paid_for() {
        let mut buffer = Buffer::new(&Context::default(), &budget(0));
        buffer.append(buffer.sibling().finish());
        assert!(buffer.reserve(1).is_err());
        assert!(buffer.write_all(b"x").is_err());
    }

    #[test]
    fn the_budget_ends_the_text() {
        let mut buffer = Buffer::new(&Context::default(), &budget(1));
        let lines = std::iter::repeat_with(|| buffer.write_all(&[0; 1000]));
        let written = lines.take_while(Result::is_ok).count();
        assert_eq!(written, 2 * (CHUNK / 1000), "the first chunk is free, the second is paid for");
    }
}
