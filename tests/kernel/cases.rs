//! One script for each construct that kernels know, and what the plan saves with them.

use tusche::math::{Vec2, Vec3};
use tusche::scene::ids::MaterialId;
use tusche::shade::{
    Host, InputSet, Mode, NativeFunction, OutputBatch, OutputSet, ShadeErrors, Shaders, Shading, ShadingMode, builtin,
};

use super::agree::{Random, Verdict, compare, hits, scene};

/// Bodies of `surface`, each with the construct that it is about.
const BODIES: &[(&str, &str)] = &[
    (
        "an int where a float may be",
        "let w = if hit.front_facing { 1 } else { 2.5 }; #{ line_width: w * 2, aov_w: w + 1 }",
    ),
    (
        "a text chosen at each hit",
        "let s = if hit.depth > 0 { \"a\" } else { \"b\" }; #{ line_width: if s == \"a\" { 1 } else { 2 } }",
    ),
    ("a key that is set at some hits", "let o = #{}; if hit.depth > 0.5 { o.line_width = hit.depth; } o"),
    (
        "records returned early",
        "if hit.front_facing { return #{ color: hit.normal }; } #{ base_color: hit.position, priority: hit.object_id }",
    ),
    (
        "a return out of nested loops",
        "for i in 0..9 { for j in 0..9 { if i * j > hit.object_id { return #{ line_width: i + 0.5 * j }; } } } #{}",
    ),
    (
        "a loop without a known end",
        "let n = 0; let x = abs(hit.depth) + 1.0; while x < 1e6 && n < 300 { x *= 1.1; n += 1; } #{ line_width: n }",
    ),
    (
        "break with a value",
        "let n = 0; let v = loop { n += 1; if n * n > hit.polygon_id { break n * 0.5; } }; #{ line_width: v }",
    ),
    (
        "continue",
        "let s = 0.0; for i in 0..200 { if i % 3 == hit.object_id % 3 { continue; } s += i; } #{ line_width: s }",
    ),
    (
        "a switch with conditions",
        "let w = switch hit.object_id { 1 if hit.front_facing => 1.0, 1 | 2 => 2.0, 5 => 5.0, _ => 0.5 }; #{ line_width: w }",
    ),
    (
        "a switch with ranges",
        "let w = switch hit.polygon_id { 0 => 9.0, 1..3 => 1.0, 3..=8 => 2.0, _ => 0.25 }; #{ line_width: w }",
    ),
    (
        "a switch on the path",
        "#{ line_width: switch hit.path_kind { \"camera\" => 1.0, \"shadow\" => 2.0, _ => 3.0 } }",
    ),
    (
        "an index that varies",
        "let a = [0.1, hit.depth, 3.0]; a[hit.object_id % 3] += 1.0; #{ line_width: a[-1 - hit.polygon_id % 3] }",
    ),
    ("indices out of range", "let a = [1, 2, 3]; #{ line_width: a[hit.object_id] }"),
    ("ints that overflow", "let x = 9223372036854775000 + hit.object_id * 300; #{ line_width: x % 7 }"),
    (
        "a variable whose type changes over and over",
        "let x = 0; for i in 0..60 { if hit.front_facing { if hit.polygon_id > i { x = i; } } else { if hit.object_id > i { x = true; } else { x = 0.5; } } } #{ line_width: if x == true { 2.0 } else if x == 0.5 { 3.0 } else { 1.0 } }",
    ),
    (
        "NaN beside an int",
        "let n = hit.depth * 0.0 / 0.0; #{ aov_a: max(n, 2), aov_b: max(2, n), aov_c: min(n, 2), aov_d: min(2, n), aov_e: step(n, 2), aov_f: pow(n, 0) }",
    ),
    ("ints divided by zero", "#{ line_width: 12 / hit.object_id, aov_m: mod(7, hit.object_id - 2) }"),
    ("floats that do not fit ints", "#{ line_width: to_int(hit.depth) % 5 }"),
    ("a light that is not there", "#{ line_width: hit.light(hit.object_id).visibility }"),
    (
        "all lights",
        "let s = 0.0; for i in 0..hit.light_count { s += luminance(hit.light(i).radiance); } #{ line_width: s, emission: hit.irradiance }",
    ),
    ("throw", "if hit.front_facing { throw \"not this side\"; } #{ line_width: 1 }"),
    ("a priority that does not fit", "#{ priority: hit.polygon_id * 2 }"),
    ("swizzles to both sides of =", "let v = hit.normal; v.zx = v.xy; v.y *= 2; v[0] = 0.5; #{ color: v.bgr }"),
    (
        "nested records",
        "let r = #{ a: #{ b: [1.0, 2.0] } }; r.a.b[1] += hit.depth; r.a.c = hit.uv; #{ line_width: r.a.b[1] + r.a.c.x }",
    ),
    (
        "a closure that changes what it has captured",
        "let n = hit.depth; let f = |x| { n += x; n * 2.0 }; let a = f.call(1.0); #{ line_width: a + f.call(0.5) + n }",
    ),
    (
        "ramps of all kinds",
        "let s = [[0.0, rgb(1, 0, 0)], [0.5, hit.normal], [1, rgb(0, 0, 1)]]; #{ color: ramp(hit.depth, s) + ramp(hit.depth, s, \"smooth\") + ramp(hit.depth, s, \"constant\") }",
    ),
    ("a ramp whose stops may fall", "#{ line_width: ramp(0.5, [[hit.depth, 1.0], [0.5, 2.0]]) }"),
    (
        "hashes and noise",
        "#{ aov_a: hash_color(hit.position) + hash(hit.object_id), aov_b: gray(fbm(hit.position, 4)) + cellular_noise(hit.uv) }",
    ),
    (
        "logic that must not go on",
        "let ok = hit.object_id != 0 && 10 / hit.object_id > 2; #{ line_width: if ok || 1 / hit.object_id == 0 { 1 } else { 2 } }",
    ),
];

