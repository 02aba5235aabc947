//! Plots as SVG text.
//!
//! Written by hand: the colours must follow the page (dark, light, print) through its style sheet, which plotting crates with
//! their fixed colours do not allow, and two kinds of plots are little text.

use std::fmt::Write as _;

/// A dot of a plot.
pub struct Dot {
    /// Place.
    pub at: [f64; 2],
    /// Least and greatest y.
    pub reach: [f64; 2],
    /// What it is, for who points at it.
    pub name: String,
    /// A text beside it.
    pub label: Option<String>,
}

/// Dots of one kind.
pub struct Series {
    /// Number of the colour and the shape.
    pub kind: usize,
    /// What they are, for the legend of a plot that stands alone; empty for none.
    pub name: String,
    /// The dots.
    pub dots: Vec<Dot>,
    /// Whether a line joins them.
    pub joined: bool,
    /// Whether they are only to be compared with.
    pub faint: bool,
}

/// A straight line y = `at_one` · x^`slope`, from one x to another.
pub struct Power {
    /// Its class in the style sheet.
    pub class: &'static str,
    /// The exponent.
    pub slope: f64,
    /// The value at 1.
    pub at_one: f64,
    /// Where it begins and ends.
    pub from: [f64; 2],
    /// What it is.
    pub name: String,
}

/// A plot with logarithmic axes.
pub struct Plot<'a> {
    /// What a screen reader says.
    pub title: &'a str,
    /// What x is.
    pub x: &'a str,
    /// What y is.
    pub y: String,
    /// The dots.
    pub series: Vec<Series>,
    /// Lines of powers.
    pub powers: Vec<Power>,
    /// Corners of the front, by rising x.
    pub front: Vec<[f64; 2]>,
    /// Below this, numbers mean little.
    pub floor: Option<f64>,
    /// The least y that is shown; lower dots are left out, lines cut.
    pub least: Option<f64>,
}

const WIDTH: f64 = 560.0;
const HEIGHT: f64 = 400.0;
const LEFT: f64 = 62.0;
const RIGHT: f64 = 12.0;
const TOP: f64 = 10.0;
const BOTTOM: f64 = 44.0;

/// A text as HTML.
#[must_use]
pub fn escape(text: &str) -> String {
    text.replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;").replace('"', "&quot;")
}

/// A number with three digits.
#[must_use]
pub fn number(value: f64) -> String {
    if value == 0.0 || !value.is_finite() {
        return if value == 0.0 { "0".to_owned() } else { "–".to_owned() };
    }
    let digits = libm::floor(libm::log10(value.abs())) as i32;
    if !(-4..6).contains(&digits) {
        return format!("{value:.2e}");
    }
    let text = format!("{value:.*}", (2 - digits).max(0) as usize);
    if text.contains('.') { text.trim_end_matches('0').trim_end_matches('.').to_owned() } else { text }
}

/// A logarithmic axis.
struct Axis {
    low: f64,
    high: f64,
    from: f64,
    to: f64,
}

impl Axis {
    fn new(values: impl Iterator<Item = f64>, from: f64, to: f64) -> Self {
        let values: Vec<f64> = values.filter(|value| *value > 0.0 && value.is_finite()).map(libm::log10).collect();
        let low = values.iter().copied().fold(f64::INFINITY, f64::min);
        let high = values.iter().copied().fold(f64::NEG_INFINITY, f64::max);
        let (low, high) = if low <= high { (low, high) } else { (0.0, 1.0) };
        let margin = 0.06 * (high - low).max(0.5);
        Self { low: low - margin, high: high + margin, from, to }
    }

    fn at(&self, value: f64) -> f64 {
        let (low, high) = (self.from.min(self.to), self.from.max(self.to));
        self.place(value).clamp(low - 5.0, high + 5.0)
    }

    /// As [`Self::at`], also far outside.
    fn place(&self, value: f64) -> f64 {
        let share = (libm::log10(value.max(1e-300)) - self.low) / (self.high - self.low);
        self.from + share * (self.to - self.from)
    }

