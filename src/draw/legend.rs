//! The labels, right of the plot.

use crate::core::context::Context;
use crate::core::point::Point;
use crate::draw::canvas::Canvas;
use crate::draw::frame::Plot;
use crate::draw::{Mark, Picture, palette};

/// What is labelled: surfaces, then curves.
#[derive(Debug)]
pub struct Legend<'a> {
    entries: Vec<(&'a str, &'a Mark)>,
    width: f64,
}

const LINE: f64 = 26.0;
const SIZE: f64 = 14.0;
/// Of a sample of the colour, with the space beside it.
const SAMPLE: f64 = 46.0;
/// Width of a character, about, for a sans-serif face of size 1.
const CHARACTER: f64 = 0.58;

impl<'a> Legend<'a> {
    /// The labels of a picture; none where they are not wanted.
    pub fn of(picture: &'a Picture) -> Self {
        let marks = picture
            .surface_marks
            .iter()
            .chain(&picture.curve_marks)
            .filter(|_| picture.show.legend);
        let entries: Vec<_> =
            marks.filter_map(|mark| Some((mark.label.as_deref()?, mark))).collect();
        let longest = entries.iter().map(|(label, _)| label.chars().count()).max();
        let wish = longest.map_or(0.0, |count| SAMPLE + 16.0 + count as f64 * CHARACTER * SIZE);
        Legend { entries, width: wish.min(picture.size[0] as f64 * 0.45) }
    }

    /// The room it takes from the plot.
    pub fn width(&self) -> f64 {
        self.width
    }

    /// Draws samples and labels, smaller where they would not fit.
    pub fn draw(&self, context: &Context, canvas: &mut Canvas, plot: &Plot) {
        if self.entries.is_empty() {
            return;
        }
        let line = f64::min(LINE, (plot.high[1] - plot.low[1]) / self.entries.len() as f64);
        let longest =
            self.entries.iter().map(|(label, _)| label.chars().count()).max().unwrap_or(1).max(1);
        let wide = (self.width - SAMPLE - 16.0) / (longest as f64 * CHARACTER);
        let size = f64::min(SIZE, line * 0.8).min(wide);
        let left = plot.high[0] + 16.0;
        let top = (plot.low[1] + plot.high[1] - line * (self.entries.len() - 1) as f64) / 2.0;
        canvas.open(
            "legend",
            &format!("font-size=\"{}\" fill=\"{}\"", crate::draw::text::number(size), palette::INK),
        );
        for (i, (label, mark)) in self.entries.iter().enumerate() {
            let y = top + line * i as f64;
            canvas.sample(context, [Point([left, y]), Point([left + 32.0, y])], mark);
            canvas.word(Point([left + SAMPLE - 4.0, y + size * 0.35]), "start", label);
        }
        canvas.close();
    }
}
