//! What scripts make of lines: `line(pair, p)`, as a kernel and by the interpreter.

use tusche::math::Vec3;
use tusche::sample::PairBatch;
use tusche::scene::ids::MaterialId;
use tusche::scene::settings::LineType;
use tusche::shade::{Host, LineStyles, Mode, PairSet, ShadeErrors, Shaders, Shading, ShadingMode, synthetic};

use super::agree::{self, Random, Verdict, scene};

/// A script with this body of `line`.
fn script(body: &str) -> String {
    format!(
        "fn params() {{ #{{ ink: rgb(0.2, 0.1, 0.6), far: 40.0 }} }}\nfn surface(hit, p) {{ #{{ line_width: 3.0 }} }}\nfn line(pair, p) {{ {body} }}"
    )
}

fn compile(script: &str) -> Result<Shaders, String> {
    let compiled = Shaders::compile(&scene(script), &Host::new());
    compiled.map(|(shaders, _)| shaders).map_err(|faults| faults.to_string())
}

fn style(script: &str, mode: ShadingMode, pairs: &PairBatch) -> (LineStyles, String, u64) {
    let scene = scene(script);
    let (shaders, _) = Shaders::compile_for(&scene, &Host::new(), mode).unwrap_or_else(|faults| panic!("{faults}"));
    let (mut styles, mut errors) = (LineStyles::default(), ShadeErrors::default());
    let mut shading = Shading::new(&scene, &shaders);
    shading.style(MaterialId(0), pairs, &mut styles, &mut errors);
    (styles, errors.into_diagnostics().to_string(), shading.evaluations())
}

#[test]
fn every_construct_gives_the_same_bits() {
    for body in [
        "#{}",
        "#{ color: p.ink }",
        "#{ opacity: pair.distance, color: pair.color * pair.opacity }",
        "if pair.kind == \"crease\" { return #{ opacity: 0.5 }; } #{ color: pair.other.feature }",
        "#{ opacity: switch pair.kind { \"outline\" | \"silhouette\" => 1.0, \"uv\" => 0.25, _ => 0.5 } }",
        "#{ opacity: if pair.path_kind == \"reflection\" && pair.own { 0.5 } else { 1 } }",
        "#{ color: mix(pair.color, p.ink, smoothstep(0.0, p.far, pair.depth)), opacity: 1.0 - pair.distance ** 2 }",
        "let o = pair.other; #{ color: abs(o.normal - pair.normal), opacity: o.depth - pair.depth }",
        "#{ color: hash_color(pair.object_id * 31 + pair.other.object_id), opacity: value_noise(pair.pixel * 0.25) }",
        "pair.color = vec3(1); let q = pair; q.color.x = 0.5; #{ color: q.color + pair.color }",
        "#{ opacity: if pair.other.object_id == 0 { pair.material_id } else { pair.other.material_id / pair.object_id } }",
        "let s = 0.0; for i in 0..pair.object_id { s += i * pair.width; } #{ opacity: s }",
        "#{ color: pair.position - pair.other.position, opacity: pair.feature.g }",
    ] {
        let script = script(body);
        for (seed, len) in [(1, 1), (2, 16), (3, 37), (4, 700)] {
            let verdict = agree::compare_lines(&script, &agree::pairs(len, &mut Random(seed)));
            assert_eq!(verdict, Ok(Verdict::Agrees), "{body}");
        }
        assert_eq!(compile(&script).expect("it compiles").of(MaterialId(0)).line_mode(), Some(Mode::Kernel), "{body}");
    }
    let one = "fn surface(hit, p) { #{} } fn line(pair) { #{ opacity: pair.distance } }";
    assert_eq!(agree::compare_lines(one, &agree::pairs(20, &mut Random(5))), Ok(Verdict::Agrees));
}

#[test]
fn it_means_what_it_says() {
    let pairs = synthetic::pairs(300, 7);
    let body = "#{ opacity: if pair.kind == \"outline\" { pair.distance } else { 1.0 }, color: vec3(pair.depth) }";
    let (styles, errors, evaluations) = style(&script(body), ShadingMode::Auto, &pairs);
    assert_eq!((errors.as_str(), evaluations), ("", 0));
    for row in 0..pairs.len {
        let opacity = if pairs.kind[row] == LineType::Outline { pairs.distance[row] } else { 1.0 };
        assert_eq!(styles.opacity[row], opacity);
        assert_eq!(styles.color[row], Some(Vec3::splat(pairs.sides[0].depth[row])));
    }
    let (styles, ..) = style(&script("#{}"), ShadingMode::Auto, &pairs);
    assert_eq!((styles.color, styles.opacity), (vec![None; 300], vec![1.0; 300]));
}

