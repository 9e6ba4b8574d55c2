//! Round numbers along an axis.

/// A round number of an axis with its text.
#[derive(Debug, Clone, PartialEq)]
pub struct Tick {
    /// The number.
    pub value: f64,
    /// As it is written.
    pub text: String,
}

/// The numbers of an axis.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct TickScale {
    /// The numbers, in order.
    pub ticks: Vec<Tick>,
    /// Where the texts would be long: what they leave out, as it is written behind the name of the
    /// axis, `- 1000000`.
    pub offset: Option<String>,
}

/// Characters of a text that fits beside an axis.
const LONGEST: usize = 7;

/// The multiples of 1, 2 or 5 times a power of ten from `low` to `high`: the finest with at most
/// `most` of them.
pub fn scale(low: f64, high: f64, most: usize) -> TickScale {
    let span = high - low;
    let (finite, most) = (span.is_finite() && span > 0.0, most.max(2));
    let exact = high.abs().max(low.abs()) < span * 1e12;
    if !finite || !exact {
        return TickScale::default();
    }
    let start = (span / most as f64).log10().floor() as i32;
    let steps = (start..start + 3).flat_map(|power| [1, 2, 5].map(|factor| (factor, power)));
    let counted = steps.map(|(factor, power)| multiples(low, high, factor, power));
    counted
        .into_iter()
        .find(|(from, to, ..)| to - from < most as f64)
        .map(write)
        .unwrap_or_default()
}

type Multiples = (f64, f64, i32, i32);

fn multiples(low: f64, high: f64, factor: i32, power: i32) -> Multiples {
    let step = multiple(1.0, factor, power);
    // The ends of an extent that is itself round are on the grid, whatever rounding did to them.
    ((low / step - 1e-9).ceil(), (high / step + 1e-9).floor(), factor, power)
}

/// Divides by a power of ten rather than multiplying by its inexact inverse.
fn multiple(count: f64, factor: i32, power: i32) -> f64 {
    let whole = count * f64::from(factor);
    if power < 0 { whole / 10f64.powi(-power) } else { whole * 10f64.powi(power) }
}

fn write((from, to, factor, power): Multiples) -> TickScale {
    let count = (to - from + 1.0).max(0.0) as usize;
    let at = |i: usize, base: f64| (from + i as f64) * f64::from(factor) - base;
    let texts = |base: f64| (0..count).map(|i| text(at(i, base) + 0.0, power)).collect::<Vec<_>>();
    // What the numbers have in common, in units of the last digit that tells them apart.
    let base = (at(count / 2, 0.0) / 100.0).round() * 100.0;
    let whole = texts(0.0);
    let is_unfit = whole.iter().any(|text| text.len() > LONGEST)
        || whole.windows(2).any(|pair| pair[0] == pair[1]);
    let is_long = base != 0.0 && is_unfit;
    let (texts, offset) =
        if is_long { (texts(base), Some(behind(base, power))) } else { (whole, None) };
    let ticks = texts
        .into_iter()
        .enumerate()
        .map(|(i, text)| Tick { value: multiple(from + i as f64, factor, power) + 0.0, text });
    TickScale { ticks: ticks.collect(), offset }
}

/// A whole number times a power of ten.
fn text(count: f64, power: i32) -> String {
    let value = multiple(count, 1, power);
    match power {
        -4..=-1 => format!("{value:.*}", power.unsigned_abs() as usize),
        0..=4 => format!("{value:.0}"),
        _ if value == 0.0 => "0".into(),
        _ => tidy(value, 9),
    }
}

/// The numbers beside the axis are those along it minus this.
fn behind(base: f64, power: i32) -> String {
    let value = multiple(base.abs(), 1, power);
    let sign = if base < 0.0 { '+' } else { '-' };
    // A base of at most 14 digits is written in full.
    if (1e-4..1e15).contains(&value) {
        format!("{sign} {value}")
    } else {
        format!("{sign} {}", tidy(value, 13))
    }
}

/// Scientific, with the digits of the double cut where the noise starts.
fn tidy(value: f64, decimals: usize) -> String {
    let text = format!("{value:.decimals$e}");
    match text.split_once('e') {
        Some((digits, power)) => {
            format!("{}e{power}", digits.trim_end_matches('0').trim_end_matches('.'))
        }
        None => text,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn texts(low: f64, high: f64, most: usize) -> Vec<String> {
        scale(low, high, most).ticks.into_iter().map(|tick| tick.text).collect()
    }

    #[test]
    fn nearly_equal_numbers_are_told_apart() {
        let cases = [
            (1e6, 1e6 + 4e-5, "- 1000000"),
            (-1e6 - 4e-5, -1e6, "+ 1000000"),
            (123_456_789.0, 123_456_794.0, "- 123456800"),
            (0.3, 0.3 + 3e-9, "- 0.3"),
            (1e-20, 1.000_001e-20, "- 1e-20"),
            (1e300, 1.000_000_1e300, "- 1e300"),
        ];
        for (low, high, offset) in cases {
            let found = scale(low, high, 6);
            assert_eq!(found.offset.as_deref(), Some(offset), "{found:?}");
            assert!(
                found.ticks.len() >= 3 && found.ticks.iter().all(|tick| tick.text.len() <= LONGEST),
                "{found:?}"
            );
            let base: f64 = offset.replace("- ", "").replace("+ ", "-").parse().unwrap();
            for pair in found.ticks.windows(2) {
                assert_ne!(pair[0].text, pair[1].text, "{found:?}");
                let read = pair.iter().map(|tick| base + tick.text.parse::<f64>().unwrap());
                read.zip(pair).for_each(|(read, tick)| {
                    assert!((read - tick.value).abs() < 1e-3 * (high - low), "{found:?}")
                });
            }
        }
        assert_eq!(scale(-0.31, 0.29, 8).offset, None);
    }

    #[test]
    fn they_are_round() {
        assert_eq!(texts(0.0, 5.0, 8), ["0", "1", "2", "3", "4", "5"]);
        assert_eq!(texts(-0.31, 0.29, 8), ["-0.3", "-0.2", "-0.1", "0.0", "0.1", "0.2"]);
        assert_eq!(texts(0.0, 1.0, 6), ["0.0", "0.2", "0.4", "0.6", "0.8", "1.0"]);
        assert_eq!(texts(0.0, 3e6, 5), ["0", "1e6", "2e6", "3e6"]);
        assert_eq!(texts(-2e-7, 2e-7, 5), ["-2e-7", "-1e-7", "0", "1e-7", "2e-7"]);
    }

    #[test]
    fn no_extent_no_ticks() {
        for (low, high) in
            [(1.0, 1.0), (f64::NAN, 1.0), (-1e308, 1.7e308), (1e16, 1e16 + 2.0), (2.0, 1.0)]
        {
            assert_eq!(scale(low, high, 8), TickScale::default());
        }
        assert!(!scale(0.0, 1e-307, 8).ticks.is_empty());
    }
}
