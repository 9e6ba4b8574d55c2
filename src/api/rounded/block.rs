//! Numbers rounded side by side.

use super::text::{PLACES, ascii_of_8, put_short};
use super::{DOUBTFUL, OFFSET, Rounding, SHORT};

/// Numbers that are rounded together.
pub const LANES: usize = 24;

/// Up to [`LANES`] numbers of at most 8 digits; side by side, for wide registers.
pub struct Block {
    /// Their digits, as [`ascii_of_8`] has them.
    digits: [u64; LANES],
    /// Their exponents more [`OFFSET`].
    exponents: [u64; LANES],
}

impl Default for Block {
    fn default() -> Self {
        Block { digits: [0; LANES], exponents: [DOUBTFUL; LANES] }
    }
}

impl Block {
    /// Rounds numbers, to be written in turn.
    pub fn round(&mut self, rounding: Rounding, values: &[f64]) {
        if rounding.count <= SHORT {
            let mut lanes = [0.0; LANES];
            lanes[..values.len()].copy_from_slice(values);
            round_lanes(self, rounding, &lanes);
        }
    }

    /// Writes number `i` of those rounded, as [`Rounding::write`] does.
    #[inline]
    pub fn write(
        &self,
        rounding: Rounding,
        i: usize,
        value: f64,
        room: &mut [u8],
    ) -> Option<usize> {
        let exponent = self.exponents[i];
        if exponent > (6 + OFFSET) as u64 {
            return rounding.write(value, room);
        }
        let negative = usize::from(value.is_sign_negative());
        room[0] = b'-';
        let room = room[negative..].first_chunk_mut()?;
        Some(negative + put_short(self.digits[i], PLACES[exponent as usize % 32], room))
    }
}

#[multiversion::multiversion(targets("x86_64+avx512f+avx512vl+avx512dq+avx512bw", "x86_64+avx2"))]
fn round_lanes(block: &mut Block, rounding: Rounding, values: &[f64; LANES]) {
    for ((value, digits), exponent) in
        values.iter().zip(&mut block.digits).zip(&mut block.exponents)
    {
        (*digits, *exponent) = rounding.quickly(*value);
    }
    block.digits.iter_mut().for_each(|digits| *digits = ascii_of_8(*digits * rounding.to_8));
}