#[test]
fn only_what_is_read_is_asked_for() {
    let needs = |body: &str| compile(&script(body)).expect("it compiles").of(MaterialId(0)).pair_needs();
    assert_eq!(needs("#{}"), PairSet::empty());
    assert_eq!(needs("let n = pair.normal; #{ opacity: pair.other.depth * 0.1 }"), PairSet::DEPTH);
    assert_eq!(needs("#{ color: pair.normal, opacity: pair.distance }"), PairSet::NORMAL | PairSet::DISTANCE);
    // Where it may fail, the interpreter may have to run, which reads all.
    assert_eq!(needs("#{ opacity: 3 / pair.object_id }"), PairSet::all());
    let opacity = |body: &str| compile(&script(body)).expect("it compiles").of(MaterialId(0)).changes_line_opacity();
    assert!(!opacity("#{ color: pair.normal }") && opacity("if pair.own { #{ opacity: 0.5 } } else { #{} }"));
    let none = compile("fn surface(hit, p) { #{} }").expect("it compiles");
    assert!(!none.of(MaterialId(0)).styles_lines());
}

#[test]
fn what_is_wrong_is_said_at_its_place() {
    let fault = |body: &str| compile(&script(body)).map(|_| ()).expect_err("it is wrong");
    for (body, message, hint) in [
        ("#{ opacity: pair.dept }", "there is no `dept` on `pair`", "did you mean `depth`?"),
        ("#{ opacity: pair.other.kind }", "there is no `kind` on `pair`", ""),
        ("#{ line_width: 2.0 }", "`line` gives no `line_width`", "it gives `color` and `opacity`; all else"),
        ("#{ opacty: 2.0 }", "`line` gives no `opacty`", "did you mean `opacity`?"),
        ("#{ color: p.inc }", "there is no parameter `inc`", "did you mean `ink`?"),
    ] {
        let text = fault(body);
        assert!(text.contains(message) && text.contains(hint) && text.contains("random.rhai:3:"), "{body}: {text}");
    }
    let count = compile("fn surface(hit, p) { #{} } fn line(a, b, c) { #{} }").map(|_| ()).expect_err("three");
    assert!(count.contains("`line` must have 2 or 1 parameters, but it has 3"), "{count}");
}

#[test]
fn lines_that_fail_get_the_marker_and_the_message() {
    let pairs = synthetic::pairs(100, 3);
    let failing = (0..100).filter(|row| pairs.sides[1].object[*row] == 0).count();
    assert!(failing > 0);
    for mode in [ShadingMode::Auto, ShadingMode::Interpreter] {
        let (styles, errors, evaluations) = style(&script("#{ opacity: 6 / pair.other.object_id }"), mode, &pairs);
        for row in 0..100 {
            let other = pairs.sides[1].object[row];
            let divided = 6_u32.checked_div(other);
            let expected = divided.map_or((Some(Vec3::new(1.0, 0.0, 1.0)), 1.0), |x| (None, x as f32));
            assert_eq!((styles.color[row], styles.opacity[row]), expected);
        }
        assert!(
            errors.to_lowercase().contains("division by zero") && errors.contains(&format!("{failing} hits")),
            "{errors}"
        );
        assert_eq!(evaluations, if mode == ShadingMode::Auto { failing as u64 } else { 100 });
    }
    let (styles, errors, _) = style(&script("loop { } #{}"), ShadingMode::Auto, &pairs);
    assert!(errors.contains("operations"), "{errors}");
    assert_eq!(styles.color, vec![Some(Vec3::new(1.0, 0.0, 1.0)); 100]);
    let (_, errors, _) = style(&script("let x = 3; x"), ShadingMode::Auto, &pairs);
    assert!(errors.contains("`line` must return a record, but it returned int"), "{errors}");
}
