//! Numbers rounded to so many significant digits, as text: of the exact binary value, ties to even.
//!
//! A number m * 2^e is multiplied by the power of ten that leaves as many digits before the point
//! as are wanted. Powers of ten are cut off after 64 bits, then after 128, so that a product lies
//! between two neighbours; where both are on one side of a half, so is the product. Where they
//! are not, and the power is not exact, the standard library decides, which is exact and slow.
//! The first step decides nearly always: 6 digits leave some 40 bits behind the point.
//! Scaling by such a table is in Cox 2026; the digits are taken apart within a word as in Lemire
//! 2021b.

mod block;
mod powers;
mod text;

pub use block::{Block, LANES};
use powers::{DOUBLES, EXACT, log2_of_power_of_10, log10_of_power_of_2, power};
use text::{Places, ascii_of_8, put_plain, put_scientific, put_short};

/// The most digits that may be asked for: as many tell any two doubles apart.
pub const MOST: u8 = 17;
/// So many digits are one word.
const SHORT: u8 = 8;
/// The most digits that doubles may find without much doubt.
const QUICK: u8 = 12;
/// Bytes that writing a number may touch; the longest text, -1.2345678901234567e-308, has 24.
pub const ROOM: usize = SPAN + 1;
const SPAN: usize = 48;

/// What is added to exponents so that they are not negative.
const OFFSET: i32 = 5;
const DOUBTFUL: u64 = u64::MAX;

/// A number of so many digits: `digits * 10^(exponent - count + 1)`.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
struct Decimal {
    digits: u64,
    /// That of the first digit.
    exponent: i32,
}

/// How many significant digits numbers are rounded to.
#[derive(Debug, Clone, Copy)]
pub struct Rounding {
    count: u8,
    /// `10^count`.
    end: u64,
    /// What makes 8 digits of so many, where they are no more.
    to_8: u64,
    /// What makes 17.
    to_17: u64,
    /// By how much a product of doubles below `end` may be wrong.
    doubt: f64,
    /// Products from here on have one digit more.
    beyond: f64,
}

impl Rounding {
    /// To 1 to [`MOST`] digits.
    pub fn to(digits: u8) -> Self {
        let count = digits.clamp(1, MOST);
        let power = |exponent: u8| 10_u64.pow(u32::from(exponent));
        let end = power(count);
        // A power, 0.1 and two products, each rounded to half an ulp, make 2^-51; twice is safe.
        let doubt = if count <= QUICK { end as f64 * f64::EPSILON * 4.0 } else { 0.5 };
        let (to_8, to_17) = (power(SHORT.saturating_sub(count)), power(MOST - count));
        Rounding { count, end, to_8, to_17, doubt, beyond: end as f64 - 0.5 + doubt }
    }

    /// Writes a finite number at the beginning of `room`, which may be no shorter than [`ROOM`];
    /// the length of the text, or nothing where rounding makes it larger than any double.
    #[inline]
    pub fn write(self, value: f64, room: &mut [u8]) -> Option<usize> {
        let negative = usize::from(value.is_sign_negative());
        room[0] = b'-';
        let room = room[negative..].first_chunk_mut()?;
        let decimal = match self.round_quickly(value.abs()) {
            Some(decimal) => decimal,
            None => self.round_surely(value.abs())?,
        };
        Some(negative + self.put(decimal, room))
    }

    /// By arithmetic of doubles, where that leaves no doubt.
    #[inline]
    fn round_quickly(self, value: f64) -> Option<Decimal> {
        let (digits, exponent) = self.quickly(value);
        (exponent != DOUBTFUL).then_some(Decimal { digits, exponent: exponent as i32 - OFFSET })
    }

    /// Digits, and the exponent more [`OFFSET`], of a number that is not too small or too large
    /// and whose product with a power of ten is not close to a half. Without a branch.
    #[inline(always)]
    fn quickly(self, value: f64) -> (u64, u64) {
        let bits = value.abs().to_bits();
        let biased = bits >> 52;
        // As `log10_of_power_of_2`, without negative numbers.
        let first = (biased * 315_653 + (310 << 20) - 1_023 * 315_653) >> 20;
        let place = (u64::from(self.count) + 13 + 310).wrapping_sub(first);
        let product = value.abs() * DOUBLES[(place % 64) as usize];
        let is_beyond = product > self.beyond;
        let product = if is_beyond { product * 0.1 } else { product };
        // Doubles from 2^52 on are whole numbers: adding rounds, ties to even.
        const WHOLE: f64 = 4_503_599_627_370_496.0;
        let raised = product + WHOLE;
        let is_known = (product - (raised - WHOLE)).abs() < 0.5 - self.doubt;
        let is_middling = biased.wrapping_sub(1_023 - 20) < 64;
        let exponent = (first + u64::from(is_beyond)).wrapping_sub(310 - OFFSET as u64);
        let exponent = if bits == 0 { OFFSET as u64 } else { exponent };
        let fits = is_known & (is_middling | (bits == 0));
        let digits = raised.to_bits() & (WHOLE as u64 - 1);
        let doubtful = u64::from(fits).wrapping_sub(1);
        (digits & !doubtful, exponent | doubtful)
    }

