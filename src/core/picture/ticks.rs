//! Round numbers along an axis.

/// A round number of an axis with its text.
#[derive(Debug, Clone, PartialEq)]
pub struct Tick {
    /// The number.
    pub value: f64,
    /// As it is written.
    pub text: String,
}

/// The multiples of 1, 2 or 5 times a power of ten from `low` to `high`: the finest with at most `most` of them.
pub fn ticks(low: f64, high: f64, most: usize) -> Vec<Tick> {
    let span = high - low;
    let (finite, most) = (span.is_finite() && span > 0.0, most.max(2));
    let exact = high.abs().max(low.abs()) < span * 1e9;
    if !finite || !exact {
        return Vec::new();
    }
    let start = (span / most as f64).log10().floor() as i32;
    let steps = (start..start + 3).flat_map(|power| [1, 2, 5].map(|factor| (factor, power)));
    let counted = steps.map(|(factor, power)| multiples(low, high, factor, power));
    counted.into_iter().find(|(from, to, ..)| to - from < most as f64).map(write).unwrap_or_default()
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

fn write((from, to, factor, power): Multiples) -> Vec<Tick> {
    let count = (to - from + 1.0).max(0.0) as usize;
    let values = (0..count).map(|i| multiple(from + i as f64, factor, power) + 0.0);
    let text = |value: f64| match power {
        -4..=-1 => format!("{value:.*}", power.unsigned_abs() as usize),
        0..=4 => format!("{value:.0}"),
        _ if value == 0.0 => "0".into(),
        _ => tidy(value),
    };
    values.map(|value| Tick { value, text: text(value) }).collect()
}

/// Scientific, with the digits of the double cut where the noise starts.
fn tidy(value: f64) -> String {
    let text = format!("{value:.9e}");
    match text.split_once('e') {
        Some((digits, power)) => format!("{}e{power}", digits.trim_end_matches('0').trim_end_matches('.')),
        None => text,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn texts(low: f64, high: f64, most: usize) -> Vec<String> {
        ticks(low, high, most).into_iter().map(|tick| tick.text).collect()
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
        for (low, high) in [(1.0, 1.0), (f64::NAN, 1.0), (-1e308, 1.7e308), (1e16, 1e16 + 2.0), (2.0, 1.0)] {
            assert_eq!(ticks(low, high, 8), []);
        }
        assert!(!ticks(0.0, 1e-307, 8).is_empty());
    }
}
