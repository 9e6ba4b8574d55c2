//! Values of the plane or of space.

/// A value of two dimensions or of three: curves, points, vectors, lists of them.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Dimensioned<P, S> {
    /// 2D.
    Plane(P),
    /// 3D.
    Space(S),
}
