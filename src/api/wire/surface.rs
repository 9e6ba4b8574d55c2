//! Surfaces on the wire.

use utoipa::openapi::schema::ArrayBuilder;

use crate::api::error::{Error, Locate, both, every};
use crate::api::wire::basis::Basis;
use crate::api::wire::field::{Tuple, list, part};
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

impl Surface {
    /// The core's surface.
    ///
    /// # Errors
    /// Faults of a basis or of the net, each at its place; a row of 2D points.
    pub fn parse(self, context: &Context) -> Result<core::Surface, Error> {
        let bases = both(
            part(self.u, "u", |value| value.parse(context)),
            part(self.v, "v", |value| value.parse(context)),
        );
        let rows =
            |net: Vec<Points>| every(net.into_iter().enumerate().map(|(i, row)| space(row).at(i)));
        let ((u, v), net) = both(bases, part(self.control_net, "control_net", rows))?;
        Ok(core::Surface::new(context, u, v, net)?)
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
        }
    }
}

impl From<[(f64, f64); 2]> for SurfaceDomain {
    fn from([u, v]: [(f64, f64); 2]) -> Self {
        SurfaceDomain { u: Some(Tuple([u.0, u.1])), v: Some(Tuple([v.0, v.1])) }
    }
}
