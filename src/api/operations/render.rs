//! `render`.

use crate::api::cost::{Cost, Costed, Kind, size};
use crate::api::error::{Error, Locate, both, every};
use crate::api::json::Request;
use crate::api::operations::Example;
use crate::api::operations::Operation;
use crate::api::wire::{Curve, Dimensioned, Surface, Whole, list, missing, number, part, whole};
use crate::core::check::at_most;
use crate::core::context::Context;
use crate::core::fault::Fault;
use crate::core::limits;
use crate::draw as core;
use crate::draw::{Curves, Mark, Picture};

crate::names! {
    /// What a picture shows beside the curves and surfaces.
    pub enum Detail {
        /// Control polygons and control nets.
        Polygon = "polygon",
        /// The joints and ends of segments.
        Joints = "joints",
        /// The curvature of curves: lines against the normal, all to one scale.
        Comb = "comb",
        /// Axes with round numbers.
        Axes = "axes",
        /// The labels.
        Legend = "legend",
    }
}

crate::object! {
    /// A curve to draw.
    pub struct DrawnCurve {
        /// The curve. All curves are 2D, or all are 3D; beside surfaces they are 3D.
        required curve: Curve,
        /// Its text in the legend, up to 60 characters.
        optional label: String,
        /// Its colour in the palette; default its place in the list, after the surfaces, modulo 8,
        /// and from the ninth on dashed.
        optional color: Whole = whole(0, core::COLORS - 1),
    }
}
crate::nested!(DrawnCurve);

crate::object! {
    /// A surface to draw.
    pub struct DrawnSurface {
        /// The surface.
        required surface: Surface,
        /// Its text in the legend, up to 60 characters.
        optional label: String,
        /// Its colour in the palette; default its place in the list, modulo 8.
        optional color: Whole = whole(0, core::COLORS - 1),
    }
}
crate::nested!(DrawnSurface);

crate::object! {
    /// What to draw: `curves`, `surfaces` or both.
    pub struct RenderRequest {
        /// The curves, in the order they are drawn; up to 64 curves, with up to 20,000 segments.
        optional curves: Vec<DrawnCurve> = list::<DrawnCurve>(1, limits::PICTURE_CURVES),
        /// The surfaces, drawn before the curves and one after the other; up to 16.
        optional surfaces: Vec<DrawnSurface> = list::<DrawnSurface>(1, limits::PICTURE_SURFACES),
        /// What else is shown; default only the legend.
        optional show: Vec<Detail>,
        /// The length of a line of the comb for curvature 1, in the units of the curves: positive,
        /// to compare pictures. Default: the longest line is a fifth of the picture; where nine
        /// lines in ten are less than a fifth as long, those far longer are cut there.
        optional comb_scale: f64 = number().exclusive_minimum(Some(0.0)),
        /// The width of the picture in pixels; default 800.
        optional width: Whole = whole(limits::PIXELS.0, limits::PIXELS.1),
        /// The height of the picture in pixels; default 500.
        optional height: Whole = whole(limits::PIXELS.0, limits::PIXELS.1),
        /// The title, for those who do not see the picture, up to 200 characters; default the
        /// labels.
        optional title: String,
    }
}

/// The request bodies that the specification shows.
pub const EXAMPLES: &[Example] = &[
    Example::new(
        "cheng-figure-3",
        "One control polygon, three values of beta (Cheng et al. 2021 Figure 3)",
        include_str!("../../../openapi/examples/render-cheng-figure-3.json"),
    ),
    Example::new(
        "comb",
        "A curve in space with its curvature comb and axes",
        include_str!("../../../openapi/examples/render-comb.json"),
    ),
    Example::new(
        "li-figure-7",
        "A surface with its control net (Li 2014 Figure 7)",
        include_str!("../../../openapi/examples/render-li-figure-7.json"),
    ),
    Example::new(
        "weights",
        "One weight of a Beta-Bezier curve: 0.2, 1, 5",
        include_str!("../../../openapi/examples/render-weights.json"),
    ),
];

