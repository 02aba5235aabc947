//! The page: plots, pictures and tables in one file that needs neither scripts nor a network.

use std::fmt::Write as _;

use super::figures::{Figures, axis, dot, legend};
use super::summary::{CROSSINGS, Fit, MEASURES, Mean, Measure, Point, STAGES, Spread, Summary};
use super::svg::{Plot, Power, Series, bars, escape, number};
use super::{crops, methods, samplers, widths};
use crate::study::folder::Folder;
use crate::study::ladder::Knob;
use crate::study::measure::Errors;
use crate::study::run::Study;

/// The page, and its plots as files of their own.
pub(super) fn page(study: &Study, summary: &Summary, folder: &Folder) -> (String, Figures) {
    let mut figures = Figures::default();
    let title = escape(&study.title);
    let mut html = format!(
        "<!DOCTYPE html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\">\n\
         <meta name=\"viewport\" content=\"width=device-width, initial-scale=1\">\n\
         <title>{title}: what accuracy costs</title>\n<style>\n{}</style>\n</head>\n<body>\n",
        include_str!("style.css")
    );
    let parts = [
        head(study, summary),
        plots(study, summary, &mut figures),
        methods::section(study, summary, &mut figures),
        samplers::section(study, summary, &mut figures),
        widths::section(&study.widths, &mut figures),
        presets(study, summary),
        costs(study, summary),
        pictures(study, summary, folder),
        tables(study, summary),
    ];
    html.extend(parts);
    (html + "</body>\n</html>\n", figures)
}

fn head(study: &Study, summary: &Summary) -> String {
    let [width, height] = study.size;
    let runs: usize = summary.points.iter().map(|point| point.runs).sum();
    let threads = study.runs.iter().flatten().next().map_or(0, |run| run.threads);
    let mut html = format!(
        "<h1>{}: what accuracy costs</h1>\n<p class=\"soft\">{width} × {height} pixels, {} settings, {runs} pictures, \
         {threads} threads, Tusche {}</p>\n",
        escape(&study.title),
        summary.points.len(),
        env!("CARGO_PKG_VERSION"),
    );
    if study.left_out > 0 {
        let _ = writeln!(html, "<p>{} pictures did not fit into the budget of time.</p>", study.left_out);
    }
    if !study.complete {
        html.push_str("<p>The study was stopped before all was measured.</p>\n");
    }
    let own = |measure: &Measure| Some(format!("{} {}", measure.title, number((measure.of)(&study.own)?)));
    let own: Vec<_> = MEASURES.iter().filter_map(own).collect();
    let _ = writeln!(
        html,
        "<p>Every picture is compared with a reference of {} samples per pixel that has other sample patterns and no approximation \
         but the filter. Its own errors, estimated from its two halves: {}.{}</p>",
        study.reference,
        escape(&own.join(", ")),
        if study.truth {
            " Where lines are and how much of each pixel they cover is known by geometry: the scene declares it in <i>[truth]</i>. \
             That has no error of its own."
        } else {
            ""
        }
    );
    let _ = writeln!(html, "<h2>What was tried</h2>\n<pre>{}</pre>", escape(&study.ladder.to_string()));
    html
}

fn kind(knob: Knob) -> usize {
    Knob::ALL.iter().position(|known| *known == knob).unwrap_or_default()
}

fn is_ladder_of_samples(knob: Knob) -> bool {
    matches!(knob, Knob::Samples | Knob::IdealSamples)
}

fn plots(study: &Study, summary: &Summary, figures: &mut Figures) -> String {
    let mut html = "<h2>Error against time</h2>\n<p>CPU seconds of tracing, shading, lines and film, summed over threads (median of the \
                    repeats). Whiskers: least and greatest error. Dots: the front of what nothing beats in both. \
                    Solid: the fitted power of the samples; dashed: the ideal N<sup>−0.75</sup> of stratified sampling at edges (FLIP \
                    takes roots of differences, so it has none). \
                    Where the samples' curve levels off, what is left is not noise but an approximation that the scene \
                    makes; <i>ideal_samples</i> has none.</p>\n"
        .to_owned();
    html += &legend(study.ladder.knobs.iter().map(|rungs| (kind(rungs.knob), rungs.knob.name().to_owned())));
    html.push_str("<div class=\"two\">\n");
    for measure in &MEASURES {
        let fit = summary.fit(study, Knob::Samples, measure);
        let plot = plot(study, summary, measure, fit);
        if plot.series.iter().all(|series| series.dots.is_empty()) {
            continue;
        }
        let mut caption = vec![format!("<b>{}</b>", measure.title)];
        let mut tell = |name: &str, fit: Option<Fit>| match fit {
            Some(fit) => caption.push(format!(
                "{name}: N<sup>{:.2}</sup>, seconds<sup>{:.2}</sup> over {} points",
                fit.by_samples, fit.by_seconds, fit.points
            )),
            None => caption.push(format!("{name}: too few points above the reference's own error for a slope")),
        };
        tell("samples", fit);
        if study.ladder.knobs.iter().any(|rungs| rungs.knob == Knob::IdealSamples) {
            tell("ideal samples", summary.fit(study, Knob::IdealSamples, measure));
        }
        html += &figures.add(measure.name.to_owned(), &plot, &caption.join(" · "));
    }
    html + "</div>\n"
}

