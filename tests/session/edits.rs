//! Random edits: every picture of a session equals a fresh one, bit for bit, whatever was kept for it.

use tusche::film::Layer;
use tusche::line::LineType;
use tusche::live::{LivePicture, Session, SessionOptions};
use tusche::render::RenderOptions;

use super::Sources;
use crate::common::{Picture, render_with};

/// Something that can be edited: its name in messages, and the texts that it can have.
type Knob = (&'static str, &'static [&'static str]);

const KNOBS: &[Knob] = &[
    ("width", &["3.0", "5.0", "1.0"]),
    ("normal", &["normal = 40.0", "normal = 60.0", "normal = 180.0", ""]),
    ("feature test", &["feature = 0.05", "feature = 0.5", ""]),
    ("uv test", &["", "uv = 0.4", "uv = 0.7"]),
    ("minimum width", &["", "min_width = 2.0", "min_width = 0.0"]),
    ("line color", &["", "color = [0.5, 0.1, 0.0]"]),
    ("tint", &["", "tint = false", "compose = \"throughput\""]),
    ("object test", &["", "", "object = false"]),
    ("shader test", &["", "", "shader = false"]),
    ("overlap test", &["", "", "overlap = 0.5", "overlap = 2.0"]),
    (
        "surfaces",
        &["", "", "surfaces = 2", "surfaces = 3", "surfaces = 2\nhidden = { width = 1.0, color = [0.5, 0.5, 0.0] }"],
    ),
    ("widest", &["", "max_width = 4.0"]),
    ("paths", &["", "", "", "paths = [\"camera\"]"]),
    (
        "types",
        &[
            "",
            "types.crease = { width = 1.0 }",
            "types.crease = { color = [0.0, 0.5, 0.0] }",
            "types.silhouette = { color = [0.5, 0.0, 0.0], opacity = 0.5 }",
        ],
    ),
    ("ground's tests", &["", "", "lines = { normal = 20.0 }", "lines = { object = false, feature = 0.2 }"]),
    (
        "paint script",
        &[
            "#{ base_color: p.paint, line_width: p.ink }",
            "#{ base_color: p.paint, line_width: p.ink + 1.0 }",
            "#{ base_color: p.paint, line_width: p.ink, line_color: rgb(0.3, 0.0, 0.0) }",
            "#{ base_color: p.paint * 0.5, line_width: p.ink }",
            "#{ base_color: p.paint, line_width: p.ink * (0.5 + noise(hit.position * 3.0)) }",
            "#{ base_color: p.paint, line_width: p.ink * (1.5 - luminance(hit.irradiance)) }",
            "#{ base_color: p.paint, feature: gray(step(0.5, fract(hit.position.y * 3.0))) }",
            "#{ base_color: p.paint * fract(hit.position.x * 2.0), line_width: p.ink, priority: 3 }",
            "#{ base_color: p.paint, opacity: 0.4, line_width: p.ink }",
            "#{ base_color: p.paint, opacity: step(0.5, fract(hit.position.x * 4.0)), line_width: p.ink }",
            "#{ base_color: p.paint, roughness: 0.0, metallic: 1.0, line_width: p.ink }",
            "#{ color: hit.normal, line_width: p.ink, line_opacity: 0.6 }",
            "#{ base_color: p.paint, line_width: hit.position.x / 0.0 }",
            "#{ base_color: p.paint * (0.0 / 0.0), line_width: 2.0 }",
            "let n = 3; if hit.front_facing { n = 0; } #{ base_color: p.paint, line_width: 4 / n }",
            "let s = `x${hit.object_id}`; #{ base_color: p.paint, line_width: p.ink + s.len() }",
            "#{ base_color: p.paint, line_width: 1.0 / hit.pixels_per_unit }",
            "#{ transmission: 1.0, roughness: 0.0, base_color: p.paint, line_width: p.ink }",
        ],
    ),
    ("styled lines", &["", "", "fn line(pair, p) { #{ color: mix(pair.color, rgb(0.0, 0.4, 0.0), 0.5) } }"]),
    (
        "ground script",
        &[
            "#{ base_color: rgb(0.3, 0.3, 0.3), roughness: 0.0, specular: 1.0, metallic: 1.0 }",
            "#{ base_color: rgb(0.9, 0.3, 0.3), roughness: 0.0, specular: 1.0, metallic: 1.0 }",
            "#{ base_color: rgb(0.3, 0.3, 0.3) }",
            "#{ base_color: rgb(0.3, 0.3, 0.3), line_width: 2.0, line_color: rgb(0.0, 0.0, 0.6) }",
            "#{ transmission: 1.0, roughness: 0.0, base_color: rgb(0.9, 1.0, 0.9) }",
            "#{ base_color: rgb(0.3, 0.3, 0.3) * checker(hit.uv * 4.0) }",
        ],
    ),
    ("ink", &["2.0", "3.5", "0.2", "0.0"]),
    ("paint", &["[0.8, 0.3, 0.1]", "[0.1, 0.3, 0.8]", "[0.0, 0.0, 0.0]", "[-0.0, 0.0, 0.0]"]),
    ("sun", &["[-0.5, -0.8, -0.4]", "[0.5, -0.8, -0.4]"]),
    ("shadows", &["true", "true", "false"]),
    ("second light", &["", "[[lights]]\nkind = \"point\"\nposition = [1.0, 2.0, 2.0]\nstrength = 10.0"]),
    ("place", &["[0.0, 0.6, 0.0]", "[0.2, 0.6, 0.0]"]),
    ("object", &["", "priority = 2", "lines = false", "group = \"a\""]),
    ("other object", &["", "priority = 1", "group = \"a\""]),
    ("camera", &["[0.0, 1.5, 4.0]", "[0.0, 1.5, 4.0]", "[0.3, 1.5, 4.0]"]),
    ("samples", &["2", "2", "5"]),
    ("background", &["[0.9, 0.9, 0.9]", "[0.2, 0.3, 0.6]", "{ top = [0.2, 0.4, 0.9], bottom = [0.9, 0.9, 0.9] }"]),
    ("ambient", &["0.3", "0.5"]),
    ("filter", &["", "filter = \"box\""]),
    ("depth", &["", "reflection_depth = 1", "refraction_depth = 0"]),
];

const LAYERS: [&[Layer]; 4] = [
    &[Layer::Rgba],
    &[Layer::Rgba, Layer::Line, Layer::Normal, Layer::Feature],
    &[Layer::Color, Layer::Line, Layer::Depth, Layer::Object],
    &[Layer::Rgba, Layer::LineType(LineType::Silhouette), Layer::LineType(LineType::Crease)],
];

/// The number of a knob.
fn knob(name: &str) -> usize {
    KNOBS.iter().position(|(known, _)| *known == name).unwrap_or_else(|| panic!("no knob `{name}`"))
}

/// Sources by the place of each knob.
fn sources(places: &[usize]) -> Sources {
    let text = |name: &str| KNOBS[knob(name)].1[places[knob(name)]];
    let lines = [
        "normal",
        "feature test",
        "uv test",
        "minimum width",
        "line color",
        "tint",
        "object test",
        "shader test",
        "overlap test",
        "surfaces",
        "widest",
        "paths",
        "types",
    ];
    let lines: Vec<&str> = lines.map(text).into_iter().filter(|line| !line.is_empty()).collect();
    let scene = format!(
        "[render]\nsize = [40, 28]\nsamples = {samples}\nbackground = {background}\nambient = {ambient}\n{filter}\n{depth}\n\
         [camera]\nposition = {camera}\ntarget = [0.0, 0.5, 0.0]\nfov = 40.0\n\
         [lines]\nwidth = {width}\n{lines}\n\
         [materials.paint]\nshader = \"paint.rhai\"\nparams = {{ paint = {paint}, ink = {ink} }}\n\
         [materials.ground]\nshader = \"ground.rhai\"\n{ground}\n\
         [[objects]]\nname = \"ground\"\nshape = \"box\"\nsize = [5.0, 0.2, 5.0]\nmaterial = \"ground\"\ntranslate = [0.0, -0.1, 0.0]\n\
         [[objects]]\nname = \"a\"\nshape = \"sphere\"\nradius = 0.6\nmaterial = \"paint\"\ntranslate = {place}\n{object}\n\
         [[objects]]\nname = \"b\"\nshape = \"box\"\nsize = [0.8, 0.8, 0.8]\nmaterial = \"paint\"\ntranslate = [0.7, 0.4, 0.3]\n{other}\n\
         [[lights]]\nkind = \"sun\"\ndirection = {sun}\nstrength = 2.0\nshadows = {shadows}\n{second}\n",
        samples = text("samples"),
        background = text("background"),
        ambient = text("ambient"),
        filter = text("filter"),
        depth = text("depth"),
        camera = text("camera"),
        width = text("width"),
        lines = lines.join("\n"),
        ground = text("ground's tests"),
        paint = text("paint"),
        ink = text("ink"),
        place = text("place"),
        object = text("object"),
        other = text("other object"),
        sun = text("sun"),
        shadows = text("shadows"),
        second = text("second light"),
    );
    let paint = format!(
        "fn params() {{ #{{ paint: rgb(1.0, 1.0, 1.0), ink: 2.0 }} }}\nfn surface(hit, p) {{ {} }}\n{}\n",
        text("paint script"),
        text("styled lines")
    );
    let ground = format!("fn surface(hit, p) {{ {} }}\n", text("ground script"));
    Sources { scene, scripts: vec![("paint.rhai".into(), paint), ("ground.rhai".into(), ground)] }
}

struct Dice(u64);

impl Dice {
    fn below(&mut self, count: usize) -> usize {
        self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        ((self.0 >> 33) as usize) % count
    }
}

fn picture_of(live: &LivePicture) -> Picture {
    Picture { width: live.size[0] as usize, height: live.size[1] as usize, channels: live.channels.clone() }
}

/// Edits a scene at random; some edits come while the one before is being rendered.
fn edit_at_random(seed: u64, edits: usize, options: SessionOptions) {
    let mut dice = Dice(seed);
    let session = Session::new(options).unwrap_or_else(|fault| panic!("{fault}"));
    let mut places = vec![0; KNOBS.len()];
    let mut layers = LAYERS[0];
    let mut history = Vec::new();
    let mut kept = 0;
    for edit in 0..edits {
        for _ in 0..=dice.below(3).saturating_sub(1) {
            let knob = dice.below(KNOBS.len());
            places[knob] = dice.below(KNOBS[knob].1.len());
            history.push(format!("{} -> {}", KNOBS[knob].0, KNOBS[knob].1[places[knob]]));
        }
        if dice.below(20) == 0 {
            layers = LAYERS[dice.below(LAYERS.len())];
        }
        let sources = sources(&places);
        session.set_scene(sources.setup(layers));
        if dice.below(4) == 0 {
            // The next edit comes before this picture is done.
            std::thread::yield_now();
            continue;
        }
        let live = session.render().unwrap_or_else(|faults| panic!("{faults}"));
        kept += usize::from(live.redone.traced < live.redone.tiles);
        let (fresh, report) = render_with(&sources.scene(), layers, &RenderOptions::default());
        let last = &history[history.len().saturating_sub(8)..];
        let off = picture_of(&live).bits().iter().zip(fresh.bits()).filter(|(a, b)| **a != *b).count();
        assert!(
            picture_of(&live).bits() == fresh.bits(),
            "edit {edit} of seed {seed} gave another picture than a fresh render in {off} values; {:?}; the last edits were {last:#?}\n{}\n{:?}",
            live.redone,
            sources.scene,
            sources.scripts
        );
        assert_eq!(live.warnings, report.warnings, "warnings after edit {edit} of seed {seed}: {last:#?}");
        assert_eq!(live.stats.lines.lined_samples, report.stats.lines.lined_samples, "edit {edit} of seed {seed}");
    }
    assert!(kept * 3 > edits, "of {edits} edits only {kept} kept anything");
}

/// `TUSCHE_EDITS=1000` makes that many edits.
fn edits() -> usize {
    std::env::var("TUSCHE_EDITS").ok().and_then(|text| text.parse().ok()).unwrap_or(150)
}

#[test]
fn pictures_after_random_edits_are_fresh_ones() {
    let options = SessionOptions { tile: 8, progressive: false, ..SessionOptions::default() };
    edit_at_random(1, edits(), options);
}

#[test]
fn so_are_they_with_pictures_of_fewer_samples_on_the_way() {
    edit_at_random(2, edits() / 2, SessionOptions { tile: 16, ..SessionOptions::default() });
}

#[test]
fn and_where_little_memory_may_be_used() {
    for cache_bytes in [0, 300_000] {
        let options = SessionOptions { tile: 16, cache_bytes, progressive: false, ..SessionOptions::default() };
        let session = Session::new(options).unwrap_or_else(|fault| panic!("{fault}"));
        let mut places = vec![0; KNOBS.len()];
        for ink in 0..3 {
            places[knob("ink")] = ink;
            let sources = sources(&places);
            session.set_scene(sources.setup(LAYERS[1]));
            let live = session.render().unwrap_or_else(|faults| panic!("{faults}"));
            let (fresh, _) = render_with(&sources.scene(), LAYERS[1], &RenderOptions::default());
            assert!(picture_of(&live).bits() == fresh.bits(), "with {cache_bytes} bytes");
        }
    }
}
