//! Pictures of curves and surfaces, as SVG text.
//!
//! `sketch` projects curves to the plane, `frame` fits the plane to the page, the other files draw
//! one thing each, and [`draw`] puts them in order. A picture is exact where SVG allows it:
//! segments of degree 1 to 3 are written with their Bezier points. The same picture always gives
//! the same text.

mod axes;
mod canvas;
mod comb;
mod cubics;
mod frame;
mod legend;
mod palette;
mod shading;
mod sketch;
mod text;
mod ticks;
mod view;

pub use palette::COLORS;
pub use text::{check_text, escape};

use crate::core::argument::Argument;
use crate::core::check::at_most;
use crate::core::context::Context;
use crate::core::dimensioned::Dimensioned;
use crate::core::error::{Error, Locate};
use crate::core::limits;
use crate::core::point::Point;
use crate::core::rational::AnyCurve;
use crate::core::surface::Surface;
use axes::{draw_plane_axes, draw_space_axes};
use canvas::Canvas;
use frame::{Bounds, Frame, Plot};
use legend::Legend;
use shading::Shaded;
use sketch::Sketch;
use view::Box3;

/// Curves of the plane, drawn as they are, y up; or of space, drawn in the fixed projection of this
/// module, z up.
pub type Curves = Dimensioned<Vec<AnyCurve<2, 3>>, Vec<AnyCurve<3, 4>>>;

/// How one curve or surface is told from the others.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Mark {
    /// Its entry in the legend.
    pub label: Option<String>,
    /// Its colour in the palette.
    pub color: usize,
    /// How a curve is dashed: 0 is drawn through.
    pub dashes: usize,
}

/// What is drawn beside the curves themselves.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct Show {
    /// Control polygons and control nets.
    pub polygon: bool,
    /// The joints and ends of segments.
    pub joints: bool,
    /// Curvature, as lines from the curve against its normal.
    pub comb: bool,
    /// Axes with round numbers.
    pub axes: bool,
    /// The labels.
    pub legend: bool,
}

/// A picture to draw.
#[derive(Debug, Clone, PartialEq)]
pub struct Picture {
    /// The curves.
    pub curves: Curves,
    /// One mark for each curve.
    pub curve_marks: Vec<Mark>,
    /// The surfaces; the curves beside them are curves of space, or none.
    pub surfaces: Vec<Surface>,
    /// One mark for each surface.
    pub surface_marks: Vec<Mark>,
    /// What else is drawn.
    pub show: Show,
    /// The length of a line of the comb for curvature 1, in the units of the curve; otherwise the
    /// longest is a fifth of the picture.
    pub comb_scale: Option<f64>,
    /// Width and height in pixels.
    pub size: [usize; 2],
    /// The title, for readers that do not see the picture.
    pub title: String,
}

/// The picture as SVG.
///
/// # Errors
/// More segments than [`limits::PICTURE_SEGMENTS`]; coordinates too large for a picture.
pub fn draw(context: &Context, picture: &Picture) -> Result<String, Error> {
    let sketches = sketches(context, &picture.curves, picture.show.comb)?;
    let surfaces = picture
        .surfaces
        .iter()
        .map(|surface| Shaded::of(context, surface))
        .collect::<Result<Vec<_>, _>>()?;
    let legend = Legend::of(picture);
    let plot = Plot::inside(picture.size, picture.show.axes, legend.width());
    let space = space_box(context, picture)?;
    let comb = comb::scale(
        sketches.iter().flat_map(|sketch| &sketch.teeth),
        &bounds(context, picture, &sketches, &surfaces, None)?,
        picture.comb_scale,
    );
    let bounds = bounds(context, picture, &sketches, &surfaces, Some(comb))?
        .with_box(space.as_ref().filter(|_| picture.show.axes));
    let frame = Frame::fit(&bounds, &plot)?;
    let mut canvas = Canvas::new(picture.size, &picture.title);
    if picture.show.axes {
        match &space {
            Some(space) => draw_space_axes(context, &mut canvas, space, &frame),
            None => draw_plane_axes(context, &mut canvas, &plot, &frame),
        }
    }
    draw_surfaces(context, &mut canvas, picture, &surfaces, &frame);
    draw_curves(context, &mut canvas, picture, &sketches, &frame, comb);
    legend.draw(context, &mut canvas, &plot);
    canvas.finish(context)
}

fn sketches(context: &Context, curves: &Curves, comb: bool) -> Result<Vec<Sketch>, Error> {
    let sketches = match curves {
        Curves::Plane(curves) => all(context, curves, |p| p, comb)?,
        Curves::Space(curves) => all(context, curves, view::project, comb)?,
    };
    let count = sketches.iter().map(|sketch| sketch.segments.len()).sum();
    at_most("segments in a picture", count, limits::PICTURE_SEGMENTS, "Draw the curves in parts")?;
    Ok(sketches)
}

