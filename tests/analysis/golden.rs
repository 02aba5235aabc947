//! One test for each construct: the dump of what is known of a small script.

use super::{analysis, assert_dump, rgb, texture_ref};
use tusche::shade::Value;

fn params() -> Vec<(&'static str, Value)> {
    let nested = [("deep".to_owned(), Value::Float(0.25))].into();
    vec![
        ("rough", Value::Float(0.5)),
        ("paint", rgb(1.0, 0.5, 0.0)),
        ("width", Value::Int(2)),
        ("on", Value::Bool(true)),
        ("mode", Value::Text("flat".into())),
        ("nested", Value::Record(nested)),
        ("none", Value::Unit),
        ("map", texture_ref(0)),
        ("map2", texture_ref(1)),
    ]
}

#[track_caller]
fn assert_script(script: &str, expected: &str) {
    let script =
        if script.starts_with("fn ") { script.to_owned() } else { format!("fn surface(hit, p) {{ {script} }}") };
    assert_dump(&analysis(&script, &params()), expected);
}

#[test]
fn literals_are_constants() {
    assert_script(
        "let n = 2; const M = 0.25; #{ roughness: 0.4, priority: n + 1, base_color: vec3(0.1, 0.2, M), metallic: 1 }",
        "inputs: none
         base_color: always, [0.1, 0.25], constant
         metallic: always, [1.0, 1.0], constant
         roughness: always, [0.4, 0.4], constant
         priority: always, [3.0, 3.0], constant",
    );
}

#[test]
fn inputs_have_bounds() {
    assert_script(
        "#{
            aov_position: hit.position, aov_normal: hit.normal, aov_depth: hit.depth, aov_id: hit.object_id % 4,
            aov_time: hit.time, aov_front: if hit.front_facing { 1.0 } else { 0.0 }, aov_irradiance: luminance(hit.irradiance),
            aov_weights: hit.barycentric,
        }",
        "inputs: position normal object_id barycentric depth front_facing time irradiance
         aov_depth: always, [0.0, 1e18], from depth
         aov_front: always, [0.0, 1.0], from front_facing
         aov_id: always, [0.0, 3.0], from object_id
         aov_irradiance: always, [0.0, 1e18], from irradiance
         aov_normal: always, [-1.000001, 1.000001], from normal
         aov_position: always, [-1e18, 1e18], from position
         aov_time: always, [-1e18, 1e18], from time
         aov_weights: always, [-0.001, 1.001], from barycentric",
    );
}

#[test]
fn parameters_are_constants() {
    assert_script(
        r#"fn surface(hit, p) { #{ roughness: p.rough * 0.5, base_color: p.paint, line_width: p["width"], metallic: if p.on { p.nested.deep } else { 1.0 } } }"#,
        "inputs: none
         base_color: always, [0.0, 1.0], constant
         metallic: always, [0.25, 0.25], constant
         roughness: always, [0.25, 0.25], constant
         line_width: always, [2.0, 2.0], constant",
    );
}

#[test]
fn branches_on_parameters_are_decided() {
    assert_script(
        r#"fn surface(hit, p) {
            let out = #{ roughness: p.rough };
            if p.none != () { out.metallic = hit.texture(p.none).b; }
            if p.map != () { out.base_color = hit.texture(p.map).rgb; }
            if p.mode == "flat" && !p.on { out.color = hit.color.rgb; } else if p.rough < 0.6 { out.specular = 0.5; }
            out
        }"#,
        "inputs: uv
         base_color: always, [0.0, 0.8], from uv
         roughness: always, [0.5, 0.5], constant
         specular: always, [0.5, 0.5], constant",
    );
}

#[test]
fn textures_have_the_range_of_their_pixels() {
    assert_script(
        "fn surface(hit, p) {
            #{ base_color: hit.texture(p.map).rgb, metallic: hit.texture(p.map2).b, aov_uv: texture(p.map, hit.position.xy).a }
        }",
        "inputs: position uv more_uvs
         base_color: always, [0.0, 0.8], from uv
         metallic: always, [0.0, 0.0], from more_uvs
         aov_uv: always, [1.0, 1.0], constant",
    );
}

