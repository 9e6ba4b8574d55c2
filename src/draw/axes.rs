//! Axes with round numbers.

use crate::core::context::Context;
use crate::core::point::Point;
use crate::draw::canvas::Canvas;
use crate::draw::frame::{Frame, Plot};
use crate::draw::palette;
use crate::draw::ticks::scale;
use crate::draw::view::{Box3, project};

/// Pixels between two numbers, at least.
const SPACING: f64 = 60.0;

/// A grid over the plot, numbers below and to the left. Where numbers are nearly equal, what they
/// have in common is written once.
pub fn draw_plane_axes(context: &Context, canvas: &mut Canvas, plot: &Plot, frame: &Frame) {
    let (low, high) = (
        frame.world(Point([plot.low[0], plot.high[1]])),
        frame.world(Point([plot.high[0], plot.low[1]])),
    );
    let room = plot.high - plot.low;
    let count = |pixels: f64| (pixels / SPACING) as usize + 1;
    canvas.open("axes", palette::AXES);
    let [x, y] = [0, 1].map(|k| scale(low[k], high[k], count(room[k])));
    if let Some(offset) = x.offset {
        canvas.word(Point([plot.high[0], plot.high[1] + 33.0]), "end", &format!("x {offset}"));
    }
    if let Some(offset) = y.offset {
        canvas.word(Point([6.0, plot.low[1] - 9.0]), "start", &format!("y {offset}"));
    }
    for tick in x.ticks {
        let x = frame.place(Point([tick.value, 0.0]))[0];
        canvas.rule(
            context,
            [Point([x, plot.low[1]]), Point([x, plot.high[1]])],
            tick.value == 0.0,
        );
        canvas.word(Point([x, plot.high[1] + 17.0]), "middle", &tick.text);
    }
    for tick in y.ticks {
        let y = frame.place(Point([0.0, tick.value]))[1];
        canvas.rule(
            context,
            [Point([plot.low[0], y]), Point([plot.high[0], y])],
            tick.value == 0.0,
        );
        canvas.word(Point([plot.low[0] - 7.0, y + 4.0]), "end", &tick.text);
    }
    canvas.close();
}

/// Three edges of the box around everything, with their numbers outside.
pub fn draw_space_axes(context: &Context, canvas: &mut Canvas, space: &Box3, frame: &Frame) {
    canvas.open("axes", palette::AXES);
    let place = |p: Point<3>| frame.place(project(p));
    for (axis, [from, to]) in space.edges().into_iter().enumerate() {
        canvas.rule(context, [place(from), place(to)], true);
        let length = place(from).distance(place(to));
        let scale = scale(from[axis], to[axis], (length / SPACING) as usize + 1);
        for tick in scale.ticks {
            let mut at = from;
            at[axis] = tick.value;
            let (aside, anchor) = [
                (Point([-6.0, 16.0]), "middle"),
                (Point([8.0, 12.0]), "start"),
                (Point([-8.0, 4.0]), "end"),
            ][axis];
            canvas.word(place(at) + aside, anchor, &tick.text);
        }
        let (aside, anchor) = [
            (Point([-14.0, 34.0]), "middle"),
            (Point([24.0, 30.0]), "start"),
            (Point([-34.0, 4.0]), "end"),
        ][axis];
        let name = ["x", "y", "z"][axis];
        let text = scale.offset.map_or(name.to_owned(), |offset| format!("{name} {offset}"));
        canvas.word(place(from.lerp(to, 0.5)) + aside, anchor, &text);
    }
    canvas.close();
}
