//! Digits to text.

use super::{OFFSET, SPAN};

/// Eight digits side by side, the first in the lowest byte, from a number of so many.
#[inline]
pub(super) fn ascii_of_8(number: u64) -> u64 {
    // Each step divides all parts of the word at once: by 10,000, by 100, by 10.
    let high = (number * 3_518_437_209) >> 45;
    let fours = high | (number - 10_000 * high) << 32;
    let hundreds = ((fours * 10_486) >> 20) & 0x0000_007f_0000_007f;
    let twos = hundreds | (fours - 100 * hundreds) << 16;
    let tens = ((twos * 103) >> 10) & 0x000f_000f_000f_000f;
    (tens | (twos - 10 * tens) << 8) | 0x3030_3030_3030_3030
}

/// Seventeen digits, zeros after them, and how many there are without zeros at their end.
#[inline]
fn ascii_of_17(number: u64) -> ([u8; 2 * SPAN], u32) {
    const HALF: u64 = 100_000_000;
    let (first, rest) = (number / (HALF * HALF), number % (HALF * HALF));
    let rest = u128::from(ascii_of_8(rest / HALF)) | u128::from(ascii_of_8(rest % HALF)) << 64;
    let mut digits = [b'0'; 2 * SPAN];
    digits[0] += first as u8;
    digits[1..17].copy_from_slice(&rest.to_le_bytes());
    (digits, 17 - (rest ^ u128::from_le_bytes([b'0'; 16])).leading_zeros() / 8)
}

/// Where the parts of a number in plain notation go: digits, then the point, then the digits again
/// from the first behind the point on.
#[derive(Clone, Copy)]
pub(super) struct Places {
    digits: u8,
    point: u8,
    again: u8,
    /// How many digits are before the point.
    whole: u8,
    /// The length of the text, less the significant digits or the least that are written.
    more: u8,
    least: u8,
}

/// By exponent more [`OFFSET`], the smallest in plain notation as [`zmij`] has it: so that what is
/// written has no branch that depends on the size.
pub(super) static PLACES: [Places; 32] = {
    let mut places = [Places { digits: 0, point: 0, again: 0, whole: 0, more: 0, least: 0 }; 32];
    let mut i = 0;
    while i < 21 {
        let exponent = i as i32 - OFFSET;
        places[i] = if exponent < 0 {
            let zeros = (1 - exponent) as u8;
            Places { digits: zeros, point: 1, again: zeros, whole: 0, more: zeros, least: 1 }
        } else {
            let whole = exponent as u8 + 1;
            Places { digits: 0, point: whole, again: whole + 1, whole, more: 1, least: whole + 1 }
        };
        i += 1;
    }
    places
};

impl Places {
    #[inline]
    pub(super) fn of(exponent: i32) -> Self {
        PLACES[(exponent + OFFSET) as usize % 32]
    }

    #[inline]
    fn length(self, significant: u32) -> usize {
        significant.max(u32::from(self.least)) as usize + usize::from(self.more)
    }
}

#[inline]
pub(super) fn put_short(digits: u64, places: Places, room: &mut [u8; SPAN]) -> usize {
    let significant = 8 - (digits ^ 0x3030_3030_3030_3030).leading_zeros() / 8;
    let mut put = |at: u8, bytes: u64| {
        room[usize::from(at % 32)..][..8].copy_from_slice(&bytes.to_le_bytes());
    };
    put(0, u64::from_le_bytes(*b"0.000000"));
    put(places.digits, digits);
    let rest = digits >> (8 * places.whole % 64);
    put(places.again, rest);
    room[usize::from(places.point % 32)] = b'.';
    places.length(significant)
}

#[inline]
pub(super) fn put_plain(number: u64, places: Places, room: &mut [u8; SPAN]) -> usize {
    let (digits, significant) = ascii_of_17(number);
    let mut put = |at: u8, from: u8| {
        let part = &digits[usize::from(from % 32)..][..24];
        room[usize::from(at % 32)..][..24].copy_from_slice(part);
    };
    put(places.digits, 0);
    put(places.again, places.whole);
    if places.digits > 0 {
        room[..2].copy_from_slice(b"0.");
        room[2..places.digits.into()].fill(b'0');
    }
    room[usize::from(places.point % 32)] = b'.';
    places.length(significant)
}

#[inline]
pub(super) fn put_scientific(number: u64, exponent: i32, room: &mut [u8; SPAN]) -> usize {
    let (digits, significant) = ascii_of_17(number);
    (room[0], room[1]) = (digits[0], b'.');
    room[2..18].copy_from_slice(&digits[1..17]);
    let mut length = if significant > 1 { significant as usize + 1 } else { 1 };
    let mut put = |byte: u8| {
        room[length] = byte;
        length += 1;
    };
    put(b'e');
    put(if exponent < 0 { b'-' } else { b'+' });
    let size = exponent.unsigned_abs();
    for (unit, least) in [(100, 100), (10, 10), (1, 0)] {
        if size >= least {
            put(b'0' + (size / unit % 10) as u8);
        }
    }
    length
}