#[test]
fn a_branch_adds_its_condition() {
    assert_script(
        "let a = 0.2; let b = 0.5; let c = 0.5;
         if hit.uv.x > 0.5 { a = 0.8; b = 0.5; c = 0.5; } else { b = 0.5; }
         #{ roughness: a, metallic: b, specular: c, line_width: if hit.front_facing { 1.0 } else { hit.distance } }",
        "inputs: uv distance front_facing
         metallic: always, [0.5, 0.5], constant
         roughness: always, [0.2, 0.8], from uv
         specular: always, [0.5, 0.5], constant
         line_width: always, [0.0, 1e18], from distance front_facing",
    );
}

#[test]
fn ints_and_floats_mix() {
    assert_script(
        "let w = 1; if hit.front_facing { w = 0.5; } #{ line_width: w * 2, roughness: 3 / 2, metallic: 3 / 2.0 }",
        "inputs: front_facing
         metallic: always, [1.5, 1.5], constant
         roughness: always, [1.0, 1.0], constant
         line_width: always, [1.0, 2.0], from front_facing",
    );
}

#[test]
fn keys_can_be_there_sometimes() {
    assert_script(
        r#"let out = #{ roughness: 0.3 };
         if hit.path_kind == "camera" { out.line_width = 2.0; }
         out.feature = hit.normal; out["aov_" + "x"] = 1.0;
         out"#,
        "inputs: normal path_kind
         roughness: always, [0.3, 0.3], constant
         feature: always, [-1.000001, 1.000001], from normal
         line_width: sometimes, [2.0, 2.0], from path_kind
         aov_x: always, [1.0, 1.0], constant",
    );
}

#[test]
fn an_early_return_is_a_branch() {
    assert_script(
        "if hit.depth > 10.0 { return #{ opacity: 0.0 }; }
         if false { return #{ metallic: 1.0 }; }
         #{ opacity: 1.0, roughness: 0.5 }",
        "inputs: depth
         roughness: sometimes, [0.5, 0.5], from depth
         opacity: always, [0.0, 1.0], from depth",
    );
}

#[test]
fn channels_can_be_set() {
    assert_script(
        "let v = vec3(0.1, 0.2, 0.3); v.x = 0.5; v.yz += vec2(0.5, 0.5); v.z *= saturate(hit.time);
         #{ base_color: v, aov_swizzle: v.zx, aov_index: v[0] }",
        "inputs: time
         base_color: always, [0.0, 0.8], from time
         aov_index: always, [0.5, 0.5], constant
         aov_swizzle: always, [0.0, 0.8], from time",
    );
}

#[test]
fn records_nest() {
    assert_script(
        "let look = #{ ink: #{ width: 2.0, color: rgb(0, 0, 0) } };
         look.ink.width *= 1.5; if hit.front_facing { look.ink.color = rgb(1, 0, 0); }
         #{ line_width: look.ink.width, line_color: look.ink.color } + #{ priority: 2 }",
        "inputs: front_facing
         line_color: always, [0.0, 1.0], from front_facing
         line_width: always, [3.0, 3.0], constant
         priority: always, [2.0, 2.0], constant",
    );
}

#[test]
fn arrays_are_followed() {
    assert_script(
        "let widths = [1.0, 2.0, hit.uv.x]; widths[1] = 3.0; #{ line_width: widths[hit.polygon_id % 2], roughness: widths[1], metallic: [0.1, 0.2].len() }",
        "inputs: uv polygon_id
         metallic: always, [2.0, 2.0], constant
         roughness: always, [3.0, 3.0], constant
         line_width: always, [-1e18, 1e18], from uv polygon_id",
    );
}

#[test]
fn switch_on_a_parameter_is_decided() {
    assert_script(
        r#"fn surface(hit, p) {
            let r = switch p.mode { "flat" if hit.front_facing => 0.25, "flat" => 0.5, "cel" => hit.time, _ => 1.0 };
            #{ roughness: r, metallic: switch p.width { 0..=1 => hit.time, 2..=4 => 0.5, _ => hit.time } }
        }"#,
        "inputs: front_facing
         metallic: always, [0.5, 0.5], constant
         roughness: always, [0.25, 0.5], from front_facing",
    );
}