#[test]
fn every_construct_gives_the_same_bits() {
    for (about, body) in BODIES {
        let script = format!("fn surface(hit, p) {{ {body} }}");
        for (len, seed) in [(1, 1), (16, 2), (61, 3), (700, 4)] {
            match compare(&script, &hits(len, &mut Random(seed)), OutputSet::all()) {
                Ok(Verdict::Agrees) => {}
                other => panic!("{about}: {other:?}\n{script}"),
            }
        }
    }
}

#[test]
fn any_number_of_lights_gives_the_same_bits() {
    let script = "fn surface(hit, p) {
            let sum = vec3(0);
            for i in 0..hit.light_count {
                let light = hit.light(i);
                sum += light.radiance * light.visibility * dot(hit.normal, light.direction);
            }
            let one = if hit.light_count > 0 { hit.light(hit.polygon_id % hit.light_count).direction } else { vec3(0) };
            #{ base_color: sum, emission: hit.irradiance, feature: one }
        }";
    for count in [0, 1, 2, 3, 4, 5, 9] {
        for len in [1, 16, 37, 300] {
            let mut batch = hits(len, &mut Random(11));
            let samples = hits(len * count, &mut Random(12)).lights;
            batch.lights = samples.into_iter().take(len * count).collect();
            batch.light_count = count;
            assert_eq!(compare(script, &batch, OutputSet::all()), Ok(Verdict::Agrees), "{count} lights, {len} hits");
        }
    }
}

#[test]
fn what_a_method_changes_is_kept_where_it_returns_early() {
    let script = "fn grow(by) { if this < 0.5 { return 1.0; } this += by; 2.0 }
        fn surface(hit, p) { let x = hit.depth; let y = x.grow(hit.distance); #{ line_width: x, aov_y: y } }";
    assert_eq!(compare(script, &hits(64, &mut Random(5)), OutputSet::all()), Ok(Verdict::Agrees));
}

#[test]
fn a_loop_without_an_end_runs_out_of_fuel_and_is_located() {
    let script =
        "fn surface(hit, p) { let x = 0.0; while x <= hit.depth * hit.depth + 1.0 { x *= 0.5; } #{ line_width: x } }";
    assert_eq!(compare(script, &hits(20, &mut Random(6)), OutputSet::all()), Ok(Verdict::Agrees));
}

#[test]
fn all_shipped_shaders_run_as_kernels_or_once() {
    for name in builtin::names() {
        let source = builtin::source(name).expect("it is a name of one");
        let scene = scene(&source.text);
        let (shaders, _) = Shaders::compile(&scene, &Host::new()).unwrap_or_else(|faults| panic!("{name}: {faults}"));
        let shader = shaders.of(MaterialId(0));
        assert_ne!(shader.mode(), Mode::Interpreted, "{name}: {:?}", shader.blame());
    }
}

#[test]
fn what_cannot_be_a_kernel_is_blamed_on_its_construct() {
    let blame = |body: &str| {
        let script =
            format!("fn twice(x) {{ if x < 1.0 {{ x }} else {{ twice(x * 0.5) }} }}\nfn surface(hit, p) {{ {body} }}");
        match compare(&script, &hits(3, &mut Random(7)), OutputSet::all()) {
            Ok(Verdict::Interpreted(blame)) => blame,
            other => panic!("{other:?}"),
        }
    };
    assert!(blame("#{ line_width: twice(hit.depth) }").contains("`twice`, which calls itself,"));
    assert!(blame("try { throw 1; } catch { } #{ line_width: hit.depth }").contains(": `try` cannot"));
    assert!(blame("let t = `${hit.depth}`; #{ line_width: t.len() }").contains("a text made from values"));
}

#[test]
fn kernels_alone_refuse_what_they_cannot_run() {
    let scene = scene("fn surface(hit, p) { let t = `${hit.depth}`; #{ line_width: t.len() } }");
    let faults = Shaders::compile_for(&scene, &Host::new(), ShadingMode::Kernel).expect_err("it is no kernel");
    assert!(faults.to_string().contains("a text made from values"), "{faults}");
}

#[test]
fn a_slice_reads_what_its_outputs_need() {
    let script = "fn surface(hit, p) {
            let tone = fbm(vec3(hit.uv, 0.5), 6) * luminance(hit.irradiance);
            #{ base_color: hit.color.rgb * tone, line_width: 1.0 + hit.curvature }
        }";
    let scene = scene(script);
    let (shaders, _) = Shaders::compile(&scene, &Host::new()).unwrap_or_else(|faults| panic!("{faults}"));
    let shader = shaders.of(MaterialId(0));
    assert_eq!(shader.needs(OutputSet::LINE_WIDTH), InputSet::CURVATURE);
    let all = InputSet::UV
        | InputSet::IRRADIANCE
        | InputSet::LIGHT
        | InputSet::NORMAL
        | InputSet::COLOR
        | InputSet::CURVATURE;
    assert_eq!(shader.needs(OutputSet::all()), all);
    // The interpreter evaluates everything, whatever is asked.
    let (shaders, _) = Shaders::compile_for(&scene, &Host::new(), ShadingMode::Interpreter).expect("it compiles");
    assert_eq!(shaders.of(MaterialId(0)).needs(OutputSet::LINE_WIDTH), all);
}

