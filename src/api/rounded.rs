//! Numbers rounded to so many significant digits, as text: of the exact binary value, ties to even.
//!
//! A number m * 2^e is multiplied by the power of ten that leaves as many digits before the point
//! as are wanted. Powers of ten are cut off after 64 bits, then after 128, so that a product lies
//! between two neighbours; where both are on one side of a half, so is the product. Where they
//! are not, and the power is not exact, the standard library decides, which is exact and slow.
//! The first step decides nearly always: 6 digits leave some 40 bits behind the point.
//! Scaling by such a table is in Cox 2026; the digits are taken apart within a word as in Lemire
//! 2021b.

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

/// Powers of ten: the first 128 bits, the higher word first.
static POWERS: [[u64; 2]; (GREATEST - LEAST + 1) as usize] = powers();
const LEAST: i32 = -308;
const GREATEST: i32 = 325;
/// The powers from 0 to this are exact: 5^55 < 2^128.
const EXACT: i32 = 55;

const fn powers() -> [[u64; 2]; (GREATEST - LEAST + 1) as usize] {
    let mut powers = [[0; 2]; (GREATEST - LEAST + 1) as usize];
    // 5^p has the bits of 10^p. For p < 0 it is divided out of a power of two; to cut off at each
    // step is to cut off at the last.
    let (mut up, mut down) = ([0; 16], [0; 16]);
    (up[0], down[15]) = (1, 1 << 63);
    let mut p = 0;
    while p <= GREATEST {
        powers[(p - LEAST) as usize] = leading(&up);
        if p <= -LEAST {
            powers[(-p - LEAST) as usize] = leading(&down);
        }
        (up, down) = (times_5(up), over_5(down));
        p += 1;
    }
    powers
}

/// The lowest word comes first.
const fn times_5(mut words: [u64; 16]) -> [u64; 16] {
    let (mut carry, mut i) = (0, 0);
    while i < 16 {
        let product = words[i] as u128 * 5 + carry;
        (words[i], carry) = (product as u64, product >> 64);
        i += 1;
    }
    words
}

const fn over_5(mut words: [u64; 16]) -> [u64; 16] {
    let (mut rest, mut i) = (0, 16);
    while i > 0 {
        i -= 1;
        let part = rest << 64 | words[i] as u128;
        (words[i], rest) = ((part / 5) as u64, part % 5);
    }
    words
}

const fn leading(words: &[u64; 16]) -> [u64; 2] {
    let mut top = 15;
    while words[top] == 0 {
        top -= 1;
    }
    let second = if top >= 1 { words[top - 1] } else { 0 };
    let third = if top >= 2 { words[top - 2] } else { 0 };
    let (first, shift) = (words[top], words[top].leading_zeros());
    if shift == 0 {
        return [first, second];
    }
    let back = 64 - shift;
    [first << shift | second >> back, second << shift | third >> back]
}

/// `floor(log10(2^exponent))`.
fn log10_of_power_of_2(exponent: i32) -> i32 {
    (exponent * 315_653) >> 20
}

/// `floor(log2(10^exponent))`.
fn log2_of_power_of_10(exponent: i32) -> i32 {
    (exponent * 217_706) >> 16
}

fn power(exponent: i32) -> [u64; 2] {
    POWERS[(exponent - LEAST) as usize]
}

/// Powers of ten from -14 to 24, rounded to nearest.
#[rustfmt::skip]
static DOUBLES: [f64; 64] = [
    1e-14, 1e-13, 1e-12, 1e-11, 1e-10, 1e-9, 1e-8, 1e-7, 1e-6, 1e-5, 1e-4, 1e-3, 1e-2,
    1e-1, 1e0, 1e1, 1e2, 1e3, 1e4, 1e5, 1e6, 1e7, 1e8, 1e9, 1e10, 1e11,
    1e12, 1e13, 1e14, 1e15, 1e16, 1e17, 1e18, 1e19, 1e20, 1e21, 1e22, 1e23, 1e24,
    0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0,
    0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0,
];

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

