//! Colours of middle lightness: they stand out from a white page and from a black one, so a picture
//! needs no background.

/// How many colours there are.
pub const COLORS: usize = PALETTE.len();

/// Blue, orange, green, red, violet, teal, pink, brown.
const PALETTE: [&str; 8] =
    ["#2f81d6", "#cc7722", "#2c9466", "#d9483b", "#9268d6", "#1b91a8", "#cf5198", "#a5754d"];

/// Dashes and gaps of a curve, in pixels: the first eight curves are drawn through, each eight
/// after them in another way.
const DASHES: [&str; 10] =
    ["", "9 4", "2 3", "14 4 2 4", "5 5", "18 4 2 3 2 3", "1.5 6", "11 3 5 3", "24 8", "7 2 1 2"];

/// How a line is drawn, as an attribute; empty for one that is drawn through. They repeat.
pub fn dashes(index: usize) -> String {
    match DASHES[index % DASHES.len()] {
        "" => String::new(),
        pattern => format!(" stroke-dasharray=\"{pattern}\" stroke-linecap=\"butt\""),
    }
}

/// Text and control points.
pub const INK: &str = "#7b828d";

/// Attributes of control polygons and nets.
pub const POLYGON: &str =
    "fill=\"none\" stroke=\"#7b828d\" stroke-width=\"1.2\" stroke-dasharray=\"5 4\"";

/// Attributes of control nets: what a surface hides of them is seen through it, faintly. What is
/// before it is drawn by the surface.
pub const NET: &str = "fill=\"none\" stroke=\"#7b828d\" stroke-width=\"1.2\" stroke-dasharray=\"3 4\" stroke-opacity=\"0.45\"";

/// Attributes of axes and their numbers.
pub const AXES: &str = "fill=\"#7b828d\" stroke=\"#7b828d\" font-size=\"12\"";

/// A colour by its number; they repeat.
pub fn color(index: usize) -> &'static str {
    PALETTE[index % COLORS]
}

/// A colour in a light of strength 0 to 1: from dark to pale.
pub fn lit(index: usize, light: f64) -> String {
    let channel =
        |k: usize| i64::from_str_radix(&color(index)[1 + 2 * k..3 + 2 * k], 16).unwrap_or(0) as f64;
    let shade = |k: usize| {
        let full = channel(k);
        let value = if light < 0.6 {
            full * (0.45 + 0.55 * light / 0.6)
        } else {
            full + (255.0 - full) * (light - 0.6) / 0.4 * 0.55
        };
        value.round().clamp(0.0, 255.0) as u8
    };
    format!("#{:02x}{:02x}{:02x}", shade(0), shade(1), shade(2))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Relative luminance (WCAG 2.1).
    fn luminance(color: &str) -> f64 {
        let channel = |k: usize| {
            let c =
                f64::from(u8::from_str_radix(&color[1 + 2 * k..3 + 2 * k], 16).unwrap()) / 255.0;
            if c <= 0.039_28 { c / 12.92 } else { ((c + 0.055) / 1.055).powf(2.4) }
        };
        0.2126 * channel(0) + 0.7152 * channel(1) + 0.0722 * channel(2)
    }

    fn contrast(color: &str, page: &str) -> f64 {
        let (a, b) = (luminance(color) + 0.05, luminance(page) + 0.05);
        f64::max(a / b, b / a)
    }

    #[test]
    fn every_colour_is_readable_on_a_light_and_on_a_dark_page() {
        for page in ["#ffffff", "#0d1117"] {
            PALETTE.iter().for_each(|color| {
                assert!(contrast(color, page) >= 3.0, "{color} {page} {}", contrast(color, page))
            });
            assert!(contrast(INK, page) >= 3.8, "{page} {}", contrast(INK, page));
        }
    }
}