/// Draw curves and surfaces.
#[derive(Debug, Clone, Copy)]
pub struct Render;

impl Operation for Render {
    type Request = RenderRequest;
    type Answer = String;
    const PATH: &str = "/v1/render";
    const ID: &str = "render";
    const TAG: &str = "Curves";
    const SUMMARY: &str = "Draw curves and surfaces";
    const DESCRIPTION: &str = "\
        As SVG, y up (in space z up, in one fixed orthographic projection), the aspect ratio \
        kept. Segments of degree 1 to 3 are drawn with their own Bezier points, higher degrees \
        as cubics within 0.01 pixel; coordinates are rounded to 0.01 pixel. The background is \
        transparent, and the colours are readable on light and dark pages. Cost: linear in \
        segments.";
    const ANSWERED: &str = "The picture.";
    const EXAMPLES: &[Example] = EXAMPLES;

    fn compute(context: &Context, request: RenderRequest) -> Result<String, Error> {
        Ok(core::draw(context, &picture(context, request)?)?)
    }
}

impl Costed for RenderRequest {
    fn cost(&self) -> Cost {
        let curves: f64 =
            self.curves.iter().flatten().filter_map(|drawn| drawn.curve.as_ref()).map(size).sum();
        let surfaces = self.surfaces.as_ref().map_or(0, Vec::len) as f64;
        Cost::new(Kind::Render, 1_000.0 * curves + 1e6 * surfaces)
    }
}

impl Request for RenderRequest {
    fn check(self, context: &Context) -> Result<(), Error> {
        picture(context, self).map(drop)
    }
}

fn picture(context: &Context, request: RenderRequest) -> Result<Picture, Error> {
    let is_empty = request.curves.is_none() && request.surfaces.is_none();
    let given = if is_empty { Err(missing("curves` or `surfaces")) } else { Ok(()) };
    let size = both(pixels(request.width, "width", 800), pixels(request.height, "height", 500));
    let count = request.surfaces.as_ref().map_or(0, Vec::len);
    let drawn = both(
        surfaces(context, request.surfaces).at("surfaces"),
        curves(context, request.curves, count).at("curves"),
    );
    let title = request
        .title
        .as_deref()
        .map_or(Ok(()), |title| core::check_text(title, limits::TITLE))
        .at("title");
    let ((((surfaces, surface_marks), curves), (width, height)), ((), ())) =
        both(both(drawn, size), both(title, given))?;
    let show = show(&request.show.unwrap_or_else(|| vec![Detail::Legend]));
    let comb_scale = request.comb_scale.map(|scale| comb_scale(scale, show)).transpose()?;
    let title = request.title.unwrap_or_else(|| title_of(surface_marks.iter().chain(&curves.1)));
    Ok(Picture {
        comb_scale,
        curves: curves.0,
        curve_marks: curves.1,
        surfaces,
        surface_marks,
        show,
        size: [width, height],
        title,
    })
}

fn pixels(given: Option<Whole>, what: &'static str, default: usize) -> Result<usize, Error> {
    let (least, most) = limits::PIXELS;
    let value = given.map_or(default, |whole| whole.0);
    if (least..=most).contains(&value) {
        return Ok(value);
    }
    Err(Fault::OutOfRange {
        what,
        value: value as f64,
        allowed: format!("{least} <= {what} <= {most}"),
    })
    .at(what)
}

fn comb_scale(scale: f64, show: core::Show) -> Result<f64, Error> {
    const WHAT: &str = "comb_scale";
    if !show.comb {
        let detail =
            "`comb_scale` is given, but `show` has no \"comb\"; add it, or leave the scale out";
        return Err(Fault::Contradiction(detail.into())).at(WHAT);
    }
    if scale > 0.0 {
        Ok(scale)
    } else {
        Err(Fault::OutOfRange { what: WHAT, value: scale, allowed: "comb_scale > 0".into() })
            .at(WHAT)
    }
}

fn show(wanted: &[Detail]) -> core::Show {
    let has = |detail| wanted.contains(&detail);
    core::Show {
        polygon: has(Detail::Polygon),
        joints: has(Detail::Joints),
        comb: has(Detail::Comb),
        axes: has(Detail::Axes),
        legend: has(Detail::Legend),
    }
}

