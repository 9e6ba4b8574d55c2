//! Lists of points, and single vectors: 2D or 3D.

use std::fmt;

use bytemuck::TransparentWrapper;
use serde::de::{Deserializer, Error as _, MapAccess, SeqAccess, Visitor};
use utoipa::openapi::RefOr;
use utoipa::openapi::schema::{ArrayBuilder, OneOfBuilder, Ref, Schema};

use crate::api::error::Error;
use crate::api::number_text::Numbers;
use crate::api::unwritten::Unwritten;
use crate::api::wire::field::{Components, Described, Field, number, read_each};
use crate::api::wire::raw;
use crate::api::wire::reading::{Read, Reading};
use crate::api::writer::{Writer, Written};
use crate::core::dimensioned::Dimensioned;
use crate::core::fault::Fault;
use crate::core::point::Point;

/// Points of the plane or of space; all of one dimension.
pub type Points = Dimensioned<Vec<Point<2>>, Vec<Point<3>>>;

/// One vector.
pub type Vector = Dimensioned<Point<2>, Point<3>>;

impl From<Vec<Point<2>>> for Points {
    fn from(points: Vec<Point<2>>) -> Self {
        Points::Plane(points)
    }
}

impl From<Vec<Point<3>>> for Points {
    fn from(points: Vec<Point<3>>) -> Self {
        Points::Space(points)
    }
}

impl From<Point<2>> for Vector {
    fn from(point: Point<2>) -> Self {
        Vector::Plane(point)
    }
}

impl From<Point<3>> for Vector {
    fn from(point: Point<3>) -> Self {
        Vector::Space(point)
    }
}

impl Points {
    /// How many.
    pub fn len(&self) -> usize {
        match self {
            Points::Plane(points) => points.len(),
            Points::Space(points) => points.len(),
        }
    }

    /// Whether there are none.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// The points, if they are 2D.
    ///
    /// # Errors
    /// [`Fault::WrongCount`].
    pub fn plane(self) -> Result<Vec<Point<2>>, Error> {
        match self {
            Points::Plane(points) => Ok(points),
            Points::Space(_) => Err(wrong_dimension(3, 2)),
        }
    }

    /// The points, if they are 3D.
    ///
    /// # Errors
    /// [`Fault::WrongCount`].
    pub fn space(self) -> Result<Vec<Point<3>>, Error> {
        match self {
            Points::Space(points) => Ok(points),
            Points::Plane(_) => Err(wrong_dimension(2, 3)),
        }
    }
}

fn wrong_dimension(count: usize, expected: usize) -> Error {
    Fault::WrongCount {
        what: "coordinates",
        count,
        expected,
        rule: "as many as the data points have",
    }
    .into()
}

impl Vector {
    /// The vector, if it has the dimension of the points it goes with.
    ///
    /// # Errors
    /// [`Fault::WrongCount`].
    pub fn of_dimension<const D: usize>(self) -> Result<Point<D>, Error> {
        let coordinates: &[f64] = match &self {
            Vector::Plane(point) => &point.0,
            Vector::Space(point) => &point.0,
        };
        Ok(Point(coordinates.try_into().map_err(|_| wrong_dimension(coordinates.len(), D))?))
    }
}

/// The next coordinate of a point. Where the reader goes on after a fault, so do the coordinates.
fn coordinate<'de, A: SeqAccess<'de>>(
    reading: &Reading,
    seq: &mut A,
) -> Result<Option<f64>, A::Error> {
    let next = seq.next_element();
    if next.is_err() && reading.goes_on() {
        while coordinate(reading, seq)?.is_some() {}
    }
    next
}

/// How many more items there are.
fn rest<'de, A: SeqAccess<'de>>(seq: &mut A) -> Result<usize, A::Error> {
    let mut count = 0;
    while seq.next_element::<serde::de::IgnoredAny>()?.is_some() {
        count += 1;
    }
    Ok(count)
}

/// Exactly `D` numbers.
struct Fixed<const D: usize>(Point<D>);

impl<'de, const D: usize> Read<'de> for Fixed<D> {
    fn read<R: Deserializer<'de>>(reading: &Reading, deserializer: R) -> Result<Self, R::Error> {
        struct FixedVisitor<'r, const D: usize>(&'r Reading<'r>);
        impl<'de, const D: usize> Visitor<'de> for FixedVisitor<'_, D> {
            type Value = Fixed<D>;

            fn expecting(&self, f: &mut fmt::Formatter) -> fmt::Result {
                write!(f, "a point of {D} numbers, as many as the first point has")
            }

            fn visit_seq<A: SeqAccess<'de>>(self, mut seq: A) -> Result<Fixed<D>, A::Error> {
                let mut point = Point::ZERO;
                for i in 0..D {
                    point[i] = coordinate(self.0, &mut seq)?
                        .ok_or_else(|| A::Error::invalid_length(i, &self))?;
                }
                match coordinate(self.0, &mut seq)? {
                    Some(_) => Err(A::Error::invalid_length(D + 1 + rest(&mut seq)?, &self)),
                    None => Ok(Fixed(point)),
                }
            }
        }
        deserializer.deserialize_seq(FixedVisitor(reading))
    }
}

impl<'de> Read<'de> for Vector {
    fn read<R: Deserializer<'de>>(reading: &Reading, deserializer: R) -> Result<Self, R::Error> {
        struct VectorVisitor<'r>(&'r Reading<'r>);
        impl<'de> Visitor<'de> for VectorVisitor<'_> {
            type Value = Vector;

