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
    let (mut block, mut room, rounding) = (Block::default(), [b'#'; ROOM], Rounding::to(digits));
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
        for value in [power, power.next_up(), power.next_down(), 9.5 * power, 0.99999995 * power] {
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
                assert_eq!(written(value, 7).unwrap(), zmij::Buffer::new().format_finite(value));
            }
        }
    }
}
