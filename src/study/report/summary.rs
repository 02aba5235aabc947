//! What the runs of a study come to: medians, means, slopes and the front of what is worth its time.

use serde::Serialize;

use crate::line::Method;
use crate::scene::settings::Sampler;
use crate::study::ladder::{Knob, METHODS, Settings};
use crate::study::measure::Errors;
use crate::study::run::Study;
use crate::study::table::Run;

/// An error that plots show.
#[derive(Clone, Copy, Debug)]
pub struct Measure {
    /// As in tables.
    pub name: &'static str,
    /// As people call it.
    pub title: &'static str,
    /// What the numbers mean.
    pub unit: &'static str,
    /// The power of the samples by which stratified sampling promises it to fall at edges.
    pub ideal: Option<f64>,
    /// Its value among all errors.
    pub of: Error,
}

/// One of the errors of a picture, if it has one.
pub type Error = fn(&Errors) -> Option<f64>;

/// The coverage error where lines meet: not of all pictures, and so none of [`MEASURES`].
pub const CROSSINGS: Measure = Measure {
    name: "line_crossings",
    title: "Coverage error where lines meet",
    unit: "share of their area",
    ideal: Some(-0.75),
    of: |errors| errors.crossings,
};

/// The errors of the whole picture, the most telling about lines first.
pub const MEASURES: [Measure; 4] = [
    Measure {
        name: "line_coverage",
        title: "Line coverage error",
        unit: "share of the lines' area",
        ideal: Some(-0.75),
        of: |errors| errors.coverage,
    },
    Measure {
        name: "line_position",
        title: "Line position error",
        unit: "pixels",
        ideal: Some(-0.75),
        of: |errors| errors.position,
    },
    Measure { name: "flip", title: "FLIP", unit: "mean, 0 to 1", ideal: None, of: |errors| Some(errors.flip.all) },
    Measure {
        name: "rmse",
        title: "RMSE",
        unit: "linear colours, 0 to 1",
        ideal: Some(-0.75),
        of: |errors| Some(errors.rmse.all),
    },
];

/// The middle of several numbers, and how far they reach.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct Spread {
    /// The median.
    pub median: f64,
    /// The least.
    pub least: f64,
    /// The greatest.
    pub greatest: f64,
}

impl Spread {
    /// Of some numbers; all 0 of none.
    #[must_use]
    pub fn of(mut values: Vec<f64>) -> Self {
        values.sort_by(f64::total_cmp);
        let Some((least, greatest)) = values.first().copied().zip(values.last().copied()) else {
            return Self::default();
        };
        let middle = values.len() / 2;
        let median =
            if values.len().is_multiple_of(2) { (values[middle - 1] + values[middle]) / 2.0 } else { values[middle] };
        Self { median, least, greatest }
    }
}

/// The mean of several numbers and their standard deviation.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct Mean {
    /// The mean.
    pub mean: f64,
    /// The standard deviation; 0 of a single number.
    pub deviation: f64,
}

impl Mean {
    /// Of some numbers; `None` of none.
    #[must_use]
    pub fn of(values: &[f64]) -> Option<Self> {
        let count = values.len() as f64;
        let mean = values.iter().sum::<f64>() / count;
        let squares: f64 = values.iter().map(|value| (value - mean) * (value - mean)).sum();
        (!values.is_empty()).then(|| Self { mean, deviation: (squares / (count - 1.0).max(1.0)).sqrt() })
    }
}

/// A point that was measured at least once.
#[derive(Clone, Debug)]
pub struct Point {
    /// Its place in the ladder.
    pub index: usize,
    /// Its name.
    pub name: String,
    /// Its settings.
    pub settings: Settings,
    /// How often it was measured.
    pub runs: usize,
    /// Wall seconds.
    pub wall: Spread,
    /// CPU seconds of tracing, shading, lines and film.
    pub cpu: Spread,
    /// Median CPU seconds of build, trace, shade, lines, film.
    pub stages: [f64; 5],
    /// Bytes per sample.
    pub bytes_per_sample: f64,
    /// Most memory that the process held, in bytes, where the system can tell.
    pub peak: Option<f64>,
    /// The errors of every run.
    pub errors: Vec<Errors>,
}

/// What [`Point::stages`] are.
pub const STAGES: [&str; 5] = ["build", "trace", "shade", "lines", "film"];

impl Point {
    fn new(index: usize, study: &Study) -> Option<Self> {
        let runs = &study.runs[index];
        let all = |value: fn(&Run) -> f64| Spread::of(runs.iter().map(value).collect());
        let stages: [fn(&Run) -> f64; 5] = [
            |run| run.build_seconds,
            |run| run.trace_seconds,
            |run| run.shade_seconds,
            |run| run.lines_seconds,
            |run| run.film_seconds,
        ];
        (!runs.is_empty()).then(|| Self {
            index,
            name: study.ladder.name(index),
            settings: study.ladder.points[index],
            runs: runs.len(),
            wall: all(|run| run.wall_seconds),
            cpu: all(Run::cpu_seconds),
            stages: stages.map(|stage| all(stage).median),
            bytes_per_sample: all(|run| run.bytes_per_sample).median,
            peak: Some(Spread::of(runs.iter().filter_map(|run| Some(run.peak_rss_bytes? as f64)).collect()).median)
                .filter(|peak| *peak > 0.0),
            errors: runs.iter().map(Run::errors).collect(),
        })
    }

