//! Batches in, batches out.

use super::*;
use tusche::shade::{InputSet, Mode};

fn compile(scene: &Scene) -> Shaders {
    Shaders::compile(scene, &Host::new()).unwrap_or_else(|faults| panic!("{}", rendered(&faults))).0
}

#[test]
fn every_input_is_read() {
    let gives = |expression: &str, expected: [f32; 3]| {
        assert_eq!(value(expression), Vec3::from(expected), "{expression}");
    };
    gives("hit.position", [0.0, 0.5, -0.25]);
    gives("hit.normal", [0.0, 1.0, 0.0]);
    gives("hit.geometric_normal", [0.0, 1.0, 0.0]);
    gives("hit.incoming", [0.0, -0.6, -0.8]);
    gives("vec3(hit.uv, 0)", [0.0, 0.3, 0.0]);
    gives("hit.tangent.xyz * hit.tangent.w", [1.0, 0.0, 0.0]);
    gives("hit.color.rga", [0.2, 0.4, 0.8]);
    gives("vec3(hit.object_id, hit.shader_id, hit.polygon_id)", [1.0, 1.0, 0.0]);
    gives("hit.barycentric", [0.2, 0.3, 0.5]);
    gives("vec3(hit.distance, hit.depth, hit.time)", [2.0, 5.0, 1.5]);
    gives("vec3(hit.pixels_per_unit, hit.curvature, hit.material_id)", [100.0, 0.5, 1.0]);
    gives("if hit.front_facing && hit.path_kind == \"reflection\" { 1 } else { 0 }", [1.0; 3]);
    gives("vec3(hit.light_count, hit.light(1).visibility, 0)", [2.0, 0.5, 0.0]);
    gives("hit.light(0).radiance", [1.0, 0.5, 0.25]);
    gives("hit.light(1).direction", [1.0, 0.0, 0.0]);
    // The second light comes from the side and gives nothing.
    gives("hit.irradiance", [1.0, 0.5, 0.25]);
}

#[test]
fn every_named_input_has_a_getter() {
    for (name, _) in InputSet::named().filter(|(_, input)| !InputSet::CALLED.contains(*input)) {
        let (_, errors) =
            shade(&scene(&[&format!("fn surface(hit, p) {{ let x = hit.{name}; #{{}} }}")]), &Host::new(), &batch(1));
        assert!(errors.is_empty(), "{name}: {}", rendered(&errors.into_diagnostics()));
    }
}

#[test]
fn outputs_are_converted_and_the_rest_is_default() {
    let script = "fn surface(hit, p) { #{
        base_color: 0.5, metallic: 1, roughness: 0.25, feature: rgb(1, 2, 3), line_width: 3, priority: -7,
        opacity: 0.0 / 0.0, aov_mask: 1, aov_tint: rgb(0, 1, 0) } }";
    let (outputs, errors) = shade(&scene(&[script]), &Host::new(), &batch(2));
    assert!(errors.is_empty());
    assert_eq!(outputs.len, 2);
    assert_eq!(outputs.base_color, [Vec3::splat(0.5); 2]);
    assert_eq!(outputs.metallic, [1.0; 2]);
    assert_eq!(outputs.roughness, [0.25; 2]);
    assert_eq!(outputs.feature, [Vec3::new(1.0, 2.0, 3.0); 2]);
    assert_eq!(outputs.line_width, [Some(3.0); 2]);
    assert_eq!(outputs.priority, [Some(-7); 2]);
    assert!(outputs.opacity[0].is_nan(), "the gate stops it, not the host");
    assert_eq!(
        (outputs.specular[0], outputs.ior[0], outputs.transmission[0], outputs.occlusion[0]),
        (1.0, 1.5, 0.0, 1.0)
    );
    assert_eq!((outputs.emission[0], outputs.normal[0]), (Vec3::ZERO, None));
    assert_eq!((outputs.line_color[0], outputs.color[0]), (None, None));
    assert_eq!(outputs.aovs, [[Vec3::ONE; 2], [Vec3::Y; 2]]);
}

