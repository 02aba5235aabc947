//! Whatever the analysis claims of a script must hold when the script runs: scripts are generated, analysed, and run
//! by the interpreter with the real library on inputs that try the bounds.

mod bounds;
mod writer;

use std::cell::Cell;
use std::collections::{BTreeMap, BTreeSet};
use std::sync::{Arc, OnceLock};

use proptest::prelude::*;
use proptest::test_runner::TestRunner;
use rhai::{Caches, Dynamic, Engine, Map};

use super::inputs::LIMIT;
use super::{Analysis, OutputFact, analyse_program};
use crate::diag::Source;
use crate::math::{Affine2, Vec2, Vec3, Vec4};
use crate::scene::attributes::{Attribute, AttributeSet};
use crate::scene::ids::TextureId;
use crate::scene::material::ScriptFiles;
use crate::scene::texture::{Image, Pixels, Texture, TextureFilter, TextureRef, Wrap};
use crate::shade::batch::{HitBatch, LightSample};
use crate::shade::host::Host;
use crate::shade::library::{Hit, ParameterRecord};
use crate::shade::names::{AOV_PREFIX, InputSet, OutputSet, PathKind};
use crate::shade::params::{Params, Value};
use crate::shade::script::Program;

/// The columns that the scripts read.
const COLUMNS: [InputSet; 14] = [
    InputSet::POSITION,
    InputSet::NORMAL,
    InputSet::UV,
    InputSet::DISTANCE,
    InputSet::CURVATURE,
    InputSet::TIME,
    InputSet::OBJECT_ID,
    InputSet::POLYGON_ID,
    InputSet::FRONT_FACING,
    InputSet::PATH_KIND,
    InputSet::LIGHT,
    InputSet::ATTRIBUTE,
    InputSet::FOOTPRINT,
    InputSet::UV_FOOTPRINT,
];

/// A hit with one column of another.
fn with_column(hit: &HitBatch, column: InputSet, other: &HitBatch) -> HitBatch {
    let mut hit = hit.clone();
    match column {
        InputSet::POSITION => hit.position.clone_from(&other.position),
        InputSet::NORMAL => hit.normal.clone_from(&other.normal),
        InputSet::UV => hit.uv.clone_from(&other.uv),
        InputSet::DISTANCE => hit.distance.clone_from(&other.distance),
        InputSet::CURVATURE => hit.curvature.clone_from(&other.curvature),
        InputSet::TIME => hit.time = other.time,
        InputSet::OBJECT_ID => hit.object_id.clone_from(&other.object_id),
        InputSet::POLYGON_ID => hit.polygon_id.clone_from(&other.polygon_id),
        InputSet::FRONT_FACING => hit.front_facing.clone_from(&other.front_facing),
        InputSet::PATH_KIND => hit.path_kind.clone_from(&other.path_kind),
        InputSet::LIGHT => hit.lights.clone_from(&other.lights),
        InputSet::FOOTPRINT => hit.footprint.clone_from(&other.footprint),
        InputSet::UV_FOOTPRINT => hit.uv_footprint.clone_from(&other.uv_footprint),
        InputSet::ATTRIBUTE => hit.attribute_set.clone_from(&other.attribute_set),
        _ => unreachable!("not in COLUMNS"),
    }
    hit
}

fn number(limit: f32) -> impl Strategy<Value = f32> {
    prop_oneof![
        4 => -2.0..2.0_f32,
        1 => -1e3..1e3_f32,
        1 => -1e8..1e8_f32,
        3 => prop::sample::select(vec![0.0, -0.0, 1.0, -1.0, 0.5, 1e-30, f32::MIN_POSITIVE, 1e9, limit, -limit]),
    ]
}

fn vector(limit: f32) -> impl Strategy<Value = Vec3> {
    (number(limit), number(limit), number(limit)).prop_map(Vec3::from)
}

fn unit_vector() -> impl Strategy<Value = Vec3> {
    vector(1.0).prop_map(|v| v.try_normalize().unwrap_or(Vec3::Z))
}