    /// Round values, and whether each gets a text.
    fn ticks(&self) -> Vec<(f64, bool)> {
        let decades = self.high - self.low;
        let mut ticks = Vec::new();
        for decade in self.low.floor() as i32..=self.high.ceil() as i32 {
            for digit in 1..10 {
                let value = f64::from(digit) * libm::pow(10.0, f64::from(decade));
                let place = libm::log10(value);
                let named = digit == 1 || (decades < 2.2 && (digit == 2 || digit == 5));
                if (self.low..=self.high).contains(&place) && (named || decades < 4.0) {
                    ticks.push((value, named));
                }
            }
        }
        ticks
    }
}

impl Plot<'_> {
    /// The plot as a file of its own: with a legend, and colours that follow the reader's choice of dark or light.
    #[must_use]
    pub fn document(&self) -> String {
        const ROW: f64 = 18.0;
        let (mut legend, mut x, mut y) = (String::new(), LEFT, 16.0);
        let named = self.series.iter().filter(|series| !series.name.is_empty() && !series.dots.is_empty());
        let mut series: Vec<_> = named.collect();
        series.sort_by_key(|series| series.kind);
        for Series { kind, name, .. } in series {
            // As wide as most letters are.
            let width = 24.0 + 6.6 * name.chars().count() as f64;
            if x + width > WIDTH {
                (x, y) = (LEFT, y + ROW);
            }
            let _ = write!(
                legend,
                "<path class=\"dot k{kind}\" transform=\"translate({:.1} {:.1})\" d=\"{}\"/><text x=\"{:.1}\" y=\"{y:.1}\">{}</text>",
                x + 5.0,
                y - 4.0,
                shape(*kind),
                x + 14.0,
                escape(name)
            );
            x += width;
        }
        let top = y + 8.0;
        let height = HEIGHT + top;
        format!(
            "<svg xmlns=\"http://www.w3.org/2000/svg\" style=\"width:{WIDTH}px;height:{height}px\" viewBox=\"0 0 {WIDTH} {height}\">\n\
             <style>\n{}</style>\n<rect width=\"100%\" height=\"100%\" fill=\"var(--page)\"/>\n{legend}\n\
             <g transform=\"translate(0 {top})\">\n{}</g>\n</svg>\n",
            include_str!("style.css"),
            self.body()
        )
    }

    /// The plot as an `svg` element.
    #[must_use]
    pub fn svg(&self) -> String {
        format!(
            "<svg class=\"plot\" viewBox=\"0 0 {WIDTH} {HEIGHT}\" role=\"img\" aria-label=\"{}\">\n{}</svg>",
            escape(self.title),
            self.body()
        )
    }

    fn body(&self) -> String {
        let dots = || self.series.iter().flat_map(|series| &series.dots);
        let x = Axis::new(dots().map(|dot| dot.at[0]), LEFT, WIDTH - RIGHT);
        // A floor far below all dots is not worth the room.
        let least = dots().map(|dot| dot.at[1]).fold(f64::INFINITY, f64::min);
        let floor = self.floor.filter(|floor| *floor > least / 8.0);
        let lowest = self.least.unwrap_or(0.0);
        let shown = dots().flat_map(|dot| [dot.at[1], dot.reach[1]]).chain(floor).map(|value| value.max(lowest));
        let y = Axis::new(shown, HEIGHT - BOTTOM, TOP);
        let mut svg = String::new();
        let mut put = |text: String| {
            svg.push_str(&text);
            svg.push('\n');
        };
        let (right, bottom) = (WIDTH - RIGHT, HEIGHT - BOTTOM);
        for (value, named) in x.ticks() {
            let at = x.at(value);
            let class = if named { "grid" } else { "grid minor" };
            put(format!("<path class=\"{class}\" d=\"M{at:.1} {TOP}V{bottom}\"/>"));
            if named {
                put(format!(
                    "<text x=\"{at:.1}\" y=\"{:.1}\" text-anchor=\"middle\">{}</text>",
                    bottom + 16.0,
                    number(value)
                ));
            }
        }
        for (value, named) in y.ticks() {
            let at = y.at(value);
            let class = if named { "grid" } else { "grid minor" };
            put(format!("<path class=\"{class}\" d=\"M{LEFT} {at:.1}H{right}\"/>"));
            if named {
                put(format!(
                    "<text x=\"{:.1}\" y=\"{:.1}\" text-anchor=\"end\">{}</text>",
                    LEFT - 6.0,
                    at + 4.0,
                    number(value)
                ));
            }
        }
        let middle = (TOP + bottom) / 2.0;
        put(format!(
            "<text class=\"axis\" x=\"{:.1}\" y=\"{:.1}\" text-anchor=\"middle\">{}</text>",
            (LEFT + right) / 2.0,
            HEIGHT - 8.0,
            escape(self.x)
        ));
        put(format!(
            "<text class=\"axis\" transform=\"translate(14 {middle:.1}) rotate(-90)\" text-anchor=\"middle\">{}</text>",
            escape(&self.y)
        ));
        if let Some(floor) = floor {
            let at = y.at(floor).clamp(TOP, bottom);
            put(format!(
                "<rect class=\"floor\" x=\"{LEFT}\" y=\"{at:.1}\" width=\"{:.1}\" height=\"{:.1}\"/>",
                right - LEFT,
                bottom - at
            ));
            put(format!(
                "<text class=\"note\" x=\"{:.1}\" y=\"{:.1}\">the reference's own error</text>",
                LEFT + 6.0,
                (at + 12.0).min(bottom - 3.0)
            ));
        }
        if !self.front.is_empty() {
            let mut path = String::new();
            for (i, [fx, fy]) in self.front.iter().enumerate() {
                let (px, py) = (x.at(*fx), y.at(*fy));
                let _ = if i == 0 { write!(path, "M{px:.1} {py:.1}") } else { write!(path, "H{px:.1}V{py:.1}") };
            }
            put(format!("<path class=\"front\" d=\"{path}H{right}\"/>"));
        }
        for power in &self.powers {
            let place = |px: f64| [x.at(px), y.place(power.at_one * libm::pow(px, power.slope))];
            let [start, end] = power.from.map(place);
            // Cut where it leaves the plot, so that its slope stays true.
            let along = |to: f64| ((to.clamp(TOP, bottom) - start[1]) / (end[1] - start[1])).clamp(0.0, 1.0);
            let at = |share: f64| {
                let share = if share.is_finite() { share } else { 0.0 };
                let mix = |axis: usize| start[axis] + share * (end[axis] - start[axis]);
                format!("{:.1} {:.1}", mix(0), mix(1))
            };
            put(format!(
                "<path class=\"{}\" d=\"M{}L{}\"><title>{}</title></path>",
                power.class,
                at(along(start[1])),
                at(along(end[1])),
                escape(&power.name)
            ));
        }
        for series in &self.series {
            let faint = if series.faint { " faint" } else { "" };
            if series.joined {
                let places = series.dots.iter().map(|dot| format!("{:.1} {:.1}", x.at(dot.at[0]), y.at(dot.at[1])));
                let path = places.collect::<Vec<_>>().join("L");
                put(format!("<path class=\"joint{faint} k{}\" d=\"M{path}\"/>", series.kind));
            }
            for dot in series.dots.iter().filter(|dot| dot.at[1] >= lowest) {
                let (px, py) = (x.at(dot.at[0]), y.at(dot.at[1]));
                let [low, high] = dot.reach.map(|value| y.at(value));
                if (low - high).abs() > 1.0 {
                    put(format!("<path class=\"reach k{}\" d=\"M{px:.1} {low:.1}V{high:.1}\"/>", series.kind));
                }
                let title = escape(&dot.name);
                put(format!(
                    "<path class=\"dot{faint} k{}\" transform=\"translate({px:.1} {py:.1})\" d=\"{}\"><title>{title}</title></path>",
                    series.kind,
                    shape(series.kind)
                ));
                if let Some(label) = &dot.label {
                    let anchor = if px > WIDTH - 110.0 { "end" } else { "start" };
                    let beside = if px > WIDTH - 110.0 { px - 8.0 } else { px + 8.0 };
                    put(format!(
                        "<text class=\"label\" x=\"{beside:.1}\" y=\"{:.1}\" text-anchor=\"{anchor}\">{}</text>",
                        py - 5.0,
                        escape(label)
                    ));
                }
            }
        }
        svg
    }
}

