//! The section on how wide lines are drawn.

use std::fmt::Write as _;

use super::figures::{Figures, legend};
use super::svg::{Dot, Plot, Power, Series, number};
use crate::scene::settings::Sampler;
use crate::study::width::{Asked, Drawn, Edge, SAMPLES, WIDTHS};

/// The least share of the asked width that plots show.
const LEAST: f64 = 0.3;

/// Drawn against asked widths; nothing if none were measured.
pub(super) fn section(widths: &[Drawn], figures: &mut Figures) -> String {
    if widths.is_empty() {
        return String::new();
    }
    let mut html = format!(
        "<h2>Drawn against asked width</h2>\n<p>How wide a line is on average that is asked to have a width: the area that is drawn, as a \
         part of the area that was asked for. Only the edge, the sampler and the number of samples matter, not the scene. Hollow and dashed: the \
         paper's rule, which measures to the nearest <i>sample</i> across the edge and so draws too thin; filled: with \
         <i>width_compensation</i>, which is made for straight edges. Below {} % is left out of the plots.</p>\n",
        number(100.0 * LEAST)
    );
    html += &legend(SAMPLES.map(rate).into_iter().enumerate());
    for edge in Edge::ALL {
        let _ = write!(html, "<h3>{}</h3>\n<div class=\"three\">\n", edge.name());
        for sampler in Sampler::ALL {
            let plot = plot(widths, edge, sampler);
            html += &figures.add(format!("widths_{}_{}", edge.file_name(), sampler.name()), &plot, sampler.name());
        }
        html.push_str("</div>\n");
    }
    html.push_str(&table(widths));
    html
}

fn rate(samples: u32) -> String {
    format!("{samples} sample{}", if samples == 1 { "" } else { "s" })
}

fn found(widths: &[Drawn], asked: &Asked) -> Option<f64> {
    let drawn = widths.iter().find(|drawn| drawn.asked == *asked)?.drawn;
    Some(drawn / f64::from(asked.width))
}

fn plot(widths: &[Drawn], edge: Edge, sampler: Sampler) -> Plot<'static> {
    let series = |compensation: bool| {
        SAMPLES.into_iter().enumerate().map(move |(kind, samples)| {
            let dots = WIDTHS.into_iter().filter_map(|width| {
                let share = found(widths, &Asked { edge, sampler, samples, compensation, width })?;
                let name = format!("{samples} samples, {width} px: {} px drawn", number(share * f64::from(width)));
                let at = [f64::from(width), share];
                (share > 0.0).then_some(Dot { at, reach: [share; 2], name, label: None })
            });
            let name = if compensation { rate(samples) } else { String::new() };
            Series { kind, name, dots: dots.collect(), joined: true, faint: !compensation }
        })
    };
    let from = [f64::from(WIDTHS[0]), f64::from(WIDTHS[WIDTHS.len() - 1])];
    let even = Power { class: "ideal", slope: 0.0, at_one: 1.0, from, name: "as asked".to_owned() };
    Plot {
        title: "drawn against asked width",
        x: "asked width, px",
        y: "drawn / asked".to_owned(),
        series: series(false).chain(series(true)).collect(),
        powers: vec![even],
        front: Vec::new(),
        floor: None,
        least: Some(LEAST),
    }
}

fn table(widths: &[Drawn]) -> String {
    let mut html =
        "<h3>Drawn / asked, compensated (paper's rule)</h3>\n<div class=\"wide\"><table>\n<thead><tr><th>edge</th>\
                    <th>sampler</th><th>samples</th>"
            .to_owned();
    WIDTHS.iter().for_each(|width| html += &format!("<th>{width} px</th>"));
    html.push_str("</tr></thead>\n<tbody>\n");
    for edge in Edge::ALL {
        for sampler in Sampler::ALL {
            for samples in SAMPLES {
                let _ = write!(html, "<tr><td>{}</td><td>{}</td><td>{samples}</td>", edge.name(), sampler.name());
                for width in WIDTHS {
                    let [paper, compensated] = [false, true].map(|compensation| {
                        let share = found(widths, &Asked { edge, sampler, samples, compensation, width });
                        share.map_or_else(|| "–".to_owned(), |share| format!("{share:.3}"))
                    });
                    let _ = write!(html, "<td>{compensated} <span class=\"soft\">({paper})</span></td>");
                }
                html.push_str("</tr>\n");
            }
        }
    }
    html + "</tbody></table></div>\n"
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::study::width::all;

    #[test]
    fn every_edge_and_sampler_has_a_plot_and_what_is_missing_a_dash() {
        assert_eq!(section(&[], &mut Figures::default()), "");
        let drawn = |asked: Asked| Drawn { version: String::new(), drawn: 0.9 * f64::from(asked.width), asked };
        let mut widths: Vec<_> = all().into_iter().map(drawn).collect();
        let whole = section(&widths, &mut Figures::default());
        assert_eq!(whole.matches("<svg class=\"plot\"").count(), Edge::ALL.len() * Sampler::ALL.len());
        assert_eq!(whole.matches("0.900 <span class=\"soft\">(0.900)</span>").count(), all().len() / 2);
        // At one sample nothing may be drawn at all.
        widths[0].drawn = 0.0;
        widths.truncate(100);
        let part = section(&widths, &mut Figures::default());
        assert!(part.contains("– <span") && part.contains("(0.000)") && !part.contains("NaN") && !part.contains("inf"));
    }
}
