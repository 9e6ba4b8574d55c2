//! Surfaces on the wire.

use utoipa::openapi::schema::ArrayBuilder;

use crate::api::error::{Error, Locate, both, every};
use crate::api::wire::basis::Basis;
use crate::api::wire::field::{Tuple, list, number, part};
use crate::api::wire::points::{Points, space_list};
use crate::core::context::Context;
use crate::core::fault::Fault;
use crate::core::limits;
use crate::core::point::Point;
use crate::core::surface as core;

crate::object! {
    /// A tensor-product surface in space: a control net with a basis for each direction (Li 2014
    /// eq. (15) where both are alpha-beta-bezier). The domain of each parameter is that of its
    /// basis: [0, alpha] for alpha-beta-bezier, [0, 1] otherwise.
    pub struct Surface {
        /// The basis of u, which runs from the first row of the net to the last.
        required u: Basis,
        /// The basis of v, which runs along each row.
        required v: Basis,
        /// Rows of 3D control points, each row with as many as the first; 2 to 65 rows of 2 to 65
        /// points.
        required control_net: Vec<Points> = net(),
        /// A positive weight for each control point, in rows as the net has them: the surface is
        /// the sum of w P b(u) b(v), divided by that of w b(u) b(v). The points are not multiplied
        /// by their weights. The largest weight is at most 1e12 times the smallest. Equal weights
        /// (the default) mean nothing, and answers then have none.
        optional weights: Vec<Vec<f64>> = weights(),
    }
}
crate::nested!(Surface);

crate::object! {
    /// A rectangle of parameters.
    pub struct SurfaceDomain {
        /// First and last parameter u.
        required u: Tuple<f64, 2> = list::<f64>(2, 2),
        /// First and last parameter v.
        required v: Tuple<f64, 2> = list::<f64>(2, 2),
    }
}
crate::nested!(SurfaceDomain);

fn net() -> ArrayBuilder {
    const MOST: usize = limits::DEGREE + 1;
    ArrayBuilder::new()
        .items(space_list().min_items(Some(2)).max_items(Some(MOST)))
        .min_items(Some(2))
        .max_items(Some(MOST))
}

fn weights() -> ArrayBuilder {
    const MOST: usize = limits::DEGREE + 1;
    let weight = number().exclusive_minimum(Some(0.0));
    let row = ArrayBuilder::new().items(weight).min_items(Some(2)).max_items(Some(MOST));
    ArrayBuilder::new().items(row).min_items(Some(2)).max_items(Some(MOST))
}

impl Surface {
    /// The core's surface.
    ///
    /// # Errors
    /// Faults of a basis, of the net or of the weights, each at its place; a row of 2D points.
    pub fn parse(self, context: &Context) -> Result<core::Surface, Error> {
        let bases = both(
            part(self.u, "u", |value| value.parse(context)),
            part(self.v, "v", |value| value.parse(context)),
        );
        let rows =
            |net: Vec<Points>| every(net.into_iter().enumerate().map(|(i, row)| space(row).at(i)));
        let shape =
            self.control_net.as_ref().map(|net| (net.len(), net.first().map_or(0, Points::len)));
        let weights = self.weights.zip(shape).map(|(weights, (rows, columns))| {
            core::net_weights(weights, rows, columns).map_err(Error::from).at("weights")
        });
        let net = both(bases, part(self.control_net, "control_net", rows));
        let (((u, v), net), weights) = both(net, weights.transpose())?;
        let surface = core::Surface::new(context, u, v, net)?;
        Ok(match weights {
            Some(weights) => surface.with_weights(weights)?,
            None => surface,
        })
    }
}

/// A row of the net. An empty one has no dimension yet, and the core refuses it by its count.
fn space(row: Points) -> Result<Vec<Point<3>>, Fault> {
    match row {
        Points::Space(points) => Ok(points),
        Points::Plane(points) if points.is_empty() => Ok(Vec::new()),
        Points::Plane(_) => Err(Fault::WrongCount {
            what: "coordinates",
            count: 2,
            expected: 3,
            rule: "the control points of a surface are 3D",
        }),
    }
}

impl From<&core::Surface> for Surface {
    fn from(surface: &core::Surface) -> Self {
        let [u, v] = surface.bases();
        Surface {
            u: Some(u.into()),
            v: Some(v.into()),
            control_net: Some(surface.rows().map(|row| row.to_vec().into()).collect()),
            weights: surface.weights().map(|rows| rows.map(<[_]>::to_vec).collect()),
        }
    }
}

impl From<[(f64, f64); 2]> for SurfaceDomain {
    fn from([u, v]: [(f64, f64); 2]) -> Self {
        SurfaceDomain { u: Some(Tuple([u.0, u.1])), v: Some(Tuple([v.0, v.1])) }
    }
}