    /// For all numbers that are not negative.
    #[cold]
    fn round_surely(self, value: f64) -> Option<Decimal> {
        let biased = (value.to_bits() >> 52) as i32;
        // What is less than normal, and what may overflow.
        if biased == 0 || biased == 0x7fe {
            return self
                .by_library(value)
                .parse()
                .is_ok_and(f64::is_finite)
                .then(|| self.by_text(value));
        }
        Some(self.round_normal(value.to_bits() << 11 | 1 << 63, biased - 1_086))
    }

    /// The number as it would be read from the text; infinite where that is too large.
    pub fn round(self, value: f64) -> f64 {
        const POWERS: [f64; 23] = [
            1e0, 1e1, 1e2, 1e3, 1e4, 1e5, 1e6, 1e7, 1e8, 1e9, 1e10, 1e11, 1e12, 1e13, 1e14, 1e15,
            1e16, 1e17, 1e18, 1e19, 1e20, 1e21, 1e22,
        ];
        let size = value.abs();
        let Some(decimal) = self.round_quickly(size).or_else(|| self.round_surely(size)) else {
            return f64::INFINITY.copysign(value);
        };
        let power = decimal.exponent - i32::from(self.count) + 1;
        match POWERS.get(power.unsigned_abs() as usize) {
            // Both are exact, so that the one operation rounds as reading does (Clinger 1990).
            Some(by) if self.count <= 15 => {
                let whole = decimal.digits as f64;
                (if power < 0 { whole / by } else { whole * by }).copysign(value)
            }
            _ => self.by_library(value).parse().unwrap_or(value),
        }
    }

    fn by_library(self, value: f64) -> String {
        format!("{value:.*e}", usize::from(self.count) - 1)
    }

    /// `mantissa * 2^exponent`; the mantissa has its highest bit set.
    #[inline]
    fn round_normal(self, mantissa: u64, exponent: i32) -> Decimal {
        let binade = exponent + 63;
        let mut first = log10_of_power_of_2(binade);
        // The next power of ten may be in the same binade, and below the number.
        let [next, rest] = power(first + 1);
        let same = log2_of_power_of_10(first + 1) == binade;
        first += i32::from(same & (mantissa >= next.saturating_add(u64::from(rest != 0))));
        let by = i32::from(self.count) - 1 - first;
        let high = ((u128::from(mantissa) * u128::from(power(by)[0])) >> 64) as u64;
        let shift = -(exponent + log2_of_power_of_10(by) + 1) as u32;
        let half = 1_u64 << (shift - 1);
        let rest = high & (2 * half - 1);
        // The product is at least `high`, and less by no more than 2 than that.
        if rest.wrapping_sub(half - 1) <= 1 {
            return self.settle(mantissa, exponent, first);
        }
        let digits = (high >> shift) + u64::from(rest > half);
        self.carried(digits, first)
    }

    /// All nines may have become one more digit.
    #[inline]
    fn carried(self, digits: u64, exponent: i32) -> Decimal {
        if digits == self.end {
            return Decimal { digits: digits / 10, exponent: exponent + 1 };
        }
        Decimal { digits, exponent }
    }

    /// With 128 bits of the power where 64 do not decide.
    #[cold]
    fn settle(self, mantissa: u64, exponent: i32, first: i32) -> Decimal {
        let by = i32::from(self.count) - 1 - first;
        let [high, low] = power(by).map(|word| u128::from(word) * u128::from(mantissa));
        let (sum, last) = (high + (low >> 64), low as u64);
        let shift = -(exponent + log2_of_power_of_10(by) + 1) as u32 + 64;
        let (half, rest) = (1_u128 << (shift - 1), sum & ((1 << shift) - 1));
        let digits = (sum >> shift) as u64;
        let is_exact = (0..=EXACT).contains(&by);
        let up = if is_exact {
            let is_tie = (rest, last) == (half, 0);
            if is_tie { digits % 2 == 1 } else { rest >= half }
        } else if rest >= half + u128::from(last == 0) {
            // What was cut off only adds, less than the mantissa in units of `last`.
            true
        } else if rest + 1 < half || (rest < half && last.checked_add(mantissa).is_some()) {
            false
        } else {
            return self.by_text(mantissa as f64 * 2_f64.powi(exponent));
        };
        self.carried(digits + u64::from(up), first)
    }

    #[cold]
    fn by_text(self, value: f64) -> Decimal {
        let text = self.by_library(value);
        let (digits, exponent) = text.split_once('e').unwrap_or((&text, "0"));
        let append = |number: u64, byte: u8| number * 10 + u64::from(byte - b'0');
        let digits = digits.bytes().filter(u8::is_ascii_digit).fold(0, append);
        Decimal { digits, exponent: exponent.parse().unwrap_or(0) }
    }

    /// Writes the digits, the point, and the power of ten: in the form of [`zmij`].
    #[inline]
    fn put(self, Decimal { digits, exponent }: Decimal, room: &mut [u8; SPAN]) -> usize {
        match exponent {
            -5..=6 if self.count <= SHORT => {
                put_short(ascii_of_8(digits * self.to_8), Places::of(exponent), room)
            }
            -5..=15 => put_plain(digits * self.to_17, Places::of(exponent), room),
            _ => put_scientific(digits * self.to_17, exponent, room),
        }
    }
}

#[cfg(test)]
mod tests;
