//! Points in the order of their parameters.

use super::chord::Chord;
use super::data::Data;
use crate::core::point::Point;

/// Points with parameters that do not decrease, and the different ones among these.
pub(super) struct Ordered<'a, const D: usize> {
    pub(super) data: &'a Data<D>,
    pub(super) parameters: &'a [f64],
    /// The different parameters.
    pub(super) places: Vec<f64>,
    /// For each point, which place it has.
    pub(super) place_of: Vec<usize>,
    /// For each place, where a curve is to be that is as close as can be to its points: their
    /// weighted mean, or an end point to be interpolated.
    pub(super) centres: Vec<Point<D>>,
}

impl<'a, const D: usize> Ordered<'a, D> {
    /// O(points).
    pub(super) fn new(data: &'a Data<D>, parameters: &'a [f64]) -> Self {
        let mut places = parameters.to_vec();
        places.dedup();
        let mut place = 0;
        let advance = |&t: &f64| {
            place += usize::from(t > places[place]);
            place
        };
        let place_of: Vec<usize> = parameters.iter().map(advance).collect();
        let centres = centres(data, &place_of, places.len());
        Ordered { data, parameters, places, place_of, centres }
    }

    /// How many pairs of neighbouring places there are.
    pub(super) fn stretches(&self) -> usize {
        self.places.len() - 1
    }

    /// The straight way from one place to the next.
    pub(super) fn chord(&self, stretch: usize) -> Chord<D> {
        Chord { start: self.centres[stretch], end: self.centres[stretch + 1] }
    }

    /// The largest distance at a place.
    pub(super) fn distance_at(&self, place: usize, distances: &[f64]) -> f64 {
        let first = self.place_of.partition_point(|&p| p < place);
        let at_place =
            self.place_of[first..].iter().take_while(|&&p| p == place).zip(&distances[first..]);
        at_place.fold(0.0, |largest, (_, &distance)| distance.max(largest))
    }
}

fn centres<const D: usize>(data: &Data<D>, place_of: &[usize], places: usize) -> Vec<Point<D>> {
    let mut centres = Vec::with_capacity(places);
    let mut total = 0.0;
    for (i, (&point, &place)) in data.points.iter().zip(place_of).enumerate() {
        let weight = data.weight(i);
        if place == centres.len() {
            total = weight;
            centres.push(point);
        } else {
            total += weight;
            centres[place] = centres[place].lerp(point, weight / total);
        }
    }
    if let Some((start, end)) = data.fixed_ends() {
        (centres[0], centres[places - 1]) = (start, end);
    }
    centres
}