/// Eight digits side by side, the first in the lowest byte, from a number of so many.
#[inline]
fn ascii_of_8(number: u64) -> u64 {
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
struct Places {
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
static PLACES: [Places; 32] = {
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

impl Places {
    #[inline]
    fn of(exponent: i32) -> Self {
        PLACES[(exponent + OFFSET) as usize % 32]
    }

    #[inline]
    fn length(self, significant: u32) -> usize {
        significant.max(u32::from(self.least)) as usize + usize::from(self.more)
    }
}

#[inline]
fn put_short(digits: u64, places: Places, room: &mut [u8; SPAN]) -> usize {
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
fn put_plain(number: u64, places: Places, room: &mut [u8; SPAN]) -> usize {
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
fn put_scientific(number: u64, exponent: i32, room: &mut [u8; SPAN]) -> usize {
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

#[cfg(test)]
mod tests {
    use super::*;

    /// The text that the library's exact digits make.
    fn expected(value: f64, digits: u8) -> Option<String> {
        let exact = format!("{value:.*e}", usize::from(digits) - 1);
        exact.parse::<f64>().unwrap().is_finite().then(|| {
            let (digits, exponent) = exact.split_once('e').unwrap();
            let (sign, digits) = match digits.strip_prefix('-') {
                Some(digits) => ("-", digits.replace('.', "")),
                None => ("", digits.replace('.', "")),
            };
            let trimmed = digits.trim_end_matches('0');
            let digits = if trimmed.is_empty() { "0" } else { trimmed };
            let exponent: i32 = exponent.parse().unwrap();
            let count = digits.len() as i32;
            let text = if !(-5..=15).contains(&exponent) {
                let point = if count > 1 { "." } else { "" };
                format!("{}{point}{}e{exponent:+}", &digits[..1], &digits[1..])
            } else if exponent < 0 {
                format!("0.{}{digits}", "0".repeat((-1 - exponent) as usize))
            } else if count <= exponent + 1 {
                format!("{digits}{}.0", "0".repeat((exponent + 1 - count) as usize))
            } else {
                let (whole, rest) = digits.split_at(exponent as usize + 1);
                format!("{whole}.{rest}")
            };
            format!("{sign}{text}")
        })
    }

    /// As one of a block, in any place.
    fn written_in_block(value: f64, digits: u8, i: usize) -> Option<String> {
        let (mut block, mut room, rounding) =
            (Block::default(), [b'#'; ROOM], Rounding::to(digits));
        let mut values = [1.0; LANES];
        values[i] = value;
        block.round(rounding, &values[..=i]);
        let length = block.write(rounding, i, value, &mut room)?;
        Some(String::from_utf8(room[..length].to_vec()).unwrap())
    }

    fn written(value: f64, digits: u8) -> Option<String> {
        let mut room = [b'#'; ROOM];
        let length = Rounding::to(digits).write(value, &mut room)?;
        Some(String::from_utf8(room[..length].to_vec()).unwrap())
    }

    #[track_caller]
    fn check(value: f64) {
        for digits in 1..=MOST {
            let text = written(value, digits);
            assert_eq!(text, expected(value, digits), "{value:e} to {digits}");
            assert_eq!(text, written_in_block(value, digits, value.to_bits() as usize % LANES));
            let rounded = Rounding::to(digits).round(value);
            if digits <= 15 && rounded.is_normal() {
                // As many digits come back from the nearest double.
                assert_eq!(text.as_deref(), Some(zmij::Buffer::new().format_finite(rounded)));
            }
            match text {
                Some(text) => assert_eq!(
                    text.parse::<f64>().unwrap().to_bits(),
                    rounded.to_bits(),
                    "{value:e} to {digits}"
                ),
                None => assert!(rounded.is_infinite()),
            }
        }
    }

    /// xorshift64, so that every run checks the same numbers.
    fn random() -> impl FnMut() -> u64 {
        let mut state = 0x9e37_79b9_7f4a_7c15_u64;
        move || {
            state ^= state << 13;
            state ^= state >> 7;
            state ^= state << 17;
            state
        }
    }

    #[test]
    fn random_bits_are_rounded_as_the_library_does() {
        let mut next = random();
        for _ in 0..20_000 {
            let value = f64::from_bits(next());
            if value.is_finite() {
                check(value);
            }
            // As coordinates are.
            let bits = next();
            check((bits >> 11) as f64 * 2f64.powi((bits % 64) as i32 - 85));
        }
    }

    #[test]
    fn short_decimals_and_ties_are_rounded_as_the_library_does() {
        let mut next = random();
        for _ in 0..20_000 {
            let bits = next();
            // Ties of few digits: odd multiples of a power of two.
            let odd = (bits >> 32 | 1) as f64;
            check(odd * 2f64.powi((bits % 100) as i32 - 50));
            let decimal = format!("{}e{}", bits >> 40, (bits % 60) as i32 - 30);
            check(decimal.parse().unwrap());
        }
    }

    #[test]
    fn extremes_are_rounded_as_the_library_does() {
        let special = [
            0.0,
            -0.0,
            5e-324,
            f64::MIN_POSITIVE,
            f64::MAX,
            f64::MIN,
            1.7e308,
            9.5,
            0.5,
            2.5,
            1e22,
            1e23,
            9.999_999_5,
        ];
        special.into_iter().for_each(check);
        for exponent in -323..=308 {
            let power: f64 = format!("1e{exponent}").parse().unwrap();
            for value in
                [power, power.next_up(), power.next_down(), 9.5 * power, 0.99999995 * power]
            {
                if value.is_finite() {
                    check(value);
                    check(-value);
                }
            }
        }
        for exponent in -1074..=1023 {
            let power = 2f64.powi(exponent);
            [power, power.next_up(), power.next_down()].into_iter().for_each(check);
        }
    }

    #[test]
    fn plain_and_scientific_notation_are_those_of_full_precision() {
        for exponent in -323..=308 {
            for digits in ["1", "1.5", "2.25", "9.75", "1.23456"] {
                let value: f64 = format!("{digits}e{exponent}").parse().unwrap();
                if value.is_normal() {
                    assert_eq!(
                        written(value, 7).unwrap(),
                        zmij::Buffer::new().format_finite(value)
                    );
                }
            }
        }
    }
}