    /// An error over all runs.
    #[must_use]
    pub fn error(&self, of: impl Fn(&Errors) -> Option<f64>) -> Option<Mean> {
        Mean::of(&self.errors.iter().filter_map(of).collect::<Vec<_>>())
    }
}

/// How an error falls with samples: error = `at_one` · N^`slope`, and likewise with CPU seconds.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Fit {
    /// The exponent by samples.
    pub by_samples: f64,
    /// The exponent by CPU seconds.
    pub by_seconds: f64,
    /// The error at one second, of the line through the points.
    pub at_one_second: f64,
    /// How many points it goes through.
    pub points: usize,
}

/// Errors of all methods in one time.
#[derive(Clone, Debug, PartialEq)]
pub struct EqualTime {
    /// With how many samples the exact search takes it.
    pub samples: u32,
    /// CPU seconds.
    pub seconds: f64,
    /// By measure, and by method in the order of [`METHODS`]; `None` where a ladder does not reach there.
    pub errors: Vec<[Option<f64>; METHODS.len()]>,
}

/// What a study comes to.
#[derive(Clone, Debug)]
pub struct Summary {
    /// Points that were measured.
    pub points: Vec<Point>,
}

impl Summary {
    /// Of a study.
    #[must_use]
    pub fn new(study: &Study) -> Self {
        Self { points: (0..study.ladder.points.len()).filter_map(|index| Point::new(index, study)).collect() }
    }

    /// A point by its place in the ladder.
    #[must_use]
    pub fn point(&self, index: usize) -> Option<&Point> {
        self.points.iter().find(|point| point.index == index)
    }

    /// The points of a knob, in order.
    #[must_use]
    pub fn of_knob(&self, study: &Study, knob: Knob) -> Vec<&Point> {
        let rungs = study.ladder.knobs.iter().filter(|rungs| rungs.knob == knob).flat_map(|rungs| &rungs.points);
        rungs.filter_map(|index| self.point(*index)).collect()
    }

    /// How an error falls along a ladder of samples. Points whose error is not well above the reference's own tell nothing of
    /// it, and there must be three others.
    #[must_use]
    pub fn fit(&self, study: &Study, knob: Knob, measure: &Measure) -> Option<Fit> {
        fitted(&self.of_knob(study, knob), study, measure)
    }

    /// The same for each sampler, along its part of their ladder.
    #[must_use]
    pub fn sampler_fits(&self, study: &Study, measure: &Measure) -> Vec<(Sampler, Option<Fit>)> {
        let points = self.of_knob(study, Knob::Sampler);
        let of = |sampler| points.iter().copied().filter(|point| point.settings.sampler == sampler).collect::<Vec<_>>();
        Sampler::ALL.into_iter().map(|sampler| (sampler, fitted(&of(sampler), study, measure))).collect()
    }

    /// The points of a method, by rising time: those of its ladder, and of the ladder of samples, which is that of the exact search, too.
    #[must_use]
    pub fn of_method(&self, study: &Study, method: Method) -> Vec<&Point> {
        let mut points = self.of_knob(study, Knob::Method);
        points.extend(self.of_knob(study, Knob::Samples));
        points.retain(|point| point.settings.method == method);
        points.sort_by_key(|point| point.index);
        points.dedup_by_key(|point| point.index);
        points.sort_by(|a, b| a.cpu.median.total_cmp(&b.cpu.median));
        points
    }

    /// What each method comes to in the time that the exact search takes with each of its rates.
    #[must_use]
    pub fn equal_times(&self, study: &Study, measures: &[Measure]) -> Vec<EqualTime> {
        let at = |point: &Point| {
            let seconds = point.cpu.median;
            let error = |measure: &Measure| METHODS.map(|method| self.at_time(study, method, measure.of, seconds));
            EqualTime { samples: point.settings.samples, seconds, errors: measures.iter().map(error).collect() }
        };
        let times = self.of_method(study, Method::Exact).into_iter().map(at);
        // Where the exact search stands alone there is nothing to compare.
        times.filter(|time| time.errors.iter().any(|errors| errors[1..].iter().any(Option::is_some))).collect()
    }

    /// The error of a method in a number of CPU seconds: between the two points of its ladder that take less and more, logarithms are
    /// taken for straight. `None` if the ladder does not reach there.
    #[must_use]
    pub fn at_time(&self, study: &Study, method: Method, of: Error, seconds: f64) -> Option<f64> {
        let points = self.of_method(study, method);
        let known = points.iter().filter_map(|point| Some([point.cpu.median, point.error(of)?.mean]));
        between(&known.filter(|[seconds, error]| *seconds > 0.0 && *error > 0.0).collect::<Vec<_>>(), seconds)
    }

