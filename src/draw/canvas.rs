//! The SVG text, element by element.

use std::fmt::Write as _;

use crate::core::context::Context;
use crate::core::error::Error;
use crate::core::fault::Fault;
use crate::core::point::Point;
use crate::draw::cubics::drawable;
use crate::draw::frame::Frame;
use crate::draw::text::{escape, number};
use crate::draw::{Mark, palette};

/// A document being written.
#[derive(Debug)]
pub struct Canvas {
    text: String,
    /// Whether every coordinate so far was a number.
    finite: bool,
}

impl Canvas {
    /// An empty page.
    pub fn new([width, height]: [usize; 2], title: &str) -> Self {
        let head = format!(
            "<svg xmlns=\"http://www.w3.org/2000/svg\" role=\"img\" width=\"{width}\" height=\"{height}\" viewBox=\"0 0 {width} {height}\" \
             font-family=\"sans-serif\" font-size=\"14\">\n<title>{}</title>\n",
            escape(title)
        );
        Canvas { text: head, finite: true }
    }

    /// The document.
    ///
    /// # Errors
    /// [`Fault::Overflow`] where a coordinate was no number; [`Fault::Cancelled`], after which
    /// nothing more was drawn.
    pub fn finish(mut self, context: &Context) -> Result<String, Error> {
        context.checkpoint()?;
        self.text.push_str("</svg>\n");
        if self.finite { Ok(self.text) } else { Err(Fault::Overflow.into()) }
    }

    /// Opens a group.
    pub fn open(&mut self, class: &str, attributes: &str) {
        let space = if attributes.is_empty() { "" } else { " " };
        self.line(format_args!("<g class=\"{class}\"{space}{attributes}>"));
    }

    /// Closes it.
    pub fn close(&mut self) {
        self.line(format_args!("</g>"));
    }

    /// Writing to a string cannot fail.
    fn line(&mut self, line: std::fmt::Arguments<'_>) {
        let _ = writeln!(self.text, "{line}");
    }

    fn pair(&mut self, context: &Context, p: Point<2>) -> String {
        self.finite &= p.is_finite();
        // A picture that nobody waits for is never finished: the rest of it may as well be empty.
        if context.checkpoint().is_err() {
            String::new()
        } else {
            format!("{} {}", number(p[0]), number(p[1]))
        }
    }

    /// One path for all segments of a curve. Neighbours that do not meet are not joined.
    pub fn curve(
        &mut self,
        context: &Context,
        segments: &[Vec<Point<2>>],
        frame: &Frame,
        mark: &Mark,
    ) {
        let mut data = String::new();
        let mut end = None;
        for segment in segments {
            if context.checkpoint().is_err() {
                return;
            }
            if end != Some(segment[0]) {
                let start = self.pair(context, frame.place(segment[0]));
                let _ = write!(data, "{}M {start}", if data.is_empty() { "" } else { " " });
            }
            end = segment.last().copied();
            let placed: Vec<_> = segment.iter().map(|&p| frame.place(p)).collect();
            self.finite &= placed.iter().all(|p| p.is_finite());
            if self.finite {
                drawable(&placed).iter().for_each(|piece| self.piece(context, &mut data, piece));
            }
        }
        let (color, dashes) = (palette::color(mark.color), palette::dashes(mark.dashes));
        self.line(format_args!("<path d=\"{data}\" stroke=\"{color}\"{dashes}/>"));
    }

    fn piece(&mut self, context: &Context, data: &mut String, piece: &[Point<2>]) {
        data.push_str([" L", " L", " Q", " C"][piece.len() - 1]);
        for &p in &piece[usize::from(piece.len() > 1)..] {
            let pair = self.pair(context, p);
            let _ = write!(data, " {pair}");
        }
    }

    /// Straight lines through points of the plane. An empty colour is that of the group.
    pub fn polyline(&mut self, context: &Context, points: &[Point<2>], frame: &Frame, color: &str) {
        let placed: Vec<_> = points.iter().map(|&p| frame.place(p)).collect();
        let data = self.through(context, &placed);
        self.stroke(&data, color);
    }

