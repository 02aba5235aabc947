//! What is said when a script is wrong: one test for each message, with its place.

use super::*;
use tusche::diag::Span;

/// Asserts what is said of a script, without the trailing hint that counts the hits.
fn assert_said(script: &str, expected: &str) {
    let said = complaint(script);
    let mut lines: Vec<_> = said.lines().filter(|line| !line.contains("which got the marker colour")).collect();
    if !said.lines().any(|line| line.contains("= help") && lines.contains(&line)) && lines.last() == Some(&"  |") {
        lines.pop();
    }
    let expected: Vec<_> = expected.trim_matches('\n').lines().collect();
    assert_eq!(lines.join("\n"), expected.join("\n"), "\n{said}");
}

/// Asserts that a part of a surface body is blamed at a line and column, with words.
fn assert_blamed(body: &str, place: &str, words: &[&str]) {
    let said = complaint(&format!("fn surface(hit, p) {{\n    {body}\n}}"));
    assert!(said.contains(&format!("first.rhai:{place}\n")), "{body}: {said}");
    for word in words {
        assert!(said.contains(word), "{body}: no `{word}` in:\n{said}");
    }
}

#[test]
fn a_run_time_error_counts_its_hits() {
    let said = complaint("fn surface(hit, p) {\n    #{ feature: [1][hit.object_id] }\n}");
    assert!(said.contains(" --> first.rhai:2:"), "{said}");
    assert!(said.contains("  = help: this happened at 3 hits, which got the marker colour"), "{said}");
}

#[test]
fn what_is_certainly_wrong_is_said_before_anything_is_shaded() {
    let said = complaint("fn surface(hit, p) {\n    #{ feature: hit.positon }\n}");
    let expected = "\
error: there is no input `positon` on `hit`
 --> first.rhai:2:21
  |
2 |     #{ feature: hit.positon }
  |                     ^^^^^^^
  |
  = help: did you mean `position`?";
    assert_eq!(said, expected);
}

#[test]
fn syntax() {
    assert_said(
        "fn surface(hit, p) {\n    let x = ;\n}",
        "
error: unexpected ';'
 --> first.rhai:2:13
  |
2 |     let x = ;
  |             ^",
    );
    assert_said(
        "fn surface(hit, p) {\n    #{ base_color: 1.0 }\n",
        "
error: expected `;` to terminate this statement
 --> first.rhai:2:26
  |
2 |     #{ base_color: 1.0 }
  |                         ^
  |
  = help: the script ends here: is a closing `}` or `)` missing?",
    );
}