            fn expecting(&self, f: &mut fmt::Formatter) -> fmt::Result {
                f.write_str("a point of 2 or 3 numbers")
            }

            fn visit_seq<A: SeqAccess<'de>>(self, mut seq: A) -> Result<Vector, A::Error> {
                let short = |i: usize| A::Error::invalid_length(i, &self);
                let x = coordinate(self.0, &mut seq)?.ok_or_else(|| short(0))?;
                let y = coordinate(self.0, &mut seq)?.ok_or_else(|| short(1))?;
                let Some(z) = coordinate(self.0, &mut seq)? else {
                    return Ok(Vector::Plane(Point([x, y])));
                };
                match coordinate(self.0, &mut seq)? {
                    Some(_) => Err(short(4 + rest(&mut seq)?)),
                    None => Ok(Vector::Space(Point([x, y, z]))),
                }
            }
        }
        deserializer.deserialize_seq(VectorVisitor(reading))
    }
}

impl<'de> Read<'de> for Points {
    fn read<R: Deserializer<'de>>(reading: &Reading, deserializer: R) -> Result<Self, R::Error> {
        struct PointsVisitor<'r>(&'r Reading<'r>);
        impl<'de> Visitor<'de> for PointsVisitor<'_> {
            type Value = Points;

            fn expecting(&self, f: &mut fmt::Formatter) -> fmt::Result {
                f.write_str("an array of points")
            }

            fn visit_seq<A: SeqAccess<'de>>(self, mut seq: A) -> Result<Points, A::Error> {
                fn after<'de, const D: usize, A: SeqAccess<'de>>(
                    reading: &Reading,
                    first: Point<D>,
                    seq: &mut A,
                ) -> Result<Vec<Point<D>>, A::Error> {
                    let mut points = vec![first];
                    read_each(reading, seq, |Fixed(point)| points.push(point))?;
                    Ok(points)
                }
                match seq.next_element_seed(self.0.seed()) {
                    Ok(Some(Vector::Plane(first))) => {
                        after(self.0, first, &mut seq).map(Points::Plane)
                    }
                    Ok(Some(Vector::Space(first))) => {
                        after(self.0, first, &mut seq).map(Points::Space)
                    }
                    Ok(None) => Ok(Points::Plane(Vec::new())),
                    Err(fault) if self.0.goes_on() => {
                        read_each(self.0, &mut seq, drop::<Vector>)?;
                        Err(fault)
                    }
                    Err(fault) => Err(fault),
                }
            }

            fn visit_map<A: MapAccess<'de>>(self, map: A) -> Result<Points, A::Error> {
                let rows = raw::rows(self.0, map)?;
                let points =
                    rows.points().map(Points::Plane).or_else(|| rows.points().map(Points::Space));
                points.ok_or_else(|| A::Error::custom(rows.misfit("2 or 3: a list of points")))
            }
        }
        raw::deserialize_list(reading, deserializer, PointsVisitor(reading))
    }
}

impl Written for Points {
    fn write_to(&self, writer: &mut Writer) -> Result<(), Unwritten> {
        let (columns, values) = match self {
            Points::Plane(points) => (2, Point::peel_slice(points).as_flattened()),
            Points::Space(points) => (3, Point::peel_slice(points).as_flattened()),
        };
        writer.numbers(Numbers { columns, values })
    }
}

impl Written for Vector {
    fn write_to(&self, writer: &mut Writer) -> Result<(), Unwritten> {
        match self {
            Vector::Plane(point) => writer.list(&point.0),
            Vector::Space(point) => writer.list(&point.0),
        }
    }
}

/// The schema of `D` numbers: an array, not a tuple, which client generators cannot read.
fn coordinates(count: usize, doc: &str) -> RefOr<Schema> {
    let array = ArrayBuilder::new().items(number()).min_items(Some(count)).max_items(Some(count));
    array.description(Some(doc)).into()
}

fn collect_dimensions(components: &mut Components) {
    components
        .push(("Point2".into(), coordinates(2, "x and y, in the unit of the client's choice.")));
    components
        .push(("Point3".into(), coordinates(3, "x, y and z, in the unit of the client's choice.")));
}

/// The schema of a list of 3D points, or vectors; goes with [`Points`], which names the schema of a
/// point.
pub fn space_list() -> ArrayBuilder {
    ArrayBuilder::new().items(Ref::from_schema_name("Point3"))
}

impl Field for Points {}

impl Described for Points {
    fn schema() -> RefOr<Schema> {
        Ref::from_schema_name("Points").into()
    }

    fn collect(components: &mut Components) {
        collect_dimensions(components);
        let list = |name: &str| ArrayBuilder::new().items(Ref::from_schema_name(name));
        let doc = "Points, or vectors, all of one dimension: 2D or 3D.";
        // anyOf: an empty list is both.
        let union = utoipa::openapi::schema::AnyOfBuilder::new()
            .item(list("Point2"))
            .item(list("Point3"))
            .description(Some(doc));
        components.push(("Points".into(), Schema::AnyOf(union.build()).into()));
    }
}

impl Field for Vector {}

impl Described for Vector {
    fn schema() -> RefOr<Schema> {
        Ref::from_schema_name("Vector").into()
    }

    fn collect(components: &mut Components) {
        collect_dimensions(components);
        let union = OneOfBuilder::new()
            .item(Ref::from_schema_name("Point2"))
            .item(Ref::from_schema_name("Point3"));
        components.push(("Vector".into(), union.description(Some("One vector, 2D or 3D.")).into()));
    }
}