#[test]
fn kernels_leave_the_interpreter_alone() {
    let scene = scene("fn surface(hit, p) { #{ line_width: hit.depth, color: hit.normal } }");
    let (shaders, _) = Shaders::compile(&scene, &Host::new()).unwrap_or_else(|faults| panic!("{faults}"));
    let mut shading = Shading::new(&scene, &shaders);
    let batch = hits(1000, &mut Random(8));
    let (mut outputs, mut errors) = (OutputBatch::default(), ShadeErrors::default());
    shading.shade(MaterialId(0), &batch, OutputSet::all(), &mut outputs, &mut errors);
    assert_eq!((shading.evaluations(), shading.kernel_hits()), (0, 1000));
    // Hits that fail are the interpreter's: here those of object 0.
    let scene = super::agree::scene("fn surface(hit, p) { #{ line_width: 1 / hit.object_id } }");
    let (shaders, _) = Shaders::compile(&scene, &Host::new()).unwrap_or_else(|faults| panic!("{faults}"));
    let mut shading = Shading::new(&scene, &shaders);
    shading.shade(MaterialId(0), &batch, OutputSet::all(), &mut outputs, &mut errors);
    let zeros = batch.object_id.iter().filter(|id| **id == 0).count() as u64;
    assert_eq!((shading.evaluations(), shading.kernel_hits()), (zeros, 1000));
}

#[test]
fn plug_ins_run_in_kernels() {
    let bricks = |uv: Vec2, mortar: f32| if uv.x.fract() < mortar { 0.0 } else { 1.0 };
    let host = Host::new()
        .with_function(NativeFunction::new("bricks", bricks).with_batch(move |columns, out| {
            let [u, v, mortar] = columns else { return };
            for (row, x) in out[0].iter_mut().enumerate() {
                *x = bricks(Vec2::new(u[row], v[row]), mortar[row]);
            }
        }))
        .with_function(NativeFunction::new("tinted", |color: Vec3, on: bool, n: i64| -> Result<Vec3, String> {
            if n == 3 { Err("three is not allowed".into()) } else { Ok(if on { color * n as f32 } else { color }) }
        }));
    let script = "fn surface(hit, p) {
            let w = bricks(hit.uv, 0.25) + bricks(vec2(1.5, 0), 1);
            #{ line_width: w, color: tinted(hit.normal, hit.front_facing, hit.object_id) }
        }";
    let scene = scene(script);
    let batch = hits(300, &mut Random(9));
    let shade = |mode| {
        let (shaders, _) = Shaders::compile_for(&scene, &host, mode).unwrap_or_else(|faults| panic!("{faults}"));
        let (mut outputs, mut errors) = (OutputBatch::default(), ShadeErrors::default());
        Shading::new(&scene, &shaders).shade(MaterialId(0), &batch, OutputSet::all(), &mut outputs, &mut errors);
        (format!("{:?} {:?}", outputs.line_width, outputs.color), errors.into_diagnostics().to_string())
    };
    let kernel = shade(ShadingMode::Kernel);
    assert_eq!(kernel, shade(ShadingMode::Interpreter));
    assert!(kernel.1.contains("three is not allowed"), "{}", kernel.1);
}
