//! Powers of ten, and the logarithms that choose one.

/// Powers of ten: the first 128 bits, the higher word first.
static POWERS: [[u64; 2]; (GREATEST - LEAST + 1) as usize] = powers();
const LEAST: i32 = -308;
const GREATEST: i32 = 325;
/// The powers from 0 to this are exact: 5^55 < 2^128.
pub(super) const EXACT: i32 = 55;

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
pub(super) fn log10_of_power_of_2(exponent: i32) -> i32 {
    (exponent * 315_653) >> 20
}

/// `floor(log2(10^exponent))`.
pub(super) fn log2_of_power_of_10(exponent: i32) -> i32 {
    (exponent * 217_706) >> 16
}

pub(super) fn power(exponent: i32) -> [u64; 2] {
    POWERS[(exponent - LEAST) as usize]
}

/// Powers of ten from -14 to 24, rounded to nearest.
#[rustfmt::skip]
pub(super) static DOUBLES: [f64; 64] = [
    1e-14, 1e-13, 1e-12, 1e-11, 1e-10, 1e-9, 1e-8, 1e-7, 1e-6, 1e-5, 1e-4, 1e-3, 1e-2,
    1e-1, 1e0, 1e1, 1e2, 1e3, 1e4, 1e5, 1e6, 1e7, 1e8, 1e9, 1e10, 1e11,
    1e12, 1e13, 1e14, 1e15, 1e16, 1e17, 1e18, 1e19, 1e20, 1e21, 1e22, 1e23, 1e24,
    0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0,
    0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0,
];