#[test]
fn only_wanted_columns_are_filled() {
    let scene = scene(&["fn surface(hit, p) { #{ base_color: 0.5, line_width: 3 } }"]);
    let shaders = compile(&scene);
    let mut shading = Shading::new(&scene, &shaders);
    let (mut outputs, mut errors) = (OutputBatch::default(), ShadeErrors::default());
    shading.shade(MaterialId(0), &batch(5), OutputSet::all(), &mut outputs, &mut errors);
    shading.shade(MaterialId(0), &batch(2), OutputSet::LINE_WIDTH, &mut outputs, &mut errors);
    assert_eq!(outputs.len, 2);
    assert_eq!(outputs.line_width.len(), 2);
    assert!(outputs.base_color.is_empty() && outputs.opacity.is_empty() && outputs.color.is_empty());
}

#[test]
fn a_key_may_be_left_out_at_some_hits() {
    let script = "fn surface(hit, p) { let out = #{}; if hit.polygon_id == 1 { out.line_width = 2; } out }";
    let (outputs, errors) = shade(&scene(&[script]), &Host::new(), &batch(3));
    assert!(errors.is_empty());
    assert_eq!(outputs.line_width, [None, Some(2.0), None]);
}

#[test]
fn a_failing_hit_gets_the_marker_and_the_others_their_values() {
    let script = "fn surface(hit, p) { #{ color: 0.25, line_width: 9.0, priority: 6 / (hit.polygon_id - 1) } }";
    let (outputs, errors) = shade(&scene(&[script]), &Host::new(), &batch(3));
    assert_eq!(outputs.color, [Some(Vec3::splat(0.25)), Some(Vec3::new(1.0, 0.0, 1.0)), Some(Vec3::splat(0.25))]);
    assert_eq!(outputs.line_width, [Some(9.0), Some(0.0), Some(9.0)]);
    assert_eq!(outputs.priority, [Some(-6), None, Some(6)]);
    assert_eq!(errors.errors.len(), 1);
}