/// The labels, or what is there where nothing has one.
fn title_of<'a>(marks: impl Iterator<Item = &'a Mark>) -> String {
    let labels: Vec<&str> = marks.filter_map(|mark| mark.label.as_deref()).collect();
    if labels.is_empty() { "Curves and surfaces".into() } else { labels.join(", ") }
}

fn mark(label: Option<String>, color: Option<Whole>, place: usize) -> Result<Mark, Error> {
    let text =
        label.as_deref().map_or(Ok(()), |label| core::check_text(label, limits::LABEL)).at("label");
    // A colour that was chosen is drawn through.
    let dashes = if color.is_some() { 0 } else { place / core::COLORS };
    let color = color.map_or(place % core::COLORS, |whole| whole.0);
    let allowed = || format!("0 <= color <= {}", core::COLORS - 1);
    let known = color < core::COLORS;
    let palette = if known {
        Ok(())
    } else {
        Err(Fault::OutOfRange { what: "color", value: color as f64, allowed: allowed() })
            .at("color")
    };
    both(text, palette).map(|_| Mark { label, color, dashes })
}

fn surfaces(
    context: &Context,
    drawn: Option<Vec<DrawnSurface>>,
) -> Result<(Vec<crate::core::surface::Surface>, Vec<Mark>), Error> {
    let Some(drawn) = drawn else { return Ok(Default::default()) };
    crate::core::check::at_least("surfaces", drawn.len(), 1)?;
    at_most("surfaces in a picture", drawn.len(), limits::PICTURE_SURFACES, "Draw them in parts")?;
    let one = |(i, drawn): (usize, DrawnSurface)| -> Result<_, Error> {
        let mark = mark(drawn.label, drawn.color, i);
        let (surface, mark) =
            both(part(drawn.surface, "surface", |value| value.parse(context)), mark)?;
        let points = surface.rows().map(<[_]>::len).sum();
        at_most(
            "control points in a picture",
            points,
            limits::PICTURE_NET,
            "Cut the surface first",
        )
        .at("surface")?;
        Ok((surface, mark))
    };
    Ok(every(drawn.into_iter().enumerate().map(|(i, drawn)| one((i, drawn)).at(i)))?
        .into_iter()
        .unzip())
}

fn curves(
    context: &Context,
    drawn: Option<Vec<DrawnCurve>>,
    surfaces: usize,
) -> Result<(Curves, Vec<Mark>), Error> {
    let Some(drawn) = drawn else { return Ok((Curves::Space(Vec::new()), Vec::new())) };
    crate::core::check::at_least("curves", drawn.len(), 1)?;
    at_most("curves in a picture", drawn.len(), limits::PICTURE_CURVES, "Draw them in parts")?;
    let (mut plane, mut space, mut marks) = (Vec::new(), Vec::new(), Vec::new());
    let one = |(i, drawn): (usize, DrawnCurve)| {
        both(
            part(drawn.curve, "curve", |value| value.parse(context)),
            mark(drawn.label, drawn.color, surfaces + i),
        )
        .at(i)
    };
    for (i, (curve, mark)) in every(drawn.into_iter().enumerate().map(one))?.into_iter().enumerate()
    {
        match curve {
            Dimensioned::Plane(curve) => plane.push(curve),
            Dimensioned::Space(curve) => space.push(curve),
        }
        marks.push(mark);
        let in_space = surfaces > 0 || !space.is_empty();
        if in_space && !plane.is_empty() {
            let (count, expected) = if surfaces > 0 || plane.len() <= i { (2, 3) } else { (3, 2) };
            let rule =
                "curves are drawn together in the plane or in space, and beside surfaces in space";
            let fault = Fault::WrongCount { what: "coordinates", count, expected, rule };
            return Err(fault).at("control_points").at("curve").at(i);
        }
    }
    Ok((if plane.is_empty() { Curves::Space(space) } else { Curves::Plane(plane) }, marks))
}
