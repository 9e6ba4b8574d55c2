//! How smoothly two curves meet.

/// The smoothness of a joint, measured or asked for, from least to most. `G` compares shapes, `C` compares derivatives
/// with respect to the parameter; a `C1` joint may well be `G2`, so the order is a convention: the
/// highest class met is named.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Smoothness {
    /// The segments do not meet.
    Discontinuous,
    /// They meet.
    C0,
    /// Their tangents agree.
    G1,
    /// Their first derivatives agree.
    C1,
    /// Their tangents and curvatures agree.
    G2,
    /// Their first and second derivatives agree.
    C2,
}

impl Smoothness {
    /// How many derivatives it compares.
    pub fn order(self) -> usize {
        match self {
            Smoothness::Discontinuous | Smoothness::C0 => 0,
            Smoothness::G1 | Smoothness::C1 => 1,
            Smoothness::G2 | Smoothness::C2 => 2,
        }
    }

    /// Whether it compares shapes, not derivatives.
    pub fn is_geometric(self) -> bool {
        matches!(self, Smoothness::G1 | Smoothness::G2)
    }

    /// The usual name.
    pub fn name(self) -> &'static str {
        match self {
            Smoothness::Discontinuous => "discontinuous",
            Smoothness::C0 => "C0",
            Smoothness::G1 => "G1",
            Smoothness::C1 => "C1",
            Smoothness::G2 => "G2",
            Smoothness::C2 => "C2",
        }
    }
}