#[test]
fn parameters_replace_defaults_and_ints_widen() {
    let script =
        "fn params() { #{ width: 1.0, paint: rgb(1, 0, 0), soft: false, name: \"a\", levels: 3, offset: vec2(0, 0),
            palette: [rgb(0, 0, 1), rgb(0, 1, 0)], nested: #{ deep: 0.5 } } }
        fn surface(hit, p) { #{
            line_width: p.width + p.levels, base_color: p.paint, roughness: if p.soft { 1 } else { 0 },
            metallic: if p.name == \"b\" { p.offset.y } else { 0 }, emission: p.palette[1], ior: p.nested.deep } }";
    let params = BTreeMap::from([
        ("width".to_owned(), (ParamValue::Int(4), None)),
        ("paint".to_owned(), (ParamValue::Vec3(Vec3::new(0.1, 0.2, 0.3)), None)),
        ("soft".to_owned(), (ParamValue::Bool(true), None)),
        ("name".to_owned(), (ParamValue::Text("b".into()), None)),
        ("offset".to_owned(), (ParamValue::Vec2(Vec2::new(0.5, 0.75)), None)),
    ]);
    let (outputs, errors) = shade(&scene_with(&[script], params), &Host::new(), &batch(1));
    assert!(errors.is_empty(), "{}", rendered(&errors.into_diagnostics()));
    assert_eq!(outputs.line_width, [Some(7.0)]);
    assert_eq!(outputs.base_color, [Vec3::new(0.1, 0.2, 0.3)]);
    assert_eq!((outputs.roughness[0], outputs.metallic[0], outputs.ior[0]), (1.0, 0.75, 0.5));
    assert_eq!(outputs.emission, [Vec3::Y]);
}

#[test]
fn arguments_may_have_any_name() {
    let (outputs, _) =
        shade(&scene(&["fn surface(point, knobs) { #{ line_width: point.depth } }"]), &Host::new(), &batch(1));
    assert_eq!(outputs.line_width, [Some(5.0)]);
}

#[test]
fn functions_return_loop_and_switch() {
    let script = "
        fn grade(x) { if x > 2 { return \"high\"; } \"low\" }
        fn surface(hit, p) {
            let sum = 0;
            for i in 0..5 { if i == 3 { continue; } sum += i; }
            let width = switch grade(sum) { \"high\" => 2.5, _ => 1.0 };
            const ROUGH = 0.5;
            if sum > 6 { return #{ line_width: width, roughness: ROUGH }; }
            #{}
        }";
    let (outputs, errors) = shade(&scene(&[script]), &Host::new(), &batch(2));
    assert!(errors.is_empty(), "{}", rendered(&errors.into_diagnostics()));
    assert_eq!(outputs.line_width, [Some(2.5); 2]);
    assert_eq!(outputs.roughness, [0.5; 2]);
}

#[test]
fn hits_do_not_see_each_other() {
    let script = "fn params() { #{ list: [1] } }
        fn surface(hit, p) { let l = p.list; l.push(2); #{ priority: l.len() } }";
    let (outputs, errors) = shade(&scene(&[script]), &Host::new(), &batch(3));
    assert!(errors.is_empty(), "{}", rendered(&errors.into_diagnostics()));
    assert_eq!(outputs.priority, [Some(2); 3]);
}

#[test]
fn materials_of_one_scene_keep_apart() {
    let scene = scene(&[
        "fn width() { 1 } fn surface(hit, p) { #{ line_width: width() } }",
        "fn width() { 2 } fn surface(hit, p) { #{ line_width: width() } }",
    ]);
    let shaders = compile(&scene);
    let mut shading = Shading::new(&scene, &shaders);
    let (mut outputs, mut errors) = (OutputBatch::default(), ShadeErrors::default());
    for round in 0..3 {
        for material in 0..2 {
            shading.shade(MaterialId(material), &batch(4), OutputSet::all(), &mut outputs, &mut errors);
            assert_eq!(outputs.line_width, [Some(material as f32 + 1.0); 4], "round {round}");
        }
    }
}

#[test]
fn a_constant_shader_is_run_once() {
    let scene = scene(&["fn params() { #{ width: 2.0 } } fn surface(hit, p) { #{ line_width: p.width } }"]);
    let shaders = compile(&scene);
    let mut shading = Shading::new(&scene, &shaders);
    let (mut outputs, mut errors) = (OutputBatch::default(), ShadeErrors::default());
    for _ in 0..3 {
        shading.shade(MaterialId(0), &batch(10), OutputSet::all(), &mut outputs, &mut errors);
        assert_eq!(outputs.line_width, [Some(2.0); 10]);
    }
    let expected = if shaders.of(MaterialId(0)).mode() == Mode::Constant { 1 } else { 30 };
    assert_eq!(shading.evaluations(), expected);
}

#[test]
fn threads_and_batches_change_no_bit() {
    let scene = scene(&["fn surface(hit, p) {
        let n = fbm(hit.position * 3, 4);
        #{ base_color: hsv(n, 0.5, 0.8), line_width: 2.0 ** n, feature: hash_color(hit.object_id) } }"]);
    let shaders = compile(&scene);
    let run = |len: usize| {
        let mut shading = Shading::new(&scene, &shaders);
        let (mut outputs, mut errors) = (OutputBatch::default(), ShadeErrors::default());
        shading.shade(MaterialId(0), &batch(len), OutputSet::all(), &mut outputs, &mut errors);
        format!("{:?}{:?}{:?}", &outputs.base_color[..5], &outputs.line_width[..5], &outputs.feature[..5])
    };
    let here = run(5);
    std::thread::scope(|scope| {
        let threads: Vec<_> = (5..9).map(|len| scope.spawn(move || run(len))).collect();
        for thread in threads {
            assert_eq!(thread.join().expect("no panic"), here);
        }
    });
}

#[test]
fn needs_name_the_columns() {
    let inputs = InputSet::IRRADIANCE | InputSet::UV;
    assert_eq!(inputs.columns(), inputs | InputSet::LIGHT | InputSet::NORMAL);
    let scene = scene(&["fn surface(hit, p) { #{} }"]);
    let shaders = compile(&scene);
    let shader = shaders.of(MaterialId(0));
    assert_eq!((shader.name(), shader.script()), ("material 0", "first.rhai"));
    if !shader.analysis().complete {
        assert_eq!(shader.needs(OutputSet::all()), InputSet::all());
    }
}
