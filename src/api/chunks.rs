//! What an answer is written on: sheets that are sent one after the other, each freed when it is sent.

use std::collections::VecDeque;
use std::io;
use std::sync::Arc;

use bytes::Bytes;

use crate::api::memory::{Memory, Reservation};
use crate::core::work;

/// The size of a sheet. An answer within one sheet is not counted against the budget.
pub const SHEET: usize = 256 * 1024;
/// What most answers fit on.
const FIRST: usize = 4 * 1024;

/// A text being written.
#[derive(Debug)]
pub struct Paper {
    full: VecDeque<Held>,
    sheet: Vec<u8>,
    budget: Arc<dyn Memory>,
    reservation: Option<Reservation>,
    hands: usize,
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

/// A sheet with its part of the budget.
#[derive(Debug)]
pub struct Held {
    text: Vec<u8>,
    reservation: Option<Reservation>,
}

impl AsRef<[u8]> for Held {
    fn as_ref(&self) -> &[u8] {
        &self.text
    }
}

/// A finished text; the body of an answer.
#[derive(Debug, Default)]
pub struct Sheets {
    sheets: VecDeque<Held>,
    left: u64,
    is_packed: bool,
}

impl Paper {
    /// A blank sheet.
    pub fn new(budget: &Arc<dyn Memory>) -> Self {
        Paper { full: VecDeque::new(), sheet: Vec::with_capacity(FIRST), budget: budget.clone(), reservation: None, hands: 1 }
    }

    /// The same, to be written with so many hands at once.
    pub fn with_hands(self, hands: usize) -> Self {
        Paper { hands, ..self }
    }

    /// How many threads may write parts of it at once.
    pub fn hands(&self) -> usize {
        self.hands
    }

    /// Another blank sheet, paid from the same budget.
    pub fn sibling(&self) -> Self {
        Paper { full: VecDeque::new(), sheet: Vec::new(), budget: self.budget.clone(), reservation: None, hands: self.hands }
    }

    /// The same, with its first sheet counted against the budget too.
    ///
    /// # Errors
    /// [`Stopped::NoRoom`].
    pub fn paid_sibling(&self) -> io::Result<Self> {
        let mut reservation = Reservation::of(&self.budget);
        reservation.grow_to(SHEET).map_err(|_| io::Error::other(Stopped::NoRoom))?;
        Ok(Paper { reservation: Some(reservation), ..self.sibling() })
    }

    /// So much is about to be written: takes the room at once instead of bit by bit.
    ///
    /// # Errors
    /// [`Stopped::NoRoom`].
    pub fn expect(&mut self, bytes: usize) -> io::Result<()> {
        let needed = (self.sheet.len() + bytes).min(SHEET);
        if self.sheet.len() >= SHEET / 4 && self.sheet.len() + bytes > SHEET {
            // To make room on this one would be to copy it.
            return self.turn().map_err(io::Error::other);
        }
        // At least twice the size: many short texts are expected one after the other.
        if needed > self.sheet.capacity() { self.grow(needed.max((2 * self.sheet.capacity()).min(SHEET))) } else { Ok(()) }
    }

    /// Makes the sheet as large as this; any but the first of a text is paid for.
    fn grow(&mut self, size: usize) -> io::Result<()> {
        if !self.full.is_empty() {
            let reservation = self.reservation.get_or_insert_with(|| Reservation::of(&self.budget));
            reservation.grow_to(size).map_err(|_| io::Error::other(Stopped::NoRoom))?;
        }
        self.sheet.reserve_exact(size.saturating_sub(self.sheet.len()));
        Ok(())
    }

    /// Adds a finished text at the end.
    pub fn append(&mut self, sheets: Sheets) {
        let text = std::mem::take(&mut self.sheet);
        self.full.push_back(Held { text, reservation: self.reservation.take() });
        self.full.extend(sheets.sheets);
    }

    /// Adds a finished text at the end: short ones are copied, so that a long text of short ones is not sent in scraps.
    ///
    /// # Errors
    /// As writing.
    pub fn take(&mut self, sheets: Sheets) -> io::Result<()> {
        if sheets.len() > (SHEET / 4) as u64 {
            self.append(sheets);
            return Ok(());
        }
        sheets.sheets.iter().try_for_each(|sheet| io::Write::write_all(self, &sheet.text))
    }

    /// A larger sheet, or a new one.
    #[cold]
    fn make_room(&mut self, bytes: usize) -> io::Result<()> {
        let needed = self.sheet.len() + bytes;
        if needed > SHEET && !self.sheet.is_empty() {
            return self.turn().map_err(io::Error::other);
        }
        self.grow((2 * self.sheet.capacity()).clamp(FIRST, SHEET).max(needed))
    }