fn plot<'a>(study: &Study, summary: &Summary, measure: &'a Measure, fit: Option<Fit>) -> Plot<'a> {
    let series: Vec<Series> = study
        .ladder
        .knobs
        .iter()
        .map(|rungs| Series {
            kind: kind(rungs.knob),
            name: rungs.knob.name().to_owned(),
            // The scene itself is on every ladder; it is drawn once.
            dots: summary
                .of_knob(study, rungs.knob)
                .into_iter()
                .filter(|point| point.index > 0 || rungs.knob == Knob::Samples)
                .filter_map(|point| {
                    let label = (rungs.knob == Knob::Samples).then(|| point.settings.value(rungs.knob));
                    dot(point, measure, point.cpu.median, label)
                })
                .collect(),
            joined: is_ladder_of_samples(rungs.knob),
            faint: false,
        })
        .rev()
        .collect();
    let seconds: Vec<f64> = summary.of_knob(study, Knob::Samples).iter().map(|point| point.cpu.median).collect();
    let ends = Spread::of(seconds);
    let mut powers = Vec::new();
    if let Some(fit) = fit.filter(|_| ends.least > 0.0) {
        let from = [ends.least, ends.greatest];
        let (slope, at_one) = (fit.by_seconds, fit.at_one_second);
        powers.push(Power { class: "fit", slope, at_one, from, name: format!("fitted: seconds^{slope:.2}") });
        // The ideal begins where the fit does.
        powers.extend(measure.ideal.map(|ideal| Power {
            class: "ideal",
            slope: ideal,
            at_one: at_one * libm::pow(ends.least, slope - ideal),
            from,
            name: format!("ideal: seconds^{ideal}"),
        }));
    }
    let corner = |point: &&Point| Some([point.cpu.median, point.error(measure.of)?.mean]);
    Plot {
        title: measure.title,
        x: "CPU seconds",
        y: axis(measure),
        series,
        powers,
        front: summary.front(measure).iter().filter_map(corner).filter(|[_, error]| *error > 0.0).collect(),
        floor: (measure.of)(&study.own).filter(|floor| *floor > 0.0),
        least: None,
    }
}

/// Where the presets of `--quality` lie.
fn presets(study: &Study, summary: &Summary) -> String {
    let known = |index: usize| summary.points.iter().find(|point| point.index == index);
    let rows = study.ladder.presets.iter().filter_map(|(quality, index)| {
        let point = known(*index)?;
        let mut cells = vec![quality.name().to_owned(), point.settings.samples.to_string(), number(point.cpu.median)];
        cells.extend(MEASURES.iter().map(|measure| {
            let behind = summary.behind_front(*index, measure);
            let error = point.error(measure.of).map_or_else(|| "–".to_owned(), |error| number(error.mean));
            format!("{error} <span class=\"soft\">({behind:.2})</span>")
        }));
        Some(format!("<tr><td>{}</td></tr>", cells.join("</td><td>")))
    });
    let rows: Vec<_> = rows.collect();
    if rows.is_empty() {
        return String::new();
    }
    format!(
        "<h2>Presets</h2>\n<p>What <i>--quality</i> chooses. In brackets: by which factor another point is both faster and nearer to the \
         reference; up to 1 lies on the front.</p>\n<div class=\"wide\"><table>\n<thead><tr><th>preset</th><th>samples</th><th>CPU, s</th>\
         <th>coverage</th><th>position, px</th><th>FLIP</th><th>RMSE</th></tr></thead>\n<tbody>\n{}\n</tbody></table></div>\n",
        rows.join("\n")
    )
}

