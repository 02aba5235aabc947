//! What all sections with plots share. A plot goes into the page and, with its own legend and colours, into a file of its own.

use std::fmt::Write as _;

use super::summary::{Mean, Measure, Point, Spread};
use super::svg::{Dot, Plot, number, shape};

/// The plots of a page, as files.
#[derive(Default)]
pub(super) struct Figures {
    /// Name without ending, and text.
    pub files: Vec<(String, String)>,
}

impl Figures {
    /// A plot as a figure of the page. Its caption is HTML.
    pub(super) fn add(&mut self, name: String, plot: &Plot<'_>, caption: &str) -> String {
        self.files.push((name, plot.document()));
        format!("<figure>{}<figcaption>{caption}</figcaption></figure>\n", plot.svg())
    }
}

/// A point's error at a place on the other axis. Logarithms must have something to show.
pub(super) fn dot(point: &Point, measure: &Measure, x: f64, label: Option<String>) -> Option<Dot> {
    let values: Vec<f64> = point.errors.iter().filter_map(measure.of).collect();
    let mean = Mean::of(&values)?.mean;
    let spread = Spread::of(values);
    let name = format!("{}: {} s, {}", point.name, number(point.cpu.median), number(mean));
    (x > 0.0 && mean > 0.0).then_some(Dot { at: [x, mean], reach: [spread.least, spread.greatest], name, label })
}

/// A legend of kinds.
pub(super) fn legend(kinds: impl IntoIterator<Item = (usize, String)>) -> String {
    let mut html = "<ul class=\"legend\">".to_owned();
    for (kind, name) in kinds {
        let path = shape(kind);
        let _ = write!(
            html,
            "<li><svg viewBox=\"-8 -6 16 12\"><path class=\"dot k{kind}\" d=\"{path}\"/></svg>{name}</li>"
        );
    }
    html + "</ul>\n"
}

/// The axis of a measure.
pub(super) fn axis(measure: &Measure) -> String {
    format!("{} ({})", measure.title, measure.unit)
}