    /// Puts the full sheet away and takes a blank one that is paid for.
    fn turn(&mut self) -> Result<(), Stopped> {
        work::checkpoint().map_err(|_| Stopped::Cancelled)?;
        let mut reservation = Reservation::of(&self.budget);
        reservation.grow_to(SHEET).map_err(|_| Stopped::NoRoom)?;
        let text = std::mem::replace(&mut self.sheet, Vec::with_capacity(SHEET));
        self.full.push_back(Held { text, reservation: self.reservation.replace(reservation) });
        Ok(())
    }

    /// The text, to be sent.
    pub fn finish(mut self) -> Sheets {
        self.full.push_back(Held { text: self.sheet, reservation: self.reservation });
        Sheets::of(self.full)
    }
}

impl io::Write for Paper {
    #[inline]
    fn write(&mut self, text: &[u8]) -> io::Result<usize> {
        self.write_all(text).map(|()| text.len())
    }

    #[inline]
    fn write_all(&mut self, text: &[u8]) -> io::Result<()> {
        if self.sheet.capacity() - self.sheet.len() < text.len() {
            self.make_room(text.len())?;
        }
        self.sheet.extend_from_slice(text);
        Ok(())
    }

    fn flush(&mut self) -> io::Result<()> {
        Ok(())
    }
}

impl Sheets {
    fn of(sheets: VecDeque<Held>) -> Self {
        let left = sheets.iter().map(|sheet| sheet.text.len() as u64).sum();
        Sheets { sheets, left, is_packed: false }
    }

    /// Whether the text is compressed.
    pub fn is_packed(&self) -> bool {
        self.is_packed
    }

    /// The next sheet to be sent; nothing at the end.
    pub fn pop(&mut self) -> Option<Bytes> {
        let sheet = self.sheets.pop_front()?;
        self.left -= sheet.text.len() as u64;
        Some(Bytes::from_owner(sheet))
    }

    /// Whether there is nothing more to be sent, not even an empty sheet.
    pub fn is_at_end(&self) -> bool {
        self.sheets.is_empty()
    }

    /// Whether all is on one sheet.
    pub fn is_single(&self) -> bool {
        self.sheets.len() <= 1
    }

    /// The text compressed, sheet by sheet: `pack` is told whether it is the last. Each sheet is freed when it is packed, and what the
    /// packed one needs less goes back to the budget.
    ///
    /// # Errors
    /// That of `pack`.
    pub fn packed<E>(self, mut pack: impl FnMut(&[u8], bool) -> Result<Vec<u8>, E>) -> Result<Self, E> {
        let mut behind = self.sheets.len();
        let one = |mut sheet: Held| {
            behind -= 1;
            sheet.text = pack(&sheet.text, behind == 0)?;
            if let Some(reservation) = &mut sheet.reservation {
                reservation.shrink_to(sheet.text.capacity());
            }
            Ok(sheet)
        };
        let sheets = self.sheets.into_iter().map(one).collect::<Result<_, E>>()?;
        Ok(Sheets { is_packed: true, ..Sheets::of(sheets) })
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
    pub fn extend(&mut self, other: Sheets) {
        self.left += other.left;
        self.sheets.extend(other.sheets);
    }

    /// The text in one piece.
    pub fn concat(&self) -> Vec<u8> {
        self.sheets.iter().flat_map(|sheet| sheet.text.iter().copied()).collect()
    }
}

impl IntoIterator for Sheets {
    type Item = Bytes;
    type IntoIter = std::iter::Map<std::collections::vec_deque::IntoIter<Held>, fn(Held) -> Bytes>;

    fn into_iter(self) -> Self::IntoIter {
        self.sheets.into_iter().map(Bytes::from_owner)
    }
}

#[cfg(test)]
mod tests {
    use std::io::Write;

    use super::*;
    use crate::api::memory;

    fn budget(sheets: usize) -> Arc<dyn Memory> {
        memory::limited(sheets * SHEET)
    }

    #[test]
    fn a_sheet_after_an_appended_text_is_paid_for() {
        let mut paper = Paper::new(&budget(0));
        paper.append(paper.sibling().finish());
        assert!(paper.expect(1).is_err());
        assert!(paper.write_all(b"x").is_err());
    }

    #[test]
    fn the_budget_ends_the_text() {
        let mut paper = Paper::new(&budget(1));
        let lines = std::iter::repeat_with(|| paper.write_all(&[0; 1000]));
        let written = lines.take_while(Result::is_ok).count();
        assert_eq!(written, 2 * (SHEET / 1000), "the first sheet is free, the second is paid for");
    }
}