#[test]
fn missing_surface() {
    assert_said(
        "fn shade(hit, p) { #{} }",
        "
error: this shader has no function `surface`
 --> first.rhai:1:1
  |
1 | fn shade(hit, p) { #{} }
  | ^
  |
  = help: write: fn surface(hit, p) { #{ base_color: rgb(0.8, 0.2, 0.1) } }",
    );
    assert_said(
        "fn surface(hit) { #{} }",
        "
error: `surface` must have 2 parameters, but it has 1
 --> first.rhai:1:4
  |
1 | fn surface(hit) { #{} }
  |    ^^^^^^^
  |
  = help: write: fn surface(hit, p)",
    );
}

#[test]
fn statements_outside_functions() {
    let said = complaint("let ink = 2;\nfn surface(hit, p) { #{} }");
    assert!(said.contains("first.rhai:1:1\n"), "{said}");
    assert!(said.contains("only functions can stand at the top level of a shader"), "{said}");
}

#[test]
fn all_scripts_are_reported_at_once() {
    let scene = scene(&["fn surface(hit, p) { let }", "fn surface(hit) { #{} }"]);
    let faults = Shaders::compile(&scene, &Host::new()).expect_err("both are wrong");
    let places: Vec<_> =
        faults.0.iter().map(|fault| format!("{:?}", fault.span.as_ref().expect("each has a place"))).collect();
    assert_eq!(places, ["first.rhai:1:26", "second.rhai:1:4"]);
}

#[test]
fn unknown_parameter() {
    assert_said(
        "fn params() { #{ ink_width: 1.0 } }\nfn surface(hit, p) {\n    #{ line_width: p.ink_widht }\n}",
        "
error: there is no parameter `ink_widht`
 --> first.rhai:3:22
  |
3 |     #{ line_width: p.ink_widht }
  |                      ^^^^^^^^^
  |
  = help: did you mean `ink_width`?",
    );
    assert_blamed(
        "#{ line_width: p.thick }",
        "2:22",
        &["there is no parameter `thick`", "fn params() { #{ thick: 1.0 } }"],
    );
}

#[test]
fn a_parameter_of_another_script_is_unknown_too() {
    let scene = scene(&[
        "fn surface(hit, p) { #{ line_width: p.thick } }",
        "fn params() { #{ thick: 1.0 } } fn surface(hit, p) { #{ line_width: p.thick } }",
    ]);
    let faults = Shaders::compile(&scene, &Host::new()).expect_err("the first script has no such parameter");
    assert!(rendered(&faults).contains("there is no parameter `thick`"));
}

#[test]
fn unknown_output_key() {
    assert_said(
        "fn surface(hit, p) {\n    #{ bas_color: 1.0 }\n}",
        "
error: there is no output `bas_color`
 --> first.rhai:2:8
  |
2 |     #{ bas_color: 1.0 }
  |        ^^^^^^^^^
  |
  = help: did you mean `base_color`?",
    );
}

#[test]
fn wrong_output_type() {
    assert_said(
        "fn surface(hit, p) {\n    #{ base_color: \"red\" }\n}",
        "
error: the output `base_color` must be a vec3 or a number, but it is text
 --> first.rhai:2:8
  |
2 |     #{ base_color: \"red\" }
  |        ^^^^^^^^^^",
    );
    assert_blamed("#{ priority: 1.5 }", "2:8", &["the output `priority` must be an int, but it is float"]);
    assert_blamed("#{ priority: 3000000000 }", "2:8", &["must be within ±2147483647, but it is 3000000000"]);
    assert_blamed("#{ line_width: true }", "2:8", &["must be a number, but it is bool"]);
    assert_blamed("#{ normal: 1.0 }", "2:8", &["must be a vec3, but it is float"]);
    assert_blamed("#{ color: hit.color }", "2:8", &["but it is vec4", "take its first three with `.rgb`"]);
    assert_blamed("1.0", "1:4", &["`surface` must return a record, but it returned float"]);
    assert_blamed("let x = 1;", "1:4", &["but it returned ()"]);
}

#[test]
fn loops_without_an_end() {
    assert_said(
        "fn surface(hit, p) {\n    while true {}\n    #{}\n}",
        "
error: the script did not finish within 500000 operations
 --> first.rhai:2:16
  |
2 |     while true {}
  |                ^
  |
  = help: is there a loop without an end?",
    );
    let in_helper = complaint("fn spin() { loop {} }\nfn surface(hit, p) {\n    spin()\n}");
    assert!(in_helper.contains("first.rhai:3:5\n"), "{in_helper}");
    let in_params = complaint("fn params() { loop {} }\nfn surface(hit, p) { #{} }");
    assert!(in_params.contains("first.rhai:1:") && in_params.contains("did not finish"), "{in_params}");
}

#[test]
fn an_endless_shader_is_run_once_and_then_given_up() {
    let scene = scene(&["fn surface(hit, p) { loop {} }"]);
    let (shaders, _) = Shaders::compile(&scene, &Host::new()).expect("it compiles");
    let mut shading = Shading::new(&scene, &shaders);
    let (mut outputs, mut errors) = (OutputBatch::default(), ShadeErrors::default());
    for _ in 0..10 {
        shading.shade(MaterialId(0), &batch(100), OutputSet::all(), &mut outputs, &mut errors);
    }
    assert_eq!(shading.evaluations(), 1);
    assert_eq!(outputs.color, vec![Some(Vec3::new(1.0, 0.0, 1.0)); 100]);
    assert_eq!(errors.errors.values().map(|(_, count)| count).collect::<Vec<_>>(), [&1000]);
}

#[test]
fn recursion_without_an_end() {
    let said = complaint("fn down(n) { down(n + 1) }\nfn surface(hit, p) {\n    down(0)\n}");
    assert!(said.contains("functions call each other more than 8 deep"), "{said}");
    assert!(said.contains("first.rhai:3:5\n"), "{said}");
}

/// Calls inside calls, each inside as much of every kind of nesting as the parser lets through.
#[test]
fn the_deepest_allowed_nesting_fits_the_stack_of_a_thread() {
    for (open, close) in [
        ("(1 * ", ")"),
        ("abs(", ")"),
        ("if n >= 0 { ", " } else { 0 }"),
        ("for i in 0..1 { return ", " }"),
        ("{ let x = ", "; x }"),
        ("[", "][0]"),
        ("#{ a: ", " }.a"),
        ("switch n { -1 => 0, _ => ", " }"),
        ("1 + mix(0, ", ", 1.0)"),
    ] {
        let script = |depth: usize| {
            format!(
                "fn down(n) {{ {}if n > 6 {{ n }} else {{ down(n + 1) }}{} }} \
                 fn surface(hit, p) {{ #{{ line_width: down(0) }} }}",
                open.repeat(depth),
                close.repeat(depth)
            )
        };
        let compiles = |depth: &usize| Shaders::compile(&scene(&[&script(*depth)]), &Host::new()).is_ok();
        let depth = (1..99).rev().find(compiles).expect("a little nesting is allowed");
        assert!(depth >= 9, "{open}: {depth}");
        let run = move || rendered(&shade(&scene(&[&script(depth)]), &Host::new(), &batch(1)).1.into_diagnostics());
        let thread = std::thread::Builder::new().stack_size(3 << 19).spawn(run).expect("a thread starts");
        let said = thread.join().expect("three quarters of the usual stack are enough");
        assert!(said.is_empty(), "{open}: {said}");
    }
}

#[test]
fn things_too_large() {
    assert_blamed("let a = []; loop { a.push(1); }", "2:26", &["an array may have at most 1024 elements"]);
    assert_blamed("let a = []; a.pad(1000000000000, 1); #{}", "2:19", &["an array may have at most 1024 elements"]);
    assert_blamed("let s = \"ab\"; loop { s += s; }", "2:28", &["a text may have at most 4096 bytes"]);
    assert_blamed("let s = \"ab\"; loop { s = `${s}${s}`; }", "2:36", &["a text may have at most 4096 bytes"]);
}

#[test]
fn what_a_sandbox_has_not() {
    assert_blamed("eval(\"1\")", "2:5", &["`eval` is not available in shaders"]);
    assert_blamed("export hit; #{}", "2:5", &["a module has no variables to export"]);
    assert_blamed("let f = Fn(\"surface\"); #{}", "2:13", &["function pointers are not available in shaders"]);
    for name in ["sleep(1000000)", "timestamp()", "exit()", "open(\"x\")", "rand()"] {
        let function = name.split('(').next().expect("a name");
        assert_blamed(&format!("{name}; #{{}}"), "2:5", &[&format!("there is no function `{function}`")]);
    }
}

#[test]
fn arithmetic_of_ints() {
    assert_blamed("#{ priority: 1 / 0 }", "2:20", &["division by zero: 1 / 0"]);
    assert_blamed("#{ priority: 1 % 0 }", "2:20", &["modulo division by zero"]);
    assert_blamed("#{ priority: mod(1, 0) }", "2:18", &["mod(1, 0) has no value"]);
    assert_blamed("let x = 9223372036854775807; #{ priority: x + 1 }", "2:49", &["overflow"]);
    assert_blamed("#{ priority: to_int(1e30) }", "2:18", &["does not fit an int"]);
}

#[test]
fn indices_out_of_range() {
    assert_blamed(
        "let a = [1, 2]; #{ priority: a[2] }",
        "2:36",
        &["index 2 is out of range: the array has 2 elements"],
    );
    assert_blamed("#{ color: hit.light(2).radiance }", "2:19", &["light 2 is out of range: the scene has 2 lights"]);
    assert_blamed("#{ roughness: hit.uv[2] }", "2:25", &["index 2 is out of range: a vec2 has 2 components"]);
}

#[test]
fn unknown_functions_and_wrong_arguments() {
    assert_said(
        "fn surface(hit, p) {\n    #{ roughness: smoothstp(0, 1, 0.5) }\n}",
        "
error: there is no function `smoothstp`
 --> first.rhai:2:19
  |
2 |     #{ roughness: smoothstp(0, 1, 0.5) }
  |                   ^^^^^^^^^
  |
  = help: did you mean `smoothstep`?",
    );
    assert_said(
        "fn surface(hit, p) {\n    #{ roughness: mix(\"a\", hit.uv, 0.5) }\n}",
        "
error: `mix` cannot be called with (text, vec2, float)
 --> first.rhai:2:19
  |
2 |     #{ roughness: mix(\"a\", hit.uv, 0.5) }
  |                   ^^^
  |
  = help: it is called as `mix(a, b, t)`: a·(1 − t) + b·t",
    );
    assert_blamed(
        "#{ roughness: smoothstep(0, 1) }",
        "2:19",
        &["cannot be called with (int, int)", "smoothstep(low, high, x)"],
    );
    assert_blamed(
        "#{ roughness: mix(hit.uv, hit.normal, 0.5) }",
        "2:19",
        &["`mix` cannot be called with (vec2, vec3, float)"],
    );
    assert_blamed("#{ color: vec3(1, 2) }", "2:15", &["`vec3` cannot be called with (int, int)"]);
    assert_blamed("#{ color: vec3(1, 2, hit.uv) }", "2:15", &["`vec3` cannot be called with (int, int, vec2)"]);
    assert_blamed("#{ color: hit.normal + hit.uv }", "2:26", &["`+` does not work between vec3 and vec2"]);
    assert_blamed("#{ color: -\"a\" }", "2:15", &["`-` does not work on text"]);
    assert_blamed(
        "#{ color: hit.texture(()) }",
        "2:19",
        &["cannot be called with (hit, ())", "test `map != ()` first"],
    );
    assert_blamed("#{ roughness: fbm(hit.position, 100) }", "2:19", &["takes 1 to 10 octaves, not 100"]);
    assert_blamed("#{ roughness: value_noise(1.0) }", "2:19", &["`value_noise` cannot be called with (float)"]);
    let own = complaint("fn bend(x) { x }\nfn surface(hit, p) { #{ roughness: bend(1, 2) } }");
    assert!(own.contains("the script's own `bend` takes 1 parameters"), "{own}");
}

#[test]
fn ramps() {
    assert_blamed("#{ roughness: ramp(0.5, []) }", "2:19", &["a ramp needs at least one stop"]);
    assert_blamed("#{ roughness: ramp(0.5, [1, 2]) }", "2:19", &["must be a position and a value, not int"]);
    assert_blamed("#{ roughness: ramp(0.5, [[1, 1], [0, 1]]) }", "2:19", &["must not fall"]);
    assert_blamed("#{ roughness: ramp(0.5, [[0, 1], [1, hit.uv]]) }", "2:19", &["must be of one type"]);
    assert_blamed("#{ roughness: ramp(0.5, [[0, 1]], \"smoth\") }", "2:19", &["did you mean `smooth`?"]);
}

#[test]
fn parts_that_are_not_there() {
    assert_blamed("#{ roughness: hit.uv.z }", "2:26", &["a vec2 has no `z`", "its parts are x y, or r g"]);
    assert_blamed("let v = hit.uv; v.x = \"a\"; #{}", "2:23", &["takes a number, not text"]);
    assert_blamed("let v = hit.uv; v.xy = hit.normal; #{}", "2:23", &["takes a vec2 or a number, not vec3"]);
    assert_blamed(
        "let r = #{ width: 1 }; #{ roughness: r.widht }",
        "2:44",
        &["this record has no `widht`", "in record` tells"],
    );
    assert_blamed(
        "#{ color: hit.light(0).radiace }",
        "2:28",
        &["a light has no `radiace`", "did you mean `radiance`?"],
    );
    assert_blamed("#{ roughness: 1.0.foo }", "2:23", &["float has no `foo`"]);
}

#[test]
fn variables() {
    assert_blamed("#{ color: colour }", "2:15", &["there is no variable `colour` here"]);
    let helper = complaint("fn help() { hit.uv }\nfn surface(hit, p) { #{ color: help() } }");
    assert!(helper.contains("first.rhai:1:13\n") && helper.contains("pass `hit` on to it"), "{helper}");
}

#[test]
fn inputs_and_parameters_cannot_be_changed() {
    assert_blamed("hit.uv = vec2(0, 0); #{}", "2:9", &["the input `uv` cannot be changed"]);
    assert_blamed("hit.time += 1.0; #{}", "2:9", &["the input `time` cannot be changed"]);
    let params = complaint("fn params() { #{ x: 1 } }\nfn surface(hit, p) { p.x = 2; #{} }");
    assert!(params.contains("the parameter `x` cannot be changed") && params.contains("let x = p.x;"), "{params}");
}

#[test]
fn calls_are_traced() {
    let said = complaint("fn divide(n) { 1 / n }\nfn surface(hit, p) {\n    #{ priority: divide(0) }\n}");
    assert!(said.contains("first.rhai:1:18\n"), "{said}");
    assert!(said.contains("`divide` was called at line 3, column 18"), "{said}");
}

#[test]
fn a_script_may_stop_itself() {
    assert_blamed("throw \"no paint\"", "2:5", &["the script stopped itself: no paint"]);
}

#[test]
fn params_must_be_values() {
    let number = complaint("fn params() { 1 }\nfn surface(hit, p) { #{} }");
    assert!(number.contains("`params` must return a record, but it returned int"), "{number}");
    let range = complaint("fn params() { #{ r: 0..3 } }\nfn surface(hit, p) { #{} }");
    assert!(range.contains("first.rhai:1:18\n") && range.contains("the parameter `r` cannot be"), "{range}");
    let fails = complaint("fn params() { #{ r: 1 / 0 } }\nfn surface(hit, p) { #{} }");
    assert!(fails.contains("first.rhai:1:23\n"), "{fails}");
}

#[test]
fn material_parameters() {
    let file = Source::new("scene.toml", "ink_widht = 1\npaint = 2\nsoft = \"x\"\nmap = 3\nlevels = 1.5");
    let at = |line: usize| Some(Span::word_at(&file, line, 1));
    let params = BTreeMap::from([
        ("ink_widht".to_owned(), (ParamValue::Int(1), at(1))),
        ("paint".to_owned(), (ParamValue::Float(2.0), at(2))),
        ("soft".to_owned(), (ParamValue::Text("x".into()), at(3))),
        ("map".to_owned(), (ParamValue::Int(3), at(4))),
        ("levels".to_owned(), (ParamValue::Float(1.5), at(5))),
    ]);
    let script = "fn params() { #{ ink_width: 1.0, paint: rgb(1, 1, 1), soft: true, map: (), levels: 2 } }
        fn surface(hit, p) { #{} }";
    let faults = Shaders::compile(&scene_with(&[script], params), &Host::new()).expect_err("all are wrong");
    let said: Vec<_> = faults.0.iter().map(ToString::to_string).collect();
    assert_eq!(
        said,
        [
            "scene.toml:1:1: error: the shader first.rhai has no parameter `ink_widht` (did you mean `ink_width`?) \
             (the material is `material 0`)",
            "scene.toml:5:1: error: the parameter `levels` must be an int, not a number (the material is `material 0`)",
            "scene.toml:4:1: error: the parameter `map` must be a texture, not an int (the material is `material 0`)",
            "scene.toml:2:1: error: the parameter `paint` must be a vec3 or colour (three numbers), not a number \
             (the material is `material 0`)",
            "scene.toml:3:1: error: the parameter `soft` must be true or false, not a text \
             (the material is `material 0`)",
        ]
    );
}

#[test]
fn floods_are_merged_and_the_order_does_not_matter() {
    let scene = scene(&["fn surface(hit, p) { #{ priority: hit.object_id / 0 } }"]);
    let (shaders, _) = Shaders::compile(&scene, &Host::new()).expect("it compiles");
    let run = |first_object: u32| {
        let mut hits = batch(50);
        hits.object_id = (first_object..first_object + 50).collect();
        let (mut outputs, mut errors) = (OutputBatch::default(), ShadeErrors::default());
        Shading::new(&scene, &shaders).shade(MaterialId(0), &hits, OutputSet::all(), &mut outputs, &mut errors);
        errors
    };
    let (mut forward, mut backward) = (run(1), run(51));
    forward.merge(run(51));
    backward.merge(run(1));
    let said = rendered(&forward.into_diagnostics());
    assert_eq!(said, rendered(&backward.into_diagnostics()));
    assert!(said.contains("division by zero: 1 / 0") && said.contains("this happened at 100 hits"), "{said}");
}

#[test]
fn nesting_has_a_limit() {
    let body = format!("let x = {}1{}; #{{}}", "(".repeat(80), ")".repeat(80));
    assert_blamed(&body, "2:43", &["this is nested more than 64 levels deep", "give parts of it a name with `let`"]);
}

/// Whatever a script does, it ends in an error or a value, and nothing panics.
#[test]
fn hostile_scripts_end() {
    for body in [
        "let a = []; loop { a = [a]; }",
        "let a = [1]; loop { a.push(a); }",
        "let m = #{}; loop { m = #{ m: m }; }",
        "let m = #{}; loop { m.again = m; }",
        "let m = #{}; let a = []; loop { m = #{ a: a }; a = [m]; }",
        "let f = helper; loop { f = [f]; }",
        "let a = [3, 1, 2]; a.sort(helper); a.map(helper); #{}",
        "for i in 0..9223372036854775807 {}",
        "for i in range(0.0, 1e30, 1e-30) {}",
        "for i in range(0, 10, 0) {}",
        "let a = [1, 2, 3]; a.splice(-9, 99, [4]); a.extract(1..9223372036854775807); a.chop(-1); a.insert(99, 1); #{}",
        "let a = [1]; a.truncate(-1); a[-9223372036854775808]",
        "let x = 1 << 9223372036854775807; let y = 1 >> -9223372036854775808; #{ priority: x + y }",
        "let x = -9223372036854775808; #{ priority: abs(x) + -x }",
        "let x = 10 ** 100; #{}",
        "let x = 10 ** -1; #{}",
        "hit.light(-9223372036854775808)",
        "hit.uv[-1] = 3.0; #{}",
        "this.x = 1; #{}",
        "let v = hit.uv; v += v.x; v.yx = v; v[1] /= 0; #{ line_width: v.y }",
        "try { loop {} } catch { #{} }",
        "try { throw 1 } catch (error) { #{ line_width: error } }",
        "try { mix(1) } catch (error) { #{ line_width: error } }",
        "#{ priority: `${hit} ${p} ${hit.uv} ${hit.light(0)}`.len() }",
        "print(hit); debug(p); #{}",
        "type_of(hit) + is_def_fn(\"surface\", 2)",
        "hit",
        "p",
        "while true { surface(hit, p) }",
        "surface(hit, hit)",
        "let hit = hit; let p = 3; p.x = 1; #{}",
        "switch hit.depth { 5.0 => #{ line_width: 1 }, 0..10 => #{}, _ => 3 }",
        "",
    ] {
        let script = format!("fn helper(x) {{ x }} fn surface(hit, p) {{ {body} }}");
        let scene = scene(&[&script]);
        if let Ok((shaders, _)) = Shaders::compile(&scene, &Host::new()) {
            let (mut outputs, mut errors) = (OutputBatch::default(), ShadeErrors::default());
            let mut shading = Shading::new(&scene, &shaders);
            shading.shade(MaterialId(0), &batch(2), OutputSet::all(), &mut outputs, &mut errors);
            assert_eq!(outputs.color.len(), 2, "{body}");
        }
    }
}

proptest::proptest! {
    #![proptest_config(proptest::prelude::ProptestConfig::with_cases(300))]

    /// Text that is hardly a script gives an error with a place inside the text, or runs.
    #[test]
    fn any_text_is_taken(
        words in proptest::collection::vec(proptest::sample::select(vec![
            "fn", "surface", "(", "hit", ",", "p", ")", "{", "}", "#{", "base_color", ":", "1.0", ";", "let", "x", "=", "if",
            "else", "for", "in", "0..3", ".", "uv", "[", "]", "+", "-", "**", "\"", "'", "`", "//", "\n", "é", "switch", "=>",
            "params", "()", "return", "||", "const", "PI", "_", "eval", "import", "@", "?.", "?[", "...", "loop", "break",
        ]), 0..40)
    ) {
        let body = words.join(" ");
        for script in [body.clone(), format!("fn surface(hit, p) {{ {body} }}")] {
            let scene = scene(&[&script]);
            match Shaders::compile(&scene, &Host::new()) {
                Err(faults) => {
                    for fault in faults.0 {
                        let span = fault.span.clone().expect("every error of a script has a place");
                        proptest::prop_assert!(span.range.end <= script.len() && !fault.render(false).is_empty());
                    }
                }
                Ok((shaders, _)) => {
                    let (mut outputs, mut errors) = (OutputBatch::default(), ShadeErrors::default());
                    let mut shading = Shading::new(&scene, &shaders);
                    shading.shade(MaterialId(0), &batch(1), OutputSet::all(), &mut outputs, &mut errors);
                }
            }
        }
    }
}