fn light() -> impl Strategy<Value = LightSample> {
    (unit_vector(), vector(1e15), prop_oneof![Just(0.0), Just(1.0), 0.0..1.0_f32])
        .prop_map(|(direction, radiance, visibility)| LightSample { direction, radiance: radiance.abs(), visibility })
}

fn hit() -> impl Strategy<Value = HitBatch> {
    let vectors = (vector(LIMIT), unit_vector(), (number(LIMIT), number(LIMIT)).prop_map(Vec2::from));
    let floats = (number(LIMIT), number(LIMIT), number(LIMIT));
    let ids = (prop_oneof![1..6_u32, Just(u32::MAX)], 0..6_u32);
    let kinds = [PathKind::Camera, PathKind::Reflection, PathKind::Refraction, PathKind::Shadow];
    let others = (any::<bool>(), prop::sample::select(kinds.to_vec()), [light(), light()], 0..3_u32, number(LIMIT));
    (vectors, floats, ids, others).prop_map(|(vectors, floats, ids, others)| HitBatch {
        len: 1,
        position: vec![vectors.0],
        normal: vec![vectors.1],
        uv: vec![vectors.2],
        distance: vec![floats.0.abs()],
        curvature: vec![floats.1],
        time: floats.2,
        object_id: vec![ids.0],
        polygon_id: vec![ids.1],
        front_facing: vec![others.0],
        path_kind: vec![others.1],
        lights: others.2.to_vec(),
        light_count: 2,
        attribute_set: vec![others.3],
        footprint: vec![others.4.abs()],
        uv_footprint: vec![(others.4 * 0.5).abs()],
        attributes: Arc::new(attribute_sets()),
        ..HitBatch::default()
    })
}

/// What objects have for scripts to ask.
fn attribute_sets() -> Vec<AttributeSet> {
    let set = |entries: &[(&str, Attribute)]| entries.iter().map(|(name, a)| ((*name).to_owned(), a.clone())).collect();
    vec![
        AttributeSet::new(),
        set(&[("wear", Attribute::Float(0.25)), ("count", Attribute::Int(7)), ("worn", Attribute::Bool(false))]),
        set(&[("wear", Attribute::Int(-2)), ("tint", Attribute::Vec3(Vec3::new(1.0, 0.0, -3.0)))]),
    ]
}

/// All that it takes to run scripts.
struct Bench {
    engine: Engine,
    textures: Vec<Arc<Texture>>,
    params: Params,
    record: ParameterRecord,
}

impl Bench {
    fn new() -> Self {
        let pixels = Pixels::Rgba8 { data: vec![[51, 102, 0, 255], [102, 204, 0, 255]], srgb: false };
        let image = Arc::new(Image { width: 2, height: 1, pixels });
        let texture = Texture {
            name: "two".into(),
            image,
            wrap: [Wrap::Repeat; 2],
            filter: TextureFilter::Linear,
            levels: OnceLock::new(),
        };
        let wide = Texture { filter: TextureFilter::Mipmap, ..texture.clone() };
        let textures = vec![Arc::new(texture), Arc::new(wide)];
        let mip = TextureRef { texture: TextureId::from_index(1), uv_set: 0, transform: Affine2::IDENTITY };
        let map = TextureRef { texture: TextureId::from_index(0), uv_set: 0, transform: Affine2::IDENTITY };
        let values = [
            ("half", Value::Float(0.5)),
            ("three", Value::Int(3)),
            ("on", Value::Bool(true)),
            ("none", Value::Unit),
            ("map", Value::Texture(map)),
            ("mip", Value::Texture(mip)),
        ];
        let values: BTreeMap<String, Value> = values.map(|(name, value)| (name.to_owned(), value)).into();
        let names: BTreeSet<String> = values.keys().cloned().collect();
        let params = Params(Arc::new(values));
        let record = ParameterRecord::new(&params, &textures);
        let host = Host::new().with(|engine| {
            engine
                .register_fn("native", |x: f32| x * 3.0 - 1.0)
                .register_fn("native", |hit: Hit| hit.batch.curvature[hit.row]);
        });
        let mut engine = host.engine(&names, &textures);
        engine.set_max_expr_depths(0, 0);
        Self { engine, textures, params, record }
    }