    /// How far a point lies behind the front: the largest factor by which another point is both faster and nearer to the
    /// reference. At most 1 if it is on the front; infinite if it was not measured.
    #[must_use]
    pub fn behind_front(&self, index: usize, measure: &Measure) -> f64 {
        if self.point(index).is_none_or(|point| point.error(measure.of).is_none()) {
            return f64::INFINITY;
        }
        self.rival(index, measure).map_or(0.0, |(_, factor)| factor)
    }

    /// The point that beats another by the largest factor in both time and error, and the factor, which is below 1 if none does.
    #[must_use]
    pub fn rival(&self, index: usize, measure: &Measure) -> Option<(&Point, f64)> {
        let figures = |point: &Point| Some([point.cpu.median, point.error(measure.of)?.mean]);
        let [seconds, error] = self.point(index).and_then(figures)?;
        let others = self.points.iter().filter(|point| point.index != index);
        let factors = others.filter_map(|other| {
            let found = figures(other)?;
            Some((other, (seconds / found[0]).min(error / found[1])))
        });
        factors.max_by(|a, b| a.1.total_cmp(&b.1))
    }

    /// The points that no other beats in both time and error, by rising time.
    #[must_use]
    pub fn front(&self, measure: &Measure) -> Vec<&Point> {
        let error = |point: &Point| point.error(measure.of).map_or(f64::INFINITY, |error| error.mean);
        let mut points: Vec<&Point> = self.points.iter().filter(|point| error(point).is_finite()).collect();
        points.sort_by(|a, b| a.cpu.median.total_cmp(&b.cpu.median).then(error(a).total_cmp(&error(b))));
        let mut least = f64::INFINITY;
        points.retain(|point| {
            let better = error(point) < least;
            least = least.min(error(point));
            better
        });
        points
    }
}

/// The power law between the two of some rising points that lie around x.
fn between(points: &[[f64; 2]], x: f64) -> Option<f64> {
    let pair = points.windows(2).find(|pair| (pair[0][0]..=pair[1][0]).contains(&x))?;
    let [[x0, y0], [x1, y1]] = [pair[0], pair[1]].map(|point| point.map(libm::log));
    let share = if x1 > x0 { (libm::log(x) - x0) / (x1 - x0) } else { 0.0 };
    Some(libm::exp(y0 + share * (y1 - y0)))
}

/// How an error falls over points of rising samples.
fn fitted(points: &[&Point], study: &Study, measure: &Measure) -> Option<Fit> {
    let floor = (measure.of)(&study.own).unwrap_or(0.0);
    let usable: Vec<[f64; 3]> = points
        .iter()
        .filter_map(|point| {
            let error = point.error(measure.of)?.mean;
            let seconds = point.cpu.median;
            let tells = error > 3.0 * floor && error > 0.0 && seconds > 0.0;
            tells.then(|| [libm::log(f64::from(point.settings.samples)), libm::log(seconds), libm::log(error)])
        })
        .collect();
    if usable.len() < 3 {
        return None;
    }
    let line = |axis: usize| {
        let count = usable.len() as f64;
        let [x, y] = [axis, 2].map(|axis| usable.iter().map(|point| point[axis]).sum::<f64>() / count);
        let product: f64 = usable.iter().map(|point| (point[axis] - x) * (point[2] - y)).sum();
        let slope = product / usable.iter().map(|point| (point[axis] - x) * (point[axis] - x)).sum::<f64>();
        (slope, y - slope * x)
    };
    let ((by_samples, _), (by_seconds, at)) = (line(0), line(1));
    Some(Fit { by_samples, by_seconds, at_one_second: libm::exp(at), points: usable.len() })
        .filter(|fit| fit.by_samples.is_finite() && fit.by_seconds.is_finite())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn medians_means_and_spreads_are_those_of_arithmetic() {
        let spread = Spread::of(vec![3.0, 1.0, 2.0, 10.0]);
        assert_eq!(spread, Spread { median: 2.5, least: 1.0, greatest: 10.0 });
        assert_eq!(Spread::of(vec![]), Spread::default());
        assert_eq!(Mean::of(&[1.0, 3.0]), Some(Mean { mean: 2.0, deviation: 2.0_f64.sqrt() }));
        let points = [[1.0, 8.0], [4.0, 2.0], [16.0, 1.0]];
        let found = [0.5, 1.0, 2.0, 4.0, 8.0, 17.0].map(|x| between(&points, x));
        for (found, expected) in
            found.into_iter().zip([None, Some(8.0), Some(4.0), Some(2.0), Some(2.0_f64.sqrt()), None])
        {
            assert_eq!(found.is_some(), expected.is_some());
            assert!((found.unwrap_or_default() - expected.unwrap_or_default()).abs() < 1e-12, "{found:?}");
        }
        assert_eq!((Mean::of(&[]), Mean::of(&[5.0])), (None, Some(Mean { mean: 5.0, deviation: 0.0 })));
    }
}
