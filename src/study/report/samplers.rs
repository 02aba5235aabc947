//! The section on samplers: errors against samples per pixel.

use super::figures::{Figures, axis, dot, legend};
use super::summary::{MEASURES, Summary};
use super::svg::{Plot, Power, Series};
use crate::scene::settings::Sampler;
use crate::study::ladder::Knob;
use crate::study::run::Study;

/// Errors of each sampler; nothing if none were tried.
pub(super) fn section(study: &Study, summary: &Summary, figures: &mut Figures) -> String {
    let points = summary.of_knob(study, Knob::Sampler);
    if points.is_empty() {
        return String::new();
    }
    let mut html =
        "<h2>Samplers</h2>\n<p>The same errors by how samples are spread over the pixels, against samples per pixel. \
                    Dashed: the ideal N<sup>−0.75</sup>.</p>\n"
            .to_owned();
    html += &legend(Sampler::ALL.into_iter().map(|sampler| sampler.name().to_owned()).enumerate());
    html.push_str("<div class=\"two\">\n");
    let counts = points.iter().map(|point| f64::from(point.settings.samples));
    let from = [counts.clone().fold(f64::INFINITY, f64::min), counts.fold(0.0, f64::max)];
    for measure in &MEASURES {
        let series = Sampler::ALL.into_iter().enumerate().map(|(kind, sampler)| {
            let own = points.iter().filter(|point| point.settings.sampler == sampler);
            let dots = own.filter_map(|point| dot(point, measure, f64::from(point.settings.samples), None));
            Series { kind, name: sampler.name().to_owned(), dots: dots.collect(), joined: true, faint: false }
        });
        let series: Vec<Series> = series.collect();
        let Some(first) = series.iter().find_map(|series| series.dots.first()) else { continue };
        let ideal = measure.ideal.map(|slope| Power {
            class: "ideal",
            slope,
            at_one: first.at[1] * libm::pow(first.at[0], -slope),
            from,
            name: format!("ideal: samples^{slope}"),
        });
        let plot = Plot {
            title: measure.title,
            x: "samples per pixel",
            y: axis(measure),
            series,
            powers: ideal.into_iter().collect(),
            front: Vec::new(),
            floor: (measure.of)(&study.own).filter(|floor| *floor > 0.0),
            least: None,
        };
        let fits = summary.sampler_fits(study, measure).into_iter().map(|(sampler, fit)| match fit {
            Some(fit) => format!("{}: N<sup>{:.2}</sup> over {} points", sampler.name(), fit.by_samples, fit.points),
            None => format!("{}: too few points above the reference's own error for a slope", sampler.name()),
        });
        let caption: Vec<_> = std::iter::once(format!("<b>{}</b>", measure.title)).chain(fits).collect();
        html += &figures.add(format!("samplers_{}", measure.name), &plot, &caption.join(" · "));
    }
    html + "</div>\n"
}