#[test]
fn switch_on_an_input_may_take_any_case() {
    assert_script(
        "let out = #{};
         switch hit.polygon_id { 0 => out.roughness = 0.1, 1..5 if hit.front_facing => out.roughness = 0.2, _ => out.metallic = 0.3 }
         out",
        "inputs: polygon_id front_facing
         metallic: sometimes, [0.3, 0.3], from polygon_id front_facing
         roughness: sometimes, [0.1, 0.2], from polygon_id front_facing",
    );
}

#[test]
fn short_loops_are_walked_round_by_round() {
    assert_script(
        "let sum = 0.0; let amplitude = 0.5;
         for octave in 0..4 { sum += amplitude * value_noise(hit.position * (octave + 1)); amplitude *= 0.5; }
         let n = 0; while n < 3 { n += 1; }
         #{ roughness: sum, metallic: amplitude, priority: n }",
        "inputs: position
         metallic: always, [0.03125, 0.03125], constant
         roughness: always, [0.0, 0.9375], from position
         priority: always, [3.0, 3.0], constant",
    );
}

#[test]
fn long_loops_keep_what_every_round_keeps() {
    assert_script(
        "let sum = 0.0; let least = 1.0; let count = 0; let untouched = 0.5;
         for i in 0..1000 { sum += hit.uv.x; least = min(least, 0.5); count += 1; }
         #{ roughness: saturate(sum), metallic: least, priority: count, specular: untouched, aov_sum: sum }",
        "inputs: uv
         metallic: always, [0.5, 1.0], constant
         roughness: always, [0.0, 1.0], from uv
         specular: always, [0.5, 0.5], constant
         priority: always, [0.0, 9.223373e18], constant
         aov_sum: always, [-inf, inf], from uv",
    );
}

#[test]
fn loops_over_lights() {
    assert_script(
        "let light = 0.0;
         for i in 0..hit.light_count { let l = hit.light(i); light += luminance(l.radiance * l.visibility) * max(0.0, dot(hit.normal, l.direction)); }
         #{ roughness: saturate(light), feature: gray(step(0.1, light)), aov_light: light }",
        "inputs: normal light_count light
         roughness: always, [0.0, 1.0], from normal light_count light
         feature: always, [0.0, 1.0], from normal light_count light
         aov_light: always, [0.0, inf], from normal light_count light",
    );
}

#[test]
fn break_and_continue() {
    assert_script(
        "let r = 0.0;
         loop { r += 0.25; if r > 0.6 { break; } }
         let s = 0.0; for i in 0..3 { if hit.uv.x > i { continue; } if hit.uv.y > i { break; } s += 0.25; }
         let t = 0.0; do { t += 0.5; } while t < 2.0;
         #{ roughness: r, metallic: s, line_width: t }",
        "inputs: uv
         metallic: always, [0.0, 0.75], from uv
         roughness: always, [0.75, 0.75], constant
         line_width: always, [2.0, 2.0], constant",
    );
}