    /// The record that a script returns; `None` if it fails.
    fn run(&self, program: &Program, hit: HitBatch) -> Option<Map> {
        let hit = Hit { batch: Arc::new(hit), row: 0 };
        let arguments = [Dynamic::from(hit), Dynamic::from(self.record.clone())];
        let result = program.run(&self.engine, &mut Caches::new(), &program.surface, arguments).ok()?;
        Some(result.try_cast::<Map>().expect("the scripts return records"))
    }
}

fn channels(value: &Dynamic) -> Vec<f32> {
    if let Ok(x) = value.as_float() {
        vec![x]
    } else if let Ok(n) = value.as_int() {
        vec![n as f32]
    } else if let Some(v) = value.read_lock::<Vec4>() {
        v.to_array().to_vec()
    } else {
        value.read_lock::<Vec3>().expect("the outputs are numbers and vectors").to_array().to_vec()
    }
}

fn constant(fact: &OutputFact) -> Option<Vec<f32>> {
    Some(match fact.constant.as_ref()? {
        Value::Float(x) => vec![*x],
        Value::Int(n) => vec![*n as f32],
        Value::Vec3(v) => v.to_array().to_vec(),
        _ => Vec::new(),
    })
}

/// The facts by key.
fn facts(found: &Analysis) -> BTreeMap<String, OutputFact> {
    let outputs = OutputSet::named().map(|(name, output)| (name.to_owned(), found.output(output).clone()));
    outputs.chain(found.aovs.iter().map(|(name, fact)| (format!("{AOV_PREFIX}{name}"), fact.clone()))).collect()
}

/// What is wrong with the facts about a record.
fn contradiction(facts: &BTreeMap<String, OutputFact>, outputs: &Map) -> Option<String> {
    for key in outputs.keys() {
        if !facts.get(key.as_str()).is_some_and(|fact| fact.may) {
            return Some(format!("`{key}` is written"));
        }
    }
    for (name, fact) in facts {
        let Some(value) = outputs.get(name.as_str()).map(channels) else {
            if fact.always {
                return Some(format!("`{name}` is not written"));
            }
            continue;
        };
        let within = fact.range.is_none_or(|[low, high]| value.iter().all(|x| (low..=high).contains(x)));
        if !within || constant(fact).is_some_and(|constant| constant != value) {
            return Some(format!("`{name}` is {value:?}"));
        }
    }
    None
}

/// An output that differs though nothing that it is said to depend on does.
fn hidden_dependence(
    facts: &BTreeMap<String, OutputFact>,
    column: InputSet,
    outputs: &Map,
    varied: &Map,
) -> Option<String> {
    let independent = facts.iter().filter(|(_, fact)| !fact.inputs.columns().contains(column));
    for (name, _) in independent {
        let value = |outputs: &Map| outputs.get(name.as_str()).map(channels);
        // NaN differs from itself.
        let same = match (value(outputs), value(varied)) {
            (Some(a), Some(b)) => a.iter().zip(&b).all(|(a, b)| a == b || a.is_nan() && b.is_nan()),
            (a, b) => a.is_none() && b.is_none(),
        };
        if !same {
            return Some(name.clone());
        }
    }
    None
}

/// Parses and analyses a script. `None` if the analysis gave up.
fn claims(bench: &Bench, text: &str) -> Result<Option<(Program, Analysis)>, String> {
    let source = Arc::new(Source { name: "generated.rhai".into(), text: text.into() });
    let program = Program::parse(&source, &ScriptFiles::default(), &Host::new().words())
        .map_err(|faults| format!("{faults}\n{text}"))?;
    let sets = attribute_sets();
    let attributes: Vec<&AttributeSet> = sets.iter().collect();
    let found =
        analyse_program(&program, crate::shade::script::Entry::Surface, &bench.params, &bench.textures, &attributes);
    Ok(found.complete.then_some((program, found)))
}