fn all<const D: usize, const H: usize>(
    context: &Context,
    curves: &[AnyCurve<D, H>],
    view: fn(Point<D>) -> Point<2>,
    comb: bool,
) -> Result<Vec<Sketch>, Error> {
    let sketch = |(i, curve)| {
        Sketch::of(context, curve, view, comb).at(Argument::Curve).at(i).at(Argument::Curves)
    };
    curves.iter().enumerate().map(sketch).collect()
}

/// The box around everything, in space; `None` for a picture of the plane.
fn space_box(context: &Context, picture: &Picture) -> Result<Option<Box3>, Error> {
    let mut space = Box3::EMPTY;
    if let Curves::Space(curves) = &picture.curves {
        for curve in curves {
            match curve {
                AnyCurve::Polynomial(curve) => {
                    let composite = curve.composite(context)?;
                    composite.locals().for_each(|segment| space.add(segment.absolute()));
                }
                // The curve stays among its control points.
                AnyCurve::Rational(rational) => {
                    space.add(rational.curve().control_points().iter().copied());
                }
            }
        }
    }
    for surface in &picture.surfaces {
        context.checkpoint()?;
        space.add(surface.shape().hull());
    }
    Ok((!space.is_empty()).then_some(space))
}

fn bounds(
    context: &Context,
    picture: &Picture,
    sketches: &[Sketch],
    surfaces: &[Shaded],
    comb: Option<comb::CombScale>,
) -> Result<Bounds, Error> {
    let mut bounds = Bounds::EMPTY;
    let mut pace = context.pace();
    for sketch in sketches {
        for segment in &sketch.segments {
            pace.step()?;
            bounds.add_curve(segment);
        }
        if picture.show.polygon {
            bounds.add(&sketch.polygon);
        }
        if let Some(scale) = comb {
            sketch.teeth.iter().for_each(|tooth| bounds.add(&[tooth.end(scale)]));
        }
    }
    for surface in surfaces {
        bounds.add(&surface.outline());
        if picture.show.polygon {
            surface.net.iter().for_each(|line| bounds.add(line));
        }
    }
    Ok(bounds)
}

fn draw_surfaces(
    context: &Context,
    canvas: &mut Canvas,
    picture: &Picture,
    surfaces: &[Shaded],
    frame: &Frame,
) {
    for (shaded, mark) in surfaces.iter().zip(&picture.surface_marks) {
        canvas.open("surface", "stroke-width=\"0.7\" stroke-linejoin=\"round\"");
        shaded.draw(context, canvas, frame, mark.color, picture.show.polygon);
        canvas.close();
        if picture.show.polygon {
            canvas.open("polygon", palette::NET);
            shaded.net.iter().for_each(|line| canvas.polyline(context, line, frame, ""));
            canvas.close();
        }
    }
}

fn draw_curves(
    context: &Context,
    canvas: &mut Canvas,
    picture: &Picture,
    sketches: &[Sketch],
    frame: &Frame,
    comb: comb::CombScale,
) {
    if sketches.is_empty() {
        return;
    }
    if picture.show.polygon {
        draw_polygons(context, canvas, sketches, frame);
    }
    if picture.show.comb {
        let teeth = sketches.iter().map(|sketch| &*sketch.teeth);
        comb::draw(context, canvas, teeth.zip(&picture.curve_marks), frame, comb);
    }
    canvas.open(
        "curves",
        "fill=\"none\" stroke-width=\"2.5\" stroke-linecap=\"round\" stroke-linejoin=\"round\"",
    );
    for (sketch, mark) in sketches.iter().zip(&picture.curve_marks) {
        canvas.curve(context, &sketch.segments, frame, mark);
    }
    canvas.close();
    if picture.show.joints {
        canvas.open("joints", "");
        for (sketch, mark) in sketches.iter().zip(&picture.curve_marks) {
            sketch.joints.iter().for_each(|&joint| {
                canvas.dot(context, frame.place(joint), 3.5, palette::color(mark.color))
            });
        }
        canvas.close();
    }
}

/// Curves that share a control polygon show it once.
fn draw_polygons(context: &Context, canvas: &mut Canvas, sketches: &[Sketch], frame: &Frame) {
    let repeated =
        |i: usize| sketches[..i].iter().any(|before| before.polygon == sketches[i].polygon);
    let fresh: Vec<&Sketch> = sketches
        .iter()
        .enumerate()
        .filter(|(i, _)| !repeated(*i))
        .map(|(_, sketch)| sketch)
        .collect();
    canvas.open("polygon", palette::POLYGON);
    fresh.iter().for_each(|sketch| canvas.polyline(context, &sketch.polygon, frame, ""));
    canvas.close();
    canvas.open("control-points", "");
    fresh
        .iter()
        .flat_map(|sketch| &sketch.polygon)
        .for_each(|&p| canvas.dot(context, frame.place(p), 3.0, palette::INK));
    canvas.close();
}