#[test]
fn functions_are_walked_at_each_call() {
    assert_script(
        "fn rim(hit, power) { let facing = abs(dot(hit.normal, hit.incoming)); if power == 1.0 { return facing; } pow(facing, power) }
         fn doubled() { this *= 2.0; this + 1.0 }
         fn surface(hit, p) { let w = 1.5; let v = w.doubled(); #{ roughness: rim(hit, 1.0), metallic: rim(hit, 2.0), line_width: w, aov_v: v } }",
        "inputs: normal incoming
         metallic: always, [0.0, 1.0000092], from normal incoming
         roughness: always, [0.0, 1.000004], from normal incoming
         line_width: always, [3.0, 3.0], constant
         aov_v: always, [4.0, 4.0], constant",
    );
}

#[test]
fn a_function_can_write_keys() {
    assert_script(
        "fn ink(out, width) { out.line_width = width; out }
         fn surface(hit, p) { let out = #{ roughness: 1.0 }; let inked = ink(out, 3.0); inked += #{ metallic: 0.0 }; inked }",
        "inputs: none
         metallic: always, [0.0, 0.0], constant
         roughness: always, [1.0, 1.0], constant
         line_width: always, [3.0, 3.0], constant",
    );
}

#[test]
fn unit_vectors_stay_so() {
    assert_script(
        "let r = reflect(hit.incoming, hit.normal);
         #{ aov_reflected: r, aov_facing: dot(hit.normal, -hit.incoming), aov_between: dot(normalize(hit.position - vec3(0.0, 1.0, 0.0)), hit.normal), aov_length: length(r) }",
        "inputs: position normal incoming
         aov_between: always, [-1.2500038, 1.2500038], from position normal
         aov_facing: always, [-1.000004, 1.000004], from normal incoming
         aov_length: always, [0.0, 1.000008], from normal incoming
         aov_reflected: always, [-1.0000069, 1.0000069], from normal incoming",
    );
}

#[test]
fn library_bounds() {
    assert_script(
        "let x = hit.uv.x;
         #{ aov_a: clamp(x, 0.2, 0.8), aov_b: step(0.5, x), aov_c: smoothstep(0.1, 0.2, x), aov_d: mix(0.25, 0.75, saturate(x)),
            aov_e: fract(x), aov_f: 0.5 + 0.5 * sin(x), aov_g: hash(hit.polygon_id), aov_h: hash_color(hit.uv), aov_i: fbm(hit.position, 3),
            aov_j: cellular_noise(hit.uv), aov_k: hsv(x, 1.0, 0.5), aov_l: remap(saturate(x), 0.0, 1.0, 2.0, 4.0), aov_m: sqrt(x), aov_n: 1.0 / x,
            aov_o: ramp(x, [[0.0, rgb(0.1, 0.2, 0.3)], [1.0, rgb(0.4, 0.5, 0.6)]]), aov_p: min(x, 2.0), aov_q: PI * 0.0 + abs(x),
            aov_r: exp(saturate(x)), aov_s: mod(x, 3.0), aov_t: sign(x), aov_u: floor(saturate(x) * 4.0) }",
        "inputs: position uv polygon_id
         aov_a: always, [0.2, 0.8], from uv
         aov_b: always, [0.0, 1.0], from uv
         aov_c: always, [0.0, 1.0], from uv
         aov_d: always, [0.24999924, 0.75000083], from uv
         aov_e: always, [0.0, 1.0], from uv
         aov_f: always, [0.0, 1.0], from uv
         aov_g: always, [0.0, 1.0], from polygon_id
         aov_h: always, [0.0, 1.0], from uv
         aov_i: always, [-1.0, 1.0], from position
         aov_j: always, [0.0, 1.5], from uv
         aov_k: always, [0.0, 0.5], from uv
         aov_l: always, [2.0, 4.0], from uv
         aov_m: always, from uv
         aov_n: always, from uv
         aov_o: always, [0.09999959, 0.6000007], from uv
         aov_p: always, [-1e18, 2.0], from uv
         aov_q: always, [0.0, 1e18], from uv
         aov_r: always, [0.9999989, 2.7182848], from uv
         aov_s: always, [-1000000060000.0, 1000000060000.0], from uv
         aov_t: always, [-1.0, 1.0], from uv
         aov_u: always, [0.0, 4.0], from uv",
    );
}

#[test]
fn plug_ins_are_pure_and_unknown() {
    assert_script(
        "#{ roughness: my_plug_in(hit.uv), metallic: my_constant, specular: clamp(hit.uv.x.my_method(2), 0.0, 1.0) }",
        "inputs: uv
         metallic: always, constant
         roughness: always, from uv
         specular: always, from uv",
    );
}

#[test]
fn hit_handed_to_a_plug_in_is_read_whole() {
    assert_script(
        "#{ roughness: my_plug_in(hit), metallic: 0.5 }",
        "inputs: all
         metallic: always, [0.5, 0.5], constant
         roughness: always, from all",
    );
}

#[test]
fn a_container_that_a_function_changes() {
    assert_script(
        "let a = [0.5, 0.25]; a.push(hit.uv.x); a.sort(); #{ roughness: a[0], metallic: 0.5 }",
        "inputs: uv
         metallic: always, [0.5, 0.5], constant
         roughness: always, from uv",
    );
}

#[test]
fn a_dynamic_key_makes_it_incomplete() {
    assert_script(
        r#"let out = #{}; out[if hit.front_facing { "roughness" } else { "metallic" }] = 1.0; out"#,
        "inputs: all
         incomplete: 1:105: what `surface` returns, which is not always a record with known keys, cannot be analysed",
    );
}

#[test]
fn recursion_is_given_up() {
    assert_script(
        "fn f(n) { if n <= 0 { 1.0 } else { f(n - 1) * 0.5 } }
         fn surface(hit, p) { #{ roughness: f(hit.polygon_id) } }",
        "inputs: all
         incomplete: 1:36: a function that calls itself, or calls nested this deep cannot be analysed",
    );
}

#[test]
fn bounded_recursion_is_followed() {
    assert_script(
        "fn f(n) { if n <= 0 { 1.0 } else { f(n - 1) * 0.5 } }
         fn surface(hit, p) { #{ roughness: f(3) } }",
        "inputs: none
         roughness: always, [0.125, 0.125], constant",
    );
}

#[test]
fn try_is_given_up() {
    assert_script(
        "try { throw 1; } catch { } #{}",
        "inputs: all
         incomplete: 1:22: `try` cannot be analysed",
    );
}

#[test]
fn closures_share_what_they_capture() {
    assert_script(
        "let k = 2.0; let f = |x| x * k; #{ roughness: f.call(1.0) }",
        "inputs: none
         roughness: always, [2.0, 2.0], constant",
    );
    assert_script(
        "let k = 2.0; let f = |x| x * k; k = hit.barycentric.x; #{ roughness: f.call(1.0), metallic: f.call(0.5) }",
        "inputs: barycentric
         metallic: always, [-0.0005, 0.5005], from barycentric
         roughness: always, [-0.001, 1.001], from barycentric",
    );
    assert_script(
        "let n = 0; let f = || { n += 1; n }; f.call(); if hit.front_facing { f.call(); } #{ priority: n }",
        "inputs: front_facing
         priority: always, [1.0, 2.0], from front_facing",
    );
    assert_script(
        "let a = 1.0; let f = |x| x + a; let g = |x| f.call(x) * 2.0; a = 3.0; let n = 0.0;
         for i in 0..3 { let h = |x| g.call(x) + n; n = h.call(1.0); }
         #{ roughness: n }",
        "inputs: none
         roughness: always, [24.0, 24.0], constant",
    );
    assert_script(
        "let n = 0.0; for i in 0..hit.light_count { let h = |x| x + i; n = saturate(h.call(n)); } #{ roughness: n }",
        "inputs: light_count
         roughness: always, [0.0, 1.0], from light_count",
    );
}

#[test]
fn captured_variables_are_copied_by_calls() {
    // The engine passes a copy of a shared variable where it would pass a variable itself.
    assert_script(
        "let a = [1.0]; let f = || a.len(); push(a, 2.0); #{ priority: a.len(), roughness: f.call() }",
        "inputs: all
         incomplete: 1:70: `push`, which would change a variable that a closure captures, cannot be analysed",
    );
}

#[test]
fn eval_is_given_up() {
    assert_script(
        r#"#{ roughness: eval("hit.uv.x") }"#,
        "inputs: all
         incomplete: 1:36: `eval` cannot be analysed",
    );
}

#[test]
fn a_throw_is_no_way_out() {
    assert_script(
        r#"if hit.uv.x > 0.5 { throw "bad"; } #{ roughness: 0.5 }"#,
        "inputs: uv
         roughness: always, [0.5, 0.5], constant",
    );
}

#[test]
fn no_way_out_writes_nothing() {
    assert_script("throw hit.uv.x;", "inputs: uv");
}

#[test]
fn what_is_no_record() {
    assert_script(
        "if hit.front_facing { #{ roughness: 0.5 } }",
        "inputs: all
         incomplete: 1:22: what `surface` returns, which is not always a record with known keys, cannot be analysed",
    );
}

#[test]
fn unknown_names_are_found() {
    assert_script(
        "fn surface(hit, p) {
    let n = hit.norml;
    if p.none != () { let dead = hit.nothing; }
    let out = #{ rougness: p.rouhg, line_color: hit.light };
    out.prioritty = 3;
    for i in 0..2 { out.aov_x = hit.uvw; }
    out
}",
        "inputs: all
         line_color: always, from all
         aov_x: always, from all
         finding 2:17: there is no input `norml` on `hit` (did you mean `normal`?)
         finding 4:18: there is no output `rougness` (did you mean `roughness`?)
         finding 4:30: there is no parameter `rouhg` (did you mean `rough`?)
         finding 4:53: there is no input `light` on `hit`
         finding 5:9: there is no output `prioritty` (did you mean `priority`?)
         finding 6:37: there is no input `uvw` on `hit` (did you mean `uv`?)",
    );
}

#[test]
fn null_conditional_and_coalesce() {
    assert_script(
        "fn surface(hit, p) { #{ roughness: p.none?.x ?? 0.5, metallic: p.rough ?? hit.uv.x } }",
        "inputs: none
         metallic: always, [0.5, 0.5], constant
         roughness: always, [0.5, 0.5], constant",
    );
}

#[test]
fn shadowing() {
    assert_script(
        "let x = 0.1; { let x = hit.uv.x; x += 1.0; } let y = x; let x = 0.3; #{ roughness: y, metallic: x }",
        "inputs: uv
         metallic: always, [0.3, 0.3], constant
         roughness: always, [0.1, 0.1], constant",
    );
}

#[test]
fn text_is_followed_while_constant() {
    assert_script(
        r#"fn surface(hit, p) { let name = p.mode + "_look"; #{ roughness: if name == "flat_look" { 0.5 } else { hit.uv.x }, metallic: if hit.path_kind == "shadow" { 0.0 } else { 1.0 } } }"#,
        "inputs: path_kind
         metallic: always, [0.0, 1.0], from path_kind
         roughness: always, [0.5, 0.5], constant",
    );
}

/// Scripts that would keep a walk busy for ever, or fill the memory or the stack.
#[test]
fn hostile_scripts_end() {
    let nested =
        |depth: usize, inner: &str| format!("{}{inner}{}", "if hit.front_facing { ".repeat(depth), " }".repeat(depth));
    let doubling: String = (1..40).map(|i| format!("fn f{i}(x) {{ f{}(x) + f{0}(x) }} ", i - 1)).collect();
    let scripts = [
        "let r = #{}; for i in 0..60 { r = #{ a: r, b: r }; } if hit.front_facing { r = #{ a: 1 }; } r".to_owned(),
        "let r = []; for i in 0..60 { r = [r, r, hit]; } #{ roughness: r }".to_owned(),
        "let r = #{}; while hit.front_facing { r = #{ a: r, b: r }; } r".to_owned(),
        "let t = \"x\"; for i in 0..64 { t += t; } #{ roughness: if t == \"y\" { 1 } else { 2 } }".to_owned(),
        "let n = 0; for a in 0..60 { for b in 0..60 { for c in 0..60 { for d in 0..60 { n += 1; } } } } #{ priority: n }".to_owned(),
        "loop { } #{}".to_owned(),
        "let i = 0; while i >= 0 { i += 1; } #{ priority: i }".to_owned(),
        format!("let x = 0; {} #{{ priority: x }}", nested(40, "x += 1;")),
        format!("{doubling} fn f0(x) {{ x }} fn surface(hit, p) {{ #{{ roughness: f39(hit.time) }} }}"),
        format!("fn f(x) {{ {} f(x) }} fn surface(hit, p) {{ f(hit) }}", "if x.front_facing { x.time } else { 1.0 } + ".repeat(20)),
    ];
    for script in scripts {
        let script = if script.starts_with("fn ") { script } else { format!("fn surface(hit, p) {{ {script} }}") };
        let started = std::thread::Builder::new().stack_size(2 << 20).spawn(move || analysis(&script, &[]));
        let found = started.expect("threads can be started").join().expect("the analysis does not panic");
        assert!(found.outputs.len() > 1);
    }
}