/// Runs a script and compares with what is claimed. Gives at how many hits it ran.
fn check(bench: &Bench, (program, found): &(Program, Analysis), hits: &[HitBatch]) -> Result<usize, String> {
    let text = &program.source.text;
    let facts = facts(found);
    let mut runs = 0;
    for (i, hit) in hits.iter().enumerate() {
        let Some(outputs) = bench.run(program, hit.clone()) else { continue };
        runs += 1;
        if let Some(what) = contradiction(&facts, &outputs) {
            return Err(format!("{what}\n{text}\n{found}{hit:?}"));
        }
        let other = &hits[(i + 1) % hits.len()];
        for column in COLUMNS {
            let Some(varied) = bench.run(program, with_column(hit, column, other)) else { continue };
            if let Some(name) = hidden_dependence(&facts, column, &outputs, &varied) {
                return Err(format!("`{name}` depends on {column:?}\n{text}\n{found}{hit:?}\n{other:?}"));
            }
        }
    }
    Ok(runs)
}

#[test]
fn facts_hold_on_generated_scripts() {
    let bench = Bench::new();
    let config = ProptestConfig { cases: 1200, failure_persistence: None, ..ProptestConfig::default() };
    let (followed, ran) = (Cell::new(0), Cell::new(0));
    let choices = prop::collection::vec(any::<u8>(), 100..900);
    let cases = (choices, prop::collection::vec(hit(), 4));
    let result = TestRunner::new(config).run(&cases, |(choices, hits)| {
        if let Some(claimed) = claims(&bench, &writer::script(&choices)).map_err(TestCaseError::fail)? {
            followed.set(followed.get() + 1);
            ran.set(ran.get() + check(&bench, &claimed, &hits).map_err(TestCaseError::fail)?);
        }
        Ok(())
    });
    if let Err(error) = result {
        panic!("{error}");
    }
    // Scripts that fail, or that the analysis gives up on, test nothing.
    assert!(followed.get() >= 1160, "{followed:?} scripts could be analysed");
    assert!(ran.get() >= 3600, "scripts ran at {ran:?} hits");
}