    /// Many lines of two points as one path.
    pub fn lines(
        &mut self,
        context: &Context,
        lines: &[[Point<2>; 2]],
        frame: &Frame,
        color: &str,
    ) {
        let data: Vec<String> =
            lines.iter().map(|line| self.through(context, &line.map(|p| frame.place(p)))).collect();
        if !data.is_empty() {
            self.stroke(&data.join(" "), color);
        }
    }

    fn through(&mut self, context: &Context, pixels: &[Point<2>]) -> String {
        let mut data = String::new();
        for (i, &p) in pixels.iter().enumerate() {
            data.push_str(if i == 0 { "M " } else { " L " });
            data.push_str(&self.pair(context, p));
        }
        data
    }

    fn stroke(&mut self, data: &str, color: &str) {
        match color {
            "" => self.line(format_args!("<path d=\"{data}\"/>")),
            _ => self.line(format_args!("<path d=\"{data}\" stroke=\"{color}\"/>")),
        }
    }

    /// A filled face; its outline in the same colour hides the seam to its neighbours.
    pub fn face(&mut self, context: &Context, pixels: &[Point<2>], color: &str) {
        let data = self.through(context, pixels);
        self.line(format_args!("<path d=\"{data} Z\" fill=\"{color}\" stroke=\"{color}\"/>"));
    }

    /// Lines of two pixels each, as one path.
    pub fn edges(&mut self, context: &Context, edges: &[[Point<2>; 2]], color: &str) {
        let data: Vec<String> = edges.iter().map(|edge| self.through(context, edge)).collect();
        self.line(format_args!(
            "<path d=\"{}\" fill=\"none\" stroke=\"{color}\"/>",
            data.join(" ")
        ));
    }

    /// A line of a control net.
    pub fn wire(&mut self, context: &Context, pixels: [Point<2>; 2]) {
        let (data, ink) = (self.through(context, &pixels), palette::INK);
        self.line(format_args!("<path d=\"{data}\" fill=\"none\" stroke=\"{ink}\" stroke-width=\"1.2\" stroke-linecap=\"round\"/>"));
    }

    /// A line of an axis; a faint one of the grid otherwise.
    pub fn rule(&mut self, context: &Context, pixels: [Point<2>; 2], axis: bool) {
        let data = self.through(context, &pixels);
        let opacity = if axis { "0.9" } else { "0.25" };
        self.line(format_args!("<path d=\"{data}\" fill=\"none\" opacity=\"{opacity}\"/>"));
    }

    /// A sample of a colour.
    pub fn sample(&mut self, context: &Context, pixels: [Point<2>; 2], mark: &Mark) {
        let data = self.through(context, &pixels);
        let (color, dashes) = (palette::color(mark.color), palette::dashes(mark.dashes));
        let end = if dashes.is_empty() { " stroke-linecap=\"round\"" } else { &dashes };
        self.line(format_args!("<path d=\"{data}\" stroke=\"{color}\" stroke-width=\"3\"{end}/>"));
    }

    /// A dot.
    pub fn dot(&mut self, context: &Context, at: Point<2>, radius: f64, color: &str) {
        if context.checkpoint().is_err() {
            return;
        }
        self.finite &= at.is_finite();
        let (x, y, r) = (number(at[0]), number(at[1]), number(radius));
        self.line(format_args!("<circle cx=\"{x}\" cy=\"{y}\" r=\"{r}\" fill=\"{color}\"/>"));
    }

    /// A line of text.
    pub fn word(&mut self, at: Point<2>, anchor: &str, text: &str) {
        self.finite &= at.is_finite();
        let (x, y) = (number(at[0]), number(at[1]));
        self.line(format_args!(
            "<text x=\"{x}\" y=\"{y}\" text-anchor=\"{anchor}\" stroke=\"none\">{}</text>",
            escape(text)
        ));
    }
}