fn costs(study: &Study, summary: &Summary) -> String {
    let samples = summary.of_knob(study, Knob::Samples);
    let is_other = |point: &&Point| point.index == 0 || point.settings.samples == study.ladder.points[0].samples;
    let others = summary.points.iter().filter(is_other).collect();
    let ladders: [(Vec<&Point>, _); 2] =
        [(samples, "by samples"), (others, "by everything else, at the scene's samples")];
    let figures = |caption: &str, unit: &str, parts: &dyn Fn(&Point) -> Option<Vec<f64>>| {
        let mut html = String::new();
        for (points, of) in &ladders {
            let rows: Vec<_> = points.iter().filter_map(|point| Some((point.name.clone(), parts(point)?))).collect();
            if rows.len() > 1 {
                let plot = bars(caption, &rows, unit);
                let _ = writeln!(html, "<figure>{plot}<figcaption>{caption}, {of}</figcaption></figure>");
            }
        }
        html
    };
    let stages: String = STAGES
        .iter()
        .enumerate()
        .map(|(i, stage)| {
            let rect = format!("<rect class=\"s{i}\" width=\"12\" height=\"12\"/>");
            format!("<li><svg viewBox=\"0 0 16 12\">{rect}</svg>{stage}</li>")
        })
        .collect();
    format!(
        "<h2>Cost by stage</h2>\n<p><i>Build</i> makes the hierarchies over all triangles. It takes the same for every picture, and the seconds of all \
         other plots are without it.</p>\n<ul class=\"legend\">{stages}</ul>\n<div class=\"two\">\n{}</div>\n\
         <h2>Memory</h2>\n<div class=\"two\">\n{}{}</div>\n",
        figures("CPU seconds", "s", &|point| Some(point.stages.to_vec())),
        figures(
            "Bytes that a sample takes while its tile is in memory, with what the line search prepares",
            "B",
            &|point| { Some(vec![0.0, point.bytes_per_sample]) }
        ),
        figures("Most memory that the process held, scene and reference included", "MiB", &|point| {
            Some(vec![0.0, 0.0, point.peak? / f64::from(1 << 20)])
        }),
    )
}

fn pictures(study: &Study, summary: &Summary, folder: &Folder) -> String {
    let Some(reference) = crops::read(&folder.picture("reference")) else { return String::new() };
    let worst = summary.points.iter().min_by_key(|point| point.settings.samples);
    let worst = worst.and_then(|point| crops::read(&folder.picture(&point.name)));
    let place = crops::most_telling(&reference, worst.as_ref().unwrap_or(&reference));
    let [x, y, width, height] = place;
    let mut html = format!(
        "<h2>Side by side</h2>\n<p>The part of {width} × {height} pixels from ({x}, {y}), where the fewest samples are most wrong; beside it the \
         difference from the reference, {} times as bright. The pictures themselves are in the folder <i>pictures</i>.</p>\n",
        crops::GAIN
    );
    let image = |picture: &image::RgbImage, class: &str, what: &str| {
        let uri = crops::data_uri(picture).unwrap_or_default();
        format!(
            "<img{class} width=\"{}\" height=\"{}\" alt=\"{}\" src=\"{uri}\">",
            picture.width(),
            picture.height(),
            escape(what)
        )
    };
    html.push_str("<div class=\"crops\">\n");
    let cropped = crops::crop(&reference, place);
    let whole = {
        let [width, height] = [reference.width(), reference.height()];
        let scale = (480.0 / f64::from(width.max(1))).min(1.0);
        let [w, h] = [width, height].map(|side| ((f64::from(side) * scale) as u32).max(1));
        image::imageops::resize(&reference, w, h, image::imageops::FilterType::Triangle)
    };
    let _ = writeln!(
        html,
        "<figure>{}<figcaption>The reference</figcaption></figure>\n\
         <figure><div class=\"pair\">{}</div><figcaption>The reference, the part</figcaption></figure>",
        image(&whole, " class=\"whole\"", "the reference"),
        image(&cropped, "", "part of the reference"),
    );
    html.push_str("</div>\n");
    for rungs in &study.ladder.knobs {
        let _ = write!(html, "<h3>{}</h3>\n<div class=\"crops\">\n", rungs.knob.name());
        for point in summary.of_knob(study, rungs.knob) {
            let Some(picture) = crops::read(&folder.picture(&point.name)) else { continue };
            if picture.dimensions() != reference.dimensions() {
                continue;
            }
            let part = crops::crop(&picture, place);
            let difference = crops::difference(&part, &cropped);
            let value = point.settings.value(rungs.knob);
            let errors = [("coverage", &MEASURES[0]), ("FLIP", &MEASURES[2])]
                .into_iter()
                .filter_map(|(name, measure)| Some(format!("{name} {}", number(point.error(measure.of)?.mean))));
            let _ = writeln!(
                html,
                "<figure><div class=\"pair\">{}{}</div><figcaption><b>{}</b>{} · {} s · {}</figcaption></figure>",
                image(&part, "", &point.name),
                image(&difference, "", "difference from the reference"),
                escape(&value),
                if point.index == 0 { " (the scene)" } else { "" },
                number(point.cpu.median),
                errors.collect::<Vec<_>>().join(" · ")
            );
        }
        html.push_str("</div>\n");
    }
    html
}

