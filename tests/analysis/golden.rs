//! One test for each construct.

use super::{analysis, assert_dump, body, rgb};
use tusche::shade::Value;

#[test]
fn literals() {
    let found = body("#{ roughness: 0.4, priority: 3, base_color: vec3(0.1, 0.2, 0.3), metallic: 1 }");
    assert_dump(
        &found,
        "inputs: none
         base_color: always, [0.1, 0.3], constant
         metallic: always, [1.0, 1.0], constant
         roughness: always, [0.4, 0.4], constant
         priority: always, [3.0, 3.0], constant",
    );
    assert!(found.is_constant());
}

#[test]
fn empty_record_writes_nothing() {
    assert_dump(&body("#{}"), "inputs: none");
}

#[test]
fn inputs_and_arithmetic() {
    assert_dump(
        &body("let n = hit.normal; #{ feature: n * 0.5 + vec3(0.5), line_width: 2.0 - clamp(hit.uv.x, 0.0, 1.0) }"),
        "inputs: normal uv
         feature: always, [-4.7683716e-7, 1.0000005], from normal
         line_width: always, [1.0, 2.0], from uv",
    );
}

#[test]
fn parameters_are_constants() {
    let script = "fn surface(hit, p) { #{ roughness: p.rough * 0.5, base_color: p.paint, line_width: p[\"width\"] } }";
    let params = [("rough", Value::Float(0.5)), ("paint", rgb(1.0, 0.5, 0.0)), ("width", Value::Int(2))];
    assert_dump(
        &analysis(script, &params),
        "inputs: none
         base_color: always, [0.0, 1.0], constant
         roughness: always, [0.25, 0.25], constant
         line_width: always, [2.0, 2.0], constant",
    );
}
