//! The parameters of the points to fit.

use super::Ends;
use super::data::Data;
use crate::core::argument::Argument;
use crate::core::check::increasing;
use crate::core::domain::Domain;
use crate::core::error::{Error, Locate, both};
use crate::core::fault::Fault;
use crate::core::parameterization::Parameterization;

/// Parameters of a fit. Unlike the knots of an interpolant they may repeat.
impl Parameterization {
    /// The other rules, where a rule is used.
    pub(super) fn others(&self) -> Vec<Self> {
        let rules = [
            Parameterization::ChordLength,
            Parameterization::Centripetal,
            Parameterization::Uniform,
        ];
        match self {
            Parameterization::Given(_) => Vec::new(),
            rule => rules.into_iter().filter(|other| other != rule).collect(),
        }
    }

    /// Parameters on `[0, length]`; a rule fills it from end to end.
    pub(super) fn on_domain<const D: usize>(
        &self,
        data: &Data<D>,
        length: f64,
    ) -> Result<Vec<f64>, Error> {
        if let Parameterization::Given(values) = self {
            let settled =
                check_count(values, data).and_then(|()| on_domain(values, length, data.ends));
            return settled.at(Argument::Parameters).at(Argument::Parameterization);
        }
        let sums = self.positive_sums(data)?;
        let total = sums[sums.len() - 1];
        Ok(sums.iter().map(|sum| sum / total * length).collect())
    }

    /// Parameters that do not decrease and span a domain of positive length.
    pub(super) fn in_order<const D: usize>(&self, data: &Data<D>) -> Result<Vec<f64>, Error> {
        let Parameterization::Given(values) = self else { return self.positive_sums(data) };
        check_count(values, data)
            .and_then(|()| check_order(values))
            .at(Argument::Parameters)
            .at(Argument::Parameterization)?;
        Ok(values.clone())
    }

    /// The running sums of a rule, the last of them positive.
    fn positive_sums<const D: usize>(&self, data: &Data<D>) -> Result<Vec<f64>, Error> {
        let sums = self.sums(&data.points, data.points.len());
        let total = sums[sums.len() - 1];
        if !total.is_finite() {
            return Err(Fault::Overflow.at(Argument::Points));
        }
        if total <= 0.0 {
            let why = format!(
                "all points coincide, so the {} parameterization gives them all the same parameter: no curve is determined",
                self.name()
            );
            return Err(Fault::RankDeficient(why).at(Argument::Points));
        }
        Ok(sums)
    }
}

fn check_count<const D: usize>(values: &[f64], data: &Data<D>) -> Result<(), Error> {
    let expected = data.points.len();
    if values.len() == expected {
        return Ok(());
    }
    Err(Fault::WrongCount {
        what: "parameters",
        count: values.len(),
        expected,
        rule: "one parameter per point",
    }
    .into())
}

/// The parameters meant on `[0, length]`: those outside by rounding only are the ends, and those of
/// end points may be.
fn on_domain(values: &[f64], length: f64, ends: Ends) -> Result<Vec<f64>, Error> {
    let domain = Domain { ends: (0.0, length), name: "parameter", of: "curve" };
    let mut settled = domain.settle_all(values)?;
    let last = settled.len() - 1;
    if ends == Ends::Free {
        return Ok(settled);
    }
    let mut end_at = |i: usize, end: f64, allowed: String| {
        if !domain.is_at(settled[i], end) {
            return Err(
                Fault::OutOfRange { what: "this parameter", value: settled[i], allowed }.at(i)
            );
        }
        settled[i] = end;
        Ok(())
    };
    let start = "0, the start of the domain, as the curve is to start at the first point (ends \"interpolate\")".into();
    let stop = format!(
        "{length:?}, the end of the domain, as the curve is to end at the last point (ends \"interpolate\")"
    );
    both(end_at(0, 0.0, start), end_at(last, length, stop))?;
    Ok(settled)
}

