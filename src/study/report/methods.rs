//! The section on line methods: what each comes to in the same time.

use std::fmt::Write as _;

use super::figures::{Figures, axis, dot, legend};
use super::summary::{CROSSINGS, MEASURES, Measure, Summary};
use super::svg::{Plot, Series, number};
use crate::study::ladder::{METHODS, method_name};
use crate::study::run::Study;

/// What is compared: the lines' coverage everywhere, and where lines meet.
pub(super) const COMPARED: [Measure; 2] = [MEASURES[0], CROSSINGS];

/// Plots and a table; nothing if no other method was measured.
pub(super) fn section(study: &Study, summary: &Summary, figures: &mut Figures) -> String {
    if METHODS[1..].iter().all(|method| summary.of_method(study, *method).is_empty()) {
        return String::new();
    }
    let mut html = "<h2>Line methods in equal time</h2>\n<p>Each method draws lines from the same samples: <i>exact</i> as Tusche does, \
                    <i>choudhury</i> (Choudhury and Parker 2009) and <i>bauer</i> (Bauer 2017) with one style for all lines, <i>path</i> \
                    (West 2021) by 16 random neighbours, for which that method would trace 16 more rays. What they differ by is shown where lines \
                    are, and where they meet: crossings, junctions, corners, lines side by side.</p>\n"
        .to_owned();
    html += &legend(METHODS.into_iter().map(|method| method_name(method).to_owned()).enumerate());
    html.push_str("<div class=\"two\">\n");
    for measure in &COMPARED {
        let plot = plot(study, summary, measure);
        if plot.series.iter().any(|series| !series.dots.is_empty()) {
            let caption = format!("<b>{}</b>, by samples per pixel", measure.title);
            html += &figures.add(format!("methods_{}", measure.name), &plot, &caption);
        }
    }
    html + "</div>\n" + table(study, summary).as_str()
}

fn plot<'a>(study: &Study, summary: &Summary, measure: &'a Measure) -> Plot<'a> {
    let series = METHODS.into_iter().enumerate().map(|(kind, method)| {
        let points = summary.of_method(study, method).into_iter();
        let dots =
            points.filter_map(|point| dot(point, measure, point.cpu.median, Some(point.settings.samples.to_string())));
        Series { kind, name: method_name(method).to_owned(), dots: dots.collect(), joined: true, faint: false }
    });
    Plot {
        title: measure.title,
        x: "CPU seconds",
        y: axis(measure),
        series: series.collect(),
        powers: Vec::new(),
        front: Vec::new(),
        floor: (measure.of)(&study.own).filter(|floor| *floor > 0.0),
        least: None,
    }
}

fn table(study: &Study, summary: &Summary) -> String {
    let times = summary.equal_times(study, &COMPARED);
    if times.is_empty() {
        return String::new();
    }
    let mut html = "<p>Errors in the time that <i>exact</i> takes with a number of samples, read off the lines between the dots; a dash where a \
                    method's dots do not reach there.</p>\n<div class=\"wide\"><table>\n<thead><tr><th colspan=\"2\">exact</th>"
        .to_owned();
    for measure in &COMPARED {
        let _ = write!(html, "<th colspan=\"{}\">{}</th>", METHODS.len(), measure.title);
    }
    html.push_str("</tr>\n<tr><th>samples</th><th>CPU, s</th>");
    for method in COMPARED.iter().flat_map(|_| METHODS) {
        let _ = write!(html, "<th>{}</th>", method_name(method));
    }
    html.push_str("</tr></thead>\n<tbody>\n");
    for time in times {
        let _ = write!(html, "<tr><td>{}</td><td>{}</td>", time.samples, number(time.seconds));
        for error in time.errors.iter().flatten() {
            let _ = write!(
                html,
                "<td>{}</td>",
                error.map_or_else(|| "–".to_owned(), |error| format!("{} %", number(100.0 * error)))
            );
        }
        html.push_str("</tr>\n");
    }
    html + "</tbody></table></div>\n"
}