fn tables(study: &Study, summary: &Summary) -> String {
    let mut html = "<h2>All numbers</h2>\n<p>Seconds are medians, with least and greatest; errors are means, with the standard deviation \
                    over seeds. Coverage: which share of the lines' area is wrong. Position: how far lines are from their places, in \
                    pixels.</p>\n<div class=\"wide\"><table>\n<thead><tr><th>setting</th><th>runs</th><th>wall, s</th><th>CPU, s</th>\
                    <th>bytes/sample</th><th>peak, MiB</th><th>coverage</th><th>where lines meet</th><th>position, px</th><th>FLIP</th><th>RMSE</th></tr></thead>\n<tbody>\n"
        .to_owned();
    rows(&mut html, study, summary, |point| {
        let spread = |spread: Spread| {
            let Spread { median, least, greatest } = spread;
            format!("{} <span class=\"soft\">({}–{})</span>", number(median), number(least), number(greatest))
        };
        let mut cells =
            vec![point.runs.to_string(), spread(point.wall), spread(point.cpu), number(point.bytes_per_sample)];
        cells.push(point.peak.map_or_else(|| "–".to_owned(), |peak| number(peak / f64::from(1 << 20))));
        let [coverage, position, flip, rmse] = MEASURES.map(|measure| cell(point.error(measure.of)));
        cells.extend([coverage, cell(point.error(CROSSINGS.of)), position, flip, rmse]);
        cells
    });
    html.push_str(
        "</tbody></table></div>\n<h3>By region</h3>\n<p>Lines: within a pixel of lines that are seen directly. Reflections: within a pixel of \
         lines in mirrors and glass. Rest: all other pixels.</p>\n<div class=\"wide\"><table>\n<thead><tr><th>setting</th><th>FLIP, lines</th>\
         <th>reflections</th><th>rest</th><th>RMSE, lines</th><th>reflections</th><th>rest</th></tr></thead>\n<tbody>\n",
    );
    rows(&mut html, study, summary, |point| {
        let part = |of: fn(&Errors) -> Option<f64>| cell(point.error(of));
        vec![
            part(|errors| errors.flip.lines),
            part(|errors| errors.flip.reflections),
            part(|errors| errors.flip.rest),
            part(|errors| errors.rmse.lines),
            part(|errors| errors.rmse.reflections),
            part(|errors| errors.rmse.rest),
        ]
    });
    html + "</tbody></table></div>\n"
}

fn cell(mean: Option<Mean>) -> String {
    match mean {
        None => "–".to_owned(),
        Some(Mean { mean, deviation: 0.0 }) => number(mean),
        Some(Mean { mean, deviation }) => {
            format!("{} <span class=\"soft\">± {}</span>", number(mean), number(deviation))
        }
    }
}

fn rows(html: &mut String, study: &Study, summary: &Summary, cells: impl Fn(&Point) -> Vec<String>) {
    for rungs in &study.ladder.knobs {
        let _ = writeln!(html, "<tr class=\"group\"><td colspan=\"11\">{}</td></tr>", rungs.knob.name());
        for point in summary.of_knob(study, rungs.knob) {
            let class = if point.index == 0 { " class=\"own\"" } else { "" };
            let cells: String = cells(point).iter().map(|cell| format!("<td>{cell}</td>")).collect();
            let _ = writeln!(html, "<tr{class}><td>{}</td>{cells}</tr>", escape(&point.settings.value(rungs.knob)));
        }
    }
}