/// Scripts in which a dependence is easily missed, each of which some simpler analysis gets wrong.
const TRICKY: [&str; 24] = [
    // Leaving a loop decides whether a later `return` in it is reached.
    "let i = 0; loop { i += 1; if hit.front_facing { break; } if hit.curvature > 0.0 { return #{ roughness: 0.1 }; }
     if i > 3 { break; } } #{ roughness: 0.2 }",
    // The only way out without an error returns a value that depends on the round.
    "for i in 0..100 { if i > hit.object_id { return #{ roughness: i * 0.01 }; } } throw 1;",
    "let i = 0; loop { if i > hit.object_id { return #{ roughness: i * 0.01 }; } i += 1; }",
    "let i = 0; let r = 0.0; loop { r = i * 0.5; if i > hit.polygon_id { break; } i += 1; } #{ roughness: r }",
    // What comes after a `continue` depends on it.
    "let r = 0.0; for i in 0..3 { if hit.distance > i { continue; } r += 1.0; } #{ roughness: r }",
    "let r = 0.0; for i in 0..100 { if hit.front_facing { continue; } r = 1.0; } #{ roughness: r }",
    // Copies of one value stay equal only until one of them changes.
    "let a = hit.uv.x; let b = a; if hit.front_facing { b = hit.uv.x * 1.0; } let c = a;
     for i in 0..70 { if hit.time > 0.0 { c = b; } b = hit.distance; } #{ roughness: c, metallic: b }",
    // A swap in a loop.
    "let a = 0.0; let b = 1.0; let i = 0; while i < hit.object_id % 9 { let c = a; a = b; b = c; i += 1; }
     #{ roughness: a, metallic: b }",
    // Keys whose presence depends on inputs.
    "let out = #{}; if hit.front_facing { out.roughness = 0.5; } let other = out; if hit.curvature > 0.0 { out = #{}; }
     other + out",
    "let a = #{}; let v = hit.time; if hit.uv.x > 0.0 { a.roughness = v; } let b = #{};
     if hit.uv.y > 0.0 { b.roughness = v; } if hit.front_facing { a } else { b }",
    "let a = #{}; if hit.uv.x > 0.0 { a.roughness = 0.5; } let b = #{}; if hit.uv.x < 1.0 && hit.time > 0.0 { b.roughness = 0.5; }
     a + b",
    // The sign of a zero.
    "let zero = 0.0 * hit.curvature; #{ roughness: 1.0 / zero, metallic: zero }",
    "let zero = min(abs(hit.curvature), 0.0); #{ roughness: 1.0 / zero }",
    // What a closure captures is shared, in both directions, and by all closures that capture it.
    "let a = hit.uv.x; let f = |x| x + a; a = hit.time; #{ roughness: f.call(1.0), metallic: a }",
    "let n = 0.0; let f = |x| { n += x; if x > 1.0 { return 0.0; } n = hit.curvature; 1.0 };
     if hit.front_facing { f.call(hit.distance); } #{ roughness: n, metallic: f.call(0.0), opacity: n }",
    "let a = 1.0; let f = || { a = a + hit.time; }; let g = |x| { f.call(); a * x }; a = hit.uv.y; #{ roughness: g.call(2.0), metallic: a }",
    "let out = #{}; let f = |x| { out.roughness = x; }; if hit.front_facing { f.call(hit.time); } out",
    "let r = 0.0; for i in 0..hit.object_id % 7 { let k = i * 0.5; let f = |x| { r += x * k; k = r; }; f.call(hit.uv.x); f.call(1.0); }
     #{ roughness: r }",
    // A shared array is changed by its own methods.
    "let a = [hit.time]; if hit.front_facing { let f = || a[0]; f.call(); } a.push(1.0); #{ roughness: a.len(), metallic: a[0] }",
    "let v = hit.position; let f = |x| { v.x = x; v }; v.y = 2.0; let w = f.call(hit.time); v.x = 0.5; #{ base_color: w, aov_v: v }",
    // A condition with an effect.
    "let r = 0.0; if hit.front_facing && (if hit.time > 0.0 { r = 2.0; true } else { false }) { r += 1.0; }
     #{ roughness: r }",
    // `switch` with conditions.
    "let r = switch hit.polygon_id { 1 if hit.front_facing => 0.1, 1 => 0.2, 2..4 if hit.time > 0.0 => 0.3, _ => 0.4 };
     #{ roughness: r }",
    "#{ roughness: switch p.three { 3 if hit.front_facing => 0.1, 2..5 => hit.curvature, _ => 0.4 } }",
    // A comparison with a value that is no number.
    "let nan = sqrt(-1.0 - hit.distance); #{ roughness: if nan <= 5.0 { 0.1 } else { 0.2 },
     metallic: if nan != nan { 0.1 } else { 0.2 }, opacity: max(nan, 0.5), line_width: clamp(nan, 0.0, 1.0) }",
];

#[test]
fn facts_hold_on_tricky_scripts() {
    let bench = Bench::new();
    for body in TRICKY {
        let text = format!("fn surface(hit, p) {{ {body} }}");
        let claimed = claims(&bench, &text).unwrap().unwrap_or_else(|| panic!("the analysis gave up on {text}"));
        let config = ProptestConfig { cases: 60, failure_persistence: None, ..ProptestConfig::default() };
        let hits = prop::collection::vec(hit(), 4);
        let result = TestRunner::new(config)
            .run(&hits, |hits| check(&bench, &claimed, &hits).map(drop).map_err(TestCaseError::fail));
        if let Err(error) = result {
            panic!("{error}");
        }
    }
}