fn check_order(values: &[f64]) -> Result<(), Error> {
    if let Some(i) = values.iter().position(|t| !t.is_finite()) {
        return Err(Fault::NotFinite.at(i));
    }
    increasing("parameters", values, false)?;
    let last = values.len() - 1;
    if !(values[last] - values[0]).is_finite() {
        return Err(Fault::Overflow.at(last));
    }
    if values[last] == values[0] {
        let allowed =
            "greater than the first parameter: the two are the domain of the curve".into();
        return Err(
            Fault::OutOfRange { what: "the last parameter", value: values[last], allowed }.at(last)
        );
    }
    Ok(())
}

/// How many different values a list has.
pub(super) fn distinct(values: impl Iterator<Item = f64>) -> usize {
    let mut values: Vec<f64> = values.collect();
    values.sort_by(f64::total_cmp);
    values.dedup();
    values.len()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::core::context::Context;
    use crate::core::point::Point;

    fn data(ends: Ends) -> Data<1> {
        Data::new(
            &Context::default(),
            vec![Point([0.0]), Point([1.0]), Point([1.0]), Point([4.0])],
            None,
            ends,
        )
        .unwrap()
    }

    #[test]
    fn rules_fill_the_domain_and_allow_repeated_points() {
        assert_eq!(
            Parameterization::ChordLength.on_domain(&data(Ends::Free), 0.5).unwrap(),
            [0.0, 0.125, 0.125, 0.5]
        );
        let awkward = Parameterization::Uniform.on_domain(&data(Ends::Free), 0.1).unwrap();
        assert_eq!(awkward[3], 0.1, "the last parameter is the end of the domain");
    }

    #[test]
    fn given_values_are_held_to_the_domain_and_the_ends() {
        let place = |values: [f64; 4], ends| {
            Parameterization::Given(values.to_vec())
                .on_domain(&data(ends), 1.0)
                .unwrap_err()
                .place
                .to_string()
        };
        assert_eq!(place([0.0, 0.5, 1.5, 1.0], Ends::Free), "/parameterization/parameters/2");
        assert_eq!(place([0.0, f64::NAN, 0.5, 1.0], Ends::Free), "/parameterization/parameters/1");
        assert_eq!(
            place([0.1, 0.2, 0.3, 1.0], Ends::Interpolate),
            "/parameterization/parameters/0"
        );
        assert_eq!(
            place([0.0, 0.2, 0.3, 0.9], Ends::Interpolate),
            "/parameterization/parameters/3"
        );
        assert!(
            Parameterization::Given(vec![0.9, 0.2, 0.2, 0.1])
                .on_domain(&data(Ends::Free), 1.0)
                .is_ok()
        );
    }

    #[test]
    fn a_tolerance_fit_takes_parameters_in_order() {
        let place = |values: [f64; 4]| {
            Parameterization::Given(values.to_vec())
                .in_order(&data(Ends::Free))
                .unwrap_err()
                .place
                .to_string()
        };
        assert_eq!(place([3.0, 4.0, 3.5, 5.0]), "/parameterization/parameters/2");
        assert_eq!(place([3.0, 3.0, 3.0, 3.0]), "/parameterization/parameters/3");
        assert_eq!(
            Parameterization::Given(vec![-3.0, 4.0, 4.0, 5.0]).in_order(&data(Ends::Free)).unwrap(),
            [-3.0, 4.0, 4.0, 5.0]
        );
    }

    #[test]
    fn coinciding_points_determine_nothing() {
        let data = Data::new(&Context::default(), vec![Point([2.0]); 5], None, Ends::Free).unwrap();
        assert_eq!(
            Parameterization::Centripetal.on_domain(&data, 1.0).unwrap_err().place.to_string(),
            "/points"
        );
        assert!(Parameterization::Uniform.on_domain(&data, 1.0).is_ok());
    }
}