/// The outline of a dot, so that kinds can be told apart without colours.
#[must_use]
pub fn shape(kind: usize) -> &'static str {
    match kind % 10 {
        0 => "M-4 0A4 4 0 1 1 4 0A4 4 0 1 1 -4 0Z",
        1 => "M-4 -4H4V4H-4Z",
        2 => "M0 -5L5 0L0 5L-5 0Z",
        3 => "M0 -5L5 4H-5Z",
        4 => "M0 5L5 -4H-5Z",
        5 => "M-1.5 -5H1.5V-1.5H5V1.5H1.5V5H-1.5V1.5H-5V-1.5H-1.5Z",
        6 => "M-5 0L4 -5V5Z",
        7 => "M5 0L-4 -5V5Z",
        8 => "M-4.5 -1.5L0 -5L4.5 -1.5L3 4.5H-3Z",
        _ => "M-4 -2L-2 -4L4 2L2 4ZM2 -4L4 -2L-2 4L-4 2Z",
    }
}

/// Bars that lie on each other's ends, one row for each name. Each part has the class `sN`.
#[must_use]
pub fn bars(title: &str, rows: &[(String, Vec<f64>)], unit: &str) -> String {
    const ROW: f64 = 20.0;
    const NAMES: f64 = 190.0;
    const NUMBERS: f64 = 80.0;
    let height = ROW * rows.len() as f64 + 6.0;
    let longest = rows.iter().map(|(_, parts)| parts.iter().sum::<f64>()).fold(0.0, f64::max).max(1e-300);
    let mut svg = format!(
        "<svg class=\"bars\" viewBox=\"0 0 {WIDTH} {height}\" role=\"img\" aria-label=\"{}\">\n",
        escape(title)
    );
    for (row, (name, parts)) in rows.iter().enumerate() {
        let top = row as f64 * ROW + 3.0;
        let _ = writeln!(
            svg,
            "<text x=\"{:.1}\" y=\"{:.1}\" text-anchor=\"end\">{}</text>",
            NAMES - 6.0,
            top + 13.0,
            escape(name)
        );
        let mut left = NAMES;
        for (part, value) in parts.iter().enumerate() {
            let width = value / longest * (WIDTH - NAMES - NUMBERS);
            let _ = writeln!(
                svg,
                "<rect class=\"s{part}\" x=\"{left:.2}\" y=\"{top:.1}\" width=\"{width:.2}\" height=\"{:.1}\"><title>{} {unit}</title></rect>",
                ROW - 4.0,
                number(*value)
            );
            left += width;
        }
        let total = number(parts.iter().sum());
        let _ = writeln!(svg, "<text x=\"{:.1}\" y=\"{:.1}\">{total} {unit}</text>", left + 5.0, top + 13.0);
    }
    svg + "</svg>"
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_have_three_digits() {
        let texts = [0.0, 1.0, 0.012_345, 123.456, 98_765.0, 1.5e-7, 2.5e8].map(number);
        assert_eq!(texts, ["0", "1", "0.0123", "123", "98765", "1.50e-7", "2.50e8"]);
    }

    #[test]
    fn plots_of_nothing_and_of_one_dot_are_plots() {
        let plot = |dots: Vec<Dot>| {
            let series = vec![Series { kind: 0, name: String::new(), dots, joined: true, faint: false }];
            let (powers, front) = (vec![], vec![]);
            Plot { title: "t", x: "x", y: "y".into(), series, powers, front, floor: Some(1e-9), least: None }.svg()
        };
        for svg in [plot(vec![]), plot(vec![Dot { at: [1.0, 0.0], reach: [0.0; 2], name: "<".into(), label: None }])] {
            assert!(!svg.contains("NaN") && !svg.contains("inf") && !svg.contains("<title><"), "{svg}");
        }
    }
}
