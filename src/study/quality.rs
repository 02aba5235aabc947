//! Presets of accuracy (`--quality`): points on the fronts that studies of the shipped scenes measured.
//!
//! On those measured the ladder of samples *is* the front, once widths are corrected for thinning (DESIGN 3.9) and samples are spread by the
//! `sobol` sampler: nothing else is at once faster and more accurate by more than a tenth (see `fronts.csv`, which `cargo bench --bench
//! fronts` writes). So the presets choose the number of samples, each four times the one before, and switch both on. The correction costs
//! nothing; without, the scene of the paper's rule (`fig5_minimum_width`) has nearly twice the error for the same time. `sobol` suits powers of
//! two: with `stratified`, `fig2_crossings` has 10 to 37 % more error at the same counts, in about the same time. Presets leave all else alone.

use super::ladder::Settings;
use crate::scene::settings::Sampler;

/// A preset.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Quality {
    /// To see where things are.
    Draft,
    /// To judge a look by.
    Preview,
    /// To keep.
    Final,
}

/// A preset's figures on one scene: a row of `fronts.csv`.
#[derive(Clone, Debug, PartialEq)]
struct Figures {
    quality: Quality,
    /// CPU seconds of a million pixels.
    seconds: f64,
    line_coverage: f64,
    flip: f64,
}

impl Quality {
    /// All of them, the fastest first.
    pub const ALL: [Self; 3] = [Self::Draft, Self::Preview, Self::Final];

    /// As on the command line.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::Draft => "draft",
            Self::Preview => "preview",
            Self::Final => "final",
        }
    }

    /// Samples per pixel.
    #[must_use]
    pub const fn samples(self) -> u32 {
        match self {
            Self::Draft => 4,
            Self::Preview => 16,
            Self::Final => 64,
        }
    }

    /// How samples are spread over a pixel.
    #[must_use]
    pub const fn sampler(self) -> Sampler {
        Sampler::Sobol
    }

    /// The settings of a scene with this preset.
    #[must_use]
    pub fn settings(self, own: &Settings) -> Settings {
        Settings { samples: self.samples(), sampler: self.sampler(), width_compensation: true, ..*own }
    }

    /// What was chosen and what it costs, as `tusche explain` shows it. `own` are the scene's own settings.
    #[must_use]
    pub fn explain(self, own: &Settings) -> String {
        let figures = figures();
        let of = |quality: Self, value: fn(&Figures) -> f64| -> Vec<f64> {
            figures.iter().filter(|row| row.quality == quality).map(value).collect()
        };
        let seconds: fn(&Figures) -> f64 = |row| row.seconds;
        let per_draft = of(self, seconds).iter().zip(of(Self::Draft, seconds)).map(|(a, b)| a / b).collect();
        let costs = [
            (self != Self::Draft).then(|| format!("{} times the time of draft", spread(per_draft, 1.0))),
            Some(format!("{} CPU seconds a megapixel", spread(of(self, seconds), 1.0))),
            Some(format!("{} % of the lines' area wrong", spread(of(self, |row| row.line_coverage), 100.0))),
            Some(format!("FLIP {}", spread(of(self, |row| row.flip), 1.0))),
        ];
        let costs: Vec<_> = costs.into_iter().flatten().collect();
        let compensation =
            if own.width_compensation { "" } else { ", width_compensation on, which the scene turns off" };
        format!(
            "{:<16}{}: {} samples per pixel, sampler {}, where the scene says {} and {}{compensation}; all else as in the scene\n\
             {:<16}on the shipped scenes, median (least to greatest): {}\n",
            "quality",
            self.name(),
            self.samples(),
            self.sampler().name(),
            own.samples,
            own.sampler.name(),
            "",
            costs.join("; ")
        )
    }
}

impl std::str::FromStr for Quality {
    type Err = String;

    fn from_str(name: &str) -> Result<Self, String> {
        let found = Self::ALL.into_iter().find(|quality| quality.name() == name);
        found.ok_or_else(|| "it is one of draft, preview, final".to_owned())
    }
}

/// The table that is measured by `cargo bench --bench fronts`.
fn figures() -> Vec<Figures> {
    let mut lines = include_str!("fronts.csv").lines();
    let names: Vec<&str> = lines.next().unwrap_or_default().split(',').collect();
    let row = |line: &str| {
        let cells: Vec<&str> = line.split(',').collect();
        let cell = |name: &str| cells.get(names.iter().position(|known| *known == name)?).copied();
        let number = |name: &str| cell(name)?.parse().ok();
        Some(Figures {
            quality: cell("quality")?.parse().ok()?,
            seconds: number("cpu_seconds_per_megapixel")?,
            line_coverage: number("line_coverage")?,
            flip: number("flip")?,
        })
    };
    lines.filter_map(row).collect()
}

/// The median with the least and the greatest, times a factor, with two digits.
fn spread(mut values: Vec<f64>, factor: f64) -> String {
    values.sort_by(f64::total_cmp);
    let two_digits = |value: f64| {
        let value = value * factor;
        let digits = if value > 0.0 { 1 - libm::floor(libm::log10(value)) as i32 } else { 0 };
        format!("{value:.*}", digits.clamp(0, 6) as usize)
    };
    match values[..] {
        [] => "unknown".to_owned(),
        [least, .., greatest] => {
            format!("{} ({} to {})", two_digits(values[values.len() / 2]), two_digits(least), two_digits(greatest))
        }
        [only] => two_digits(only),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_row_of_the_table_is_read_and_all_presets_lie_on_the_front() {
        let text = include_str!("fronts.csv");
        let rows = text.lines().count() - 1;
        assert!(rows > 0 && rows.is_multiple_of(Quality::ALL.len()));
        assert_eq!(figures().len(), rows);
        let place = text.lines().next().and_then(|names| names.split(',').position(|name| name == "behind_front"));
        for line in text.lines().skip(1) {
            let behind: f64 =
                line.split(',').nth(place.expect("the column is there")).expect("a cell").parse().expect(line);
            assert!(behind <= 1.10, "{line}");
        }
    }

    #[test]
    fn names_and_numbers_are_read_and_written() {
        assert_eq!("final".parse(), Ok(Quality::Final));
        assert!("best".parse::<Quality>().is_err());
        assert_eq!((spread(vec![], 1.0), spread(vec![0.0123], 100.0)), ("unknown".into(), "1.2".into()));
        assert_eq!(spread(vec![30.0, 4.0, 0.05], 1.0), "4.0 (0.050 to 30)");
    }
}
