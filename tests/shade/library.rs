//! What the functions and operators of the library mean.

use super::*;
use proptest::prelude::*;
use tusche::math::portable;
use tusche::shade::library;

/// Asserts that an expression gives a number or a vec3 exactly.
fn assert_gives(expression: &str, expected: impl Into<Given>) {
    assert_eq!(value(expression), expected.into().0, "{expression}");
}

struct Given(Vec3);

impl From<f32> for Given {
    fn from(x: f32) -> Self {
        Self(Vec3::splat(x))
    }
}

impl From<[f32; 3]> for Given {
    fn from(v: [f32; 3]) -> Self {
        Self(v.into())
    }
}

/// Asserts that a condition holds.
fn assert_holds(condition: &str) {
    assert_gives(&format!("if {condition} {{ 1 }} else {{ 0 }}"), 1.0);
}

#[test]
fn vectors_are_made_of_parts() {
    assert_gives("vec3(1, 2.5, 3)", [1.0, 2.5, 3.0]);
    assert_gives("vec3(2)", 2.0);
    assert_gives("vec3(vec2(1, 2), 3)", [1.0, 2.0, 3.0]);
    assert_gives("vec3(1, vec2(2, 3))", [1.0, 2.0, 3.0]);
    assert_gives("vec3(vec4(1, 2, 3, 4))", [1.0, 2.0, 3.0]);
    assert_gives("vec4(vec2(1, 2), vec2(3, 4)).yzw", [2.0, 3.0, 4.0]);
    assert_gives("vec4(vec3(1, 2, 3), 4).www", 4.0);
    assert_gives("vec3(vec2(vec3(1, 2, 3)), 0)", [1.0, 2.0, 0.0]);
    assert_gives("gray(1)", 1.0);
    assert_gives("rgb(1, 0, 0)", [1.0, 0.0, 0.0]);
}

#[test]
fn vectors_join_vectors_and_numbers() {
    assert_gives("vec3(1, 2, 3) + vec3(10, 20, 30)", [11.0, 22.0, 33.0]);
    assert_gives("vec3(1, 2, 3) - 1", [0.0, 1.0, 2.0]);
    assert_gives("1.0 - vec3(1, 2, 3)", [0.0, -1.0, -2.0]);
    assert_gives("vec3(1, 2, 3) * vec3(2, 3, 4)", [2.0, 6.0, 12.0]);
    assert_gives("2 * vec3(1, 2, 3)", [2.0, 4.0, 6.0]);
    assert_gives("vec3(2, 4, 6) / 2.0", [1.0, 2.0, 3.0]);
    assert_gives("12 / vec3(2, 4, 6)", [6.0, 3.0, 2.0]);
    assert_gives("-vec3(1, 2, 3)", [-1.0, -2.0, -3.0]);
    assert_gives("{ let v = vec3(1, 2, 3); v += 1; v *= vec3(2, 2, 1); v -= 0.5; v /= 2; v }", [1.75, 2.75, 1.75]);
    assert_holds("vec2(1, 2) == vec2(1.0, 2.0) && vec2(1, 2) != vec2(2, 1) && vec3(0, 0, 0) != ()");
}

#[test]
fn parts_are_read_and_set() {
    assert_gives("vec3(1, 2, 3).zyx", [3.0, 2.0, 1.0]);
    assert_gives("vec4(1, 2, 3, 4).bgr", [3.0, 2.0, 1.0]);
    assert_gives("vec4(1, 2, 3, 4).a", 4.0);
    assert_gives("vec2(1, 2).yyx", [2.0, 2.0, 1.0]);
    assert_gives("vec3(1, 2, 3)[1]", 2.0);
    assert_gives("{ let v = vec3(1, 2, 3); v.y = 9; v }", [1.0, 9.0, 3.0]);
    assert_gives("{ let v = vec3(1, 2, 3); v.zx = vec2(7, 8); v }", [8.0, 2.0, 7.0]);
    assert_gives("{ let v = vec3(1, 2, 3); v.x += 1; v.rg *= 2; v[2] = 0; v }", [4.0, 4.0, 0.0]);
    assert_gives("{ let r = #{ c: vec3(1, 2, 3) }; r.c.x = 5; r.c }", [5.0, 2.0, 3.0]);
}

#[test]
fn numbers() {
    assert_gives("mix(0, 1, 0.25)", 0.25);
    assert_gives("mix(vec3(0, 1, 2), 10, 0.5)", [5.0, 5.5, 6.0]);
    assert_gives("mix(rgb(0, 0, 0), rgb(1, 1, 1), vec3(0.0, 0.5, 1.0))", [0.0, 0.5, 1.0]);
    assert_gives("clamp(5, 0, 3) / 2", 1.0);
    assert_gives("clamp(vec3(-1, 0.5, 2), 0, 1)", [0.0, 0.5, 1.0]);
    assert_gives("saturate(vec3(-1, 0.5, 2))", [0.0, 0.5, 1.0]);
    assert_gives("step(0.5, vec3(0.25, 0.5, 0.75))", [0.0, 1.0, 1.0]);
    assert_gives("smoothstep(0, 4, vec3(-1, 1, 5))", [0.0, 0.15625, 1.0]);
    assert_gives("smoothstep(1, 1, vec3(0, 1, 2))", [0.0, 1.0, 1.0]);
    assert_gives("remap(15, 10, 20, 0, 4)", 2.0);
    assert_gives("abs(vec3(-1, 0, 2))", [1.0, 0.0, 2.0]);
    assert_gives("sign(vec3(-3, 0, 2))", [-1.0, 0.0, 1.0]);
    assert_gives("floor(vec3(-1.5, 1.5, 2))", [-2.0, 1.0, 2.0]);
    assert_gives("ceil(vec3(-1.5, 1.5, 2))", [-1.0, 2.0, 2.0]);
    assert_gives("round(vec3(-1.5, 1.4, 2.5))", [-2.0, 1.0, 3.0]);
    assert_gives("fract(vec3(-0.25, 1.25, 2))", [0.75, 0.25, 0.0]);
    assert_gives("mod(vec3(-1, 4, 5.5), 3)", [2.0, 1.0, 2.5]);
    assert_gives("vec3(min(2, 3), max(2, 3), min(2.5, 2))", [2.0, 3.0, 2.0]);
    assert_gives("vec3(mod(-1, 3), mod(1, -3), -1 % 3)", [2.0, -2.0, -1.0]);
    assert_gives("vec3(to_int(2.9), to_int(-2.9), to_float(7) / 2)", [2.0, -2.0, 3.5]);
    assert_gives("vec3(PI, TAU, radians(180) - PI)", [std::f32::consts::PI, std::f32::consts::TAU, 0.0]);
}

#[test]
fn geometry() {
    assert_gives("dot(vec3(1, 2, 3), vec3(4, 5, 6))", 32.0);
    assert_gives("dot(vec4(1, 2, 3, 4), vec4(1, 1, 1, 1)) + dot(vec2(1, 2), vec2(3, 4))", 21.0);
    assert_gives("cross(vec3(1, 0, 0), vec3(0, 1, 0))", [0.0, 0.0, 1.0]);
    assert_gives("length(vec2(3, 4)) + distance(vec3(1, 1, 1), vec3(1, 1, 3))", 7.0);
    assert_gives("normalize(vec3(0, 3, 4))", [0.0, 0.6, 0.8]);
    assert_gives("normalize(vec3(0, 0, 0))", 0.0);
    assert_gives("reflect(vec3(1, -1, 0), vec3(0, 1, 0))", [1.0, 1.0, 0.0]);
    assert_gives("refract(vec3(0, -1, 0), vec3(0, 1, 0), 1.5)", [0.0, -1.0, 0.0]);
    assert_gives("refract(vec3(0.8, -0.6, 0), vec3(0, 1, 0), 1.5)", 0.0);
    let bent = value("refract(vec3(0.6, -0.8, 0), vec3(0, 1, 0), 1 / 1.5)");
    assert!(bent.abs_diff_eq(Vec3::new(0.4, -(1.0_f32 - 0.16).sqrt(), 0.0), 1e-6), "{bent}");
}

#[test]
fn colors() {
    assert_gives("luminance(rgb(1, 1, 1))", 0.2126 + 0.7152 + 0.0722);
    assert_gives("hsv(0, 1, 1)", [1.0, 0.0, 0.0]);
    assert_gives("hsv_from_rgb(rgb(0, 0.5, 0))", [1.0 / 3.0, 1.0, 0.5]);
    assert_gives("srgb(0, 1, 0.5)", [0.0, 1.0, portable::pow((0.5 + 0.055) / 1.055, 2.4)]);
    assert_gives("srgb(rgb(0, 1, 0)) - srgb(0, 1, 0)", 0.0);
}

#[test]
fn ramps() {
    let at = |t: &str, kind: &str| value(&format!("ramp({t}, [[0, 1.0], [2, 3.0], [2, 7.0]]{kind})"));
    assert_eq!(at("-5", "").x, 1.0);
    assert_eq!(at("0.5", "").x, 1.5);
    assert_eq!(at("0.5", ", \"constant\"").x, 1.0);
    assert_eq!(at("0.5", ", \"smooth\"").x, 1.0 * (1.0 - 0.15625) + 3.0 * 0.15625);
    assert_eq!(at("2", "").x, 7.0);
    assert_eq!(at("9", "").x, 7.0);
    assert_gives("ramp(0.5, [[0, rgb(1, 0, 0)], [1, rgb(0, 0, 1)]])", [0.5, 0.0, 0.5]);
}

#[test]
fn hashes() {
    assert_holds("hash(7) == hash(7) && hash(7) != hash(8) && hash(vec2(1, 2)) != hash(vec2(2, 1))");
    let color = value("hash_color(hit.polygon_id)");
    assert!(color.x != color.y && color.y != color.z && color.min_element() >= 0.0 && color.max_element() < 1.0);
}

#[test]
fn noise_has_its_stated_range_and_is_smooth() {
    let body = |noise: &str| {
        format!(
            "{{ let low = 100.0; let high = -100.0; let step = 0.0; let last = (); \
               for i in 0..2000 {{ \
                 let n = {noise}; \
                 low = min(low, n); high = max(high, n); \
                 if last != () {{ step = max(step, abs(n - last)); }} last = n; }} \
               vec3(low, high, step) }}"
        )
    };
    let along = "vec3(i * 0.0137, i * 0.0071, 3.3)";
    let across = "vec2(i * 0.0137, i * 0.0071)";
    for (noise, low, high) in
        [("value_noise", 0.0, 1.0), ("gradient_noise", -1.0, 1.0), ("cellular_noise", 0.0, 1.5), ("cell_id", 0.0, 1.0)]
    {
        for point in [along, across] {
            let range = value(&body(&format!("{noise}({point})")));
            assert!(range.x >= low && range.y <= high, "{noise} {range}");
            assert!(range.y - range.x > 0.5 * (high - low) * 0.8, "{noise} {range}");
            assert!(noise == "cell_id" || range.z < 0.1, "{noise} {range}");
        }
    }
    let range = value(&body(&format!("fbm({along}, 4)")));
    assert!(range.x >= -1.0 && range.y <= 1.0 && range.y - range.x > 0.5, "{range}");
    assert_gives("gradient_noise(vec3(1, 2, 3))", 0.0);
}

#[test]
fn noise_takes_any_float() {
    for point in ["vec3(1e30, -1e30, 0)", "vec2(-1e30, 3e38)", "vec3(16777217, 0, 0)"] {
        for noise in ["value_noise", "gradient_noise", "cellular_noise", "cell_id"] {
            assert!(value(&format!("{noise}({point})")).is_finite(), "{noise}({point})");
        }
        assert!(value(&format!("fbm({point}, 10)")).is_finite());
    }
    assert!(value("value_noise(vec2(0.0 / 0.0, 0))").is_nan());
    assert!(value("fbm(vec3(0, 0, 1.0 / 0.0), 3)").is_finite());
}

/// The same bits on every machine: what the noise and hash functions gave when they were written.
#[test]
fn noise_and_hashes_keep_their_bits() {
    let bits = |expression: &str| value(expression).to_array().map(f32::to_bits);
    let known = [
        ("vec3(value_noise(vec2(0.3, 0.7)), gradient_noise(vec2(0.3, 0.7)), cellular_noise(vec2(0.3, 0.7)))", BITS[0]),
        (
            "vec3(value_noise(vec3(9.3, -4.7, 0.1)), gradient_noise(vec3(9.3, -4.7, 0.1)), cell_id(vec3(9.3, -4.7, 0.1)))",
            BITS[1],
        ),
        ("vec3(fbm(vec3(9.3, -4.7, 0.1), 4), hash(12), hash(vec2(0.5, 3)))", BITS[2]),
        ("vec3(sin(1.25), 2.5 ** 0.3, exp(0.7))", BITS[3]),
    ];
    let found: Vec<_> = known.iter().map(|(expression, _)| bits(expression)).collect();
    assert_eq!(found, known.map(|(_, bits)| bits));
}

const BITS: [[u32; 3]; 4] = [
    [1_056_215_014, 3_188_583_297, 1_024_971_184],
    [1_061_837_419, 3_199_609_286, 1_056_327_517],
    [3_193_086_349, 1_053_304_320, 1_064_781_935],
    [1_064_497_320, 1_068_007_222, 1_073_799_507],
];

#[test]
fn transcendentals_are_the_portable_ones() {
    let x = 1.2345_f32;
    for (name, expected) in [
        ("sin", portable::sin(x)),
        ("cos", portable::cos(x)),
        ("tan", portable::tan(x)),
        ("atan", portable::atan(x)),
        ("sinh", portable::sinh(x)),
        ("cosh", portable::cosh(x)),
        ("tanh", portable::tanh(x)),
        ("exp", portable::exp(x)),
        ("exp2", portable::exp2(x)),
        ("ln", portable::ln(x)),
        ("log", portable::log10(x)),
        ("log2", portable::log2(x)),
        ("sqrt", x.sqrt()),
    ] {
        assert_gives(&format!("{name}(1.2345)"), expected);
    }
    assert_gives("asin(0.3) + acos(0.3)", portable::asin(0.3) + portable::acos(0.3));
    assert_gives("sqrt(4) + exp(0) + sin(0) + ln(1)", 3.0);
    assert_gives("atan(1, 2)", portable::atan2(1.0, 2.0));
    assert_gives("log(8, 2)", portable::ln(8.0) / portable::ln(2.0));
    assert_gives("pow(2, 10)", 1024.0);
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(64))]

    /// `**` is `math::portable`, whatever the operands and wherever they stand, and never folded by the parser.
    #[test]
    fn powers_are_the_portable_ones(x in 0.0_f32..50.0, y in -5.0_f32..5.0, n in 0_i64..6) {
        let (a, b) = (format!("{x:?}"), format!("{y:?}"));
        prop_assert_eq!(value(&format!("{a} ** {b}")).x, portable::pow(x, y));
        prop_assert_eq!(value(&format!("{a} ** {n}")).x, portable::pow(x, n as f32));
        prop_assert_eq!(value(&format!("{n} ** {b}")).x, portable::pow(n as f32, y));
        prop_assert_eq!(value(&format!("{{ let v = {a}; v **= {b}; v }}")).x, portable::pow(x, y));
        prop_assert_eq!(value(&format!("pow({a}, {b})")).x, portable::pow(x, y));
        prop_assert_eq!(value(&format!("{n} ** 3")).x, (n * n * n) as f32);
    }

    /// Comparisons of floats are exact, also where Rhai's own take near for equal.
    #[test]
    fn comparisons_are_exact(x in -2.0_f32..2.0, ulps in -2_i32..3, scale in prop::sample::select(vec![1.0_f32, 1e-9, 1e9])) {
        let a = x * scale;
        let b = f32::from_bits(a.to_bits().wrapping_add_signed(ulps));
        for (operator, expected) in
            [("==", a == b), ("!=", a != b), ("<", a < b), ("<=", a <= b), (">", a > b), (">=", a >= b)]
        {
            let found = value(&format!("if {a:?} {operator} {b:?} {{ 1 }} else {{ 0 }}")).x == 1.0;
            prop_assert_eq!(found, expected, "{:?} {} {:?}", a, operator, b);
        }
    }
}

#[test]
fn comparisons_of_what_is_no_number() {
    assert_holds("!(0.0 / 0.0 == 0.0 / 0.0) && 0.0 / 0.0 != 0.0 / 0.0 && !(0.0 / 0.0 < 1.0)");
    assert_holds("1.0 / 0.0 > 1 && 1 < 1.0 / 0.0 && 2 == 2.0 && 2.5 > 2 && is_nan(0.0 / 0.0)");
    assert_holds("1e-9 > 0.0 && 1e-9 != 0");
}

#[test]
fn textures() {
    assert_gives("hit.texture(p.map).rgb", [0.5, 0.25, 0.75]);
    assert_gives("texture(p.map, vec2(3, 4)).a", 0.5);
    assert_holds("p.map != () && p.map == p.map");
}

#[test]
fn every_function_of_the_list_is_there() {
    let names: std::collections::BTreeSet<_> = library::functions().map(|function| function.name).collect();
    assert!(names.len() > 50);
    for name in names {
        // With far too many arguments no function fits, but its name is known, so its forms are told.
        let said = complaint(&format!("fn surface(hit, p) {{ {name}(1, 1, 1, 1, 1, 1, 1) }}"));
        assert!(said.contains("it is called as"), "{name}: {said}");
        // And with no more than a text, it is there but refuses it; an unknown function would not be.
        assert!(!said.contains("there is no function"), "{name}: {said}");
    }
}

#[test]
fn functions_of_a_rust_user_are_called() {
    let host = Host::new().with(|engine| {
        engine.register_fn("stripes", |x: f32, n: f32| (x * n).fract());
    });
    let (outputs, errors) =
        shade(&scene(&["fn surface(hit, p) { #{ line_width: stripes(0.75, 3.0) } }"]), &host, &batch(1));
    assert!(errors.is_empty());
    assert_eq!(outputs.line_width, [Some(0.25)]);
}

#[test]
fn patterns() {
    assert_gives("stripes(0.5, 0.3)", 1.0);
    assert_gives("stripes(1, 0.3)", 0.0);
    assert_gives("stripes(0.5, 0.3, 100)", 0.3);
    assert_gives("checker(vec2(0.5, 1.5))", 1.0);
    assert_gives("checker(vec3(0.5, 1.5, -0.5), 0)", 0.0);
    assert_gives("checker(vec2(1, 1), 2)", 0.5);
    assert_gives("dots(vec2(3.5, 2.5), 0.1)", 1.0);
    assert_gives("dots(vec2(3, 2), 0.5)", 0.0);
    assert_gives("hatch(vec2(0, 0.5), 0.1)", 1.0);
    assert_gives("cross_hatch(vec2(0.5, 0), 0.9)", 1.0);
    assert_gives("cross_hatch(vec2(0.5, 0), 0.4)", 0.0);
    assert_holds("length(rotate(vec2(1, 0), PI / 2) - vec2(0, 1)) < 0.000001");
}

#[test]
fn worley_and_layered_noise() {
    assert_holds("worley(hit.position * 3.0).x == cellular_noise(hit.position * 3.0)");
    assert_holds("worley(vec2(0.3, 7.2)).y >= 0.0 && worley(hit.uv).x < 1.5");
    for octaves in 1..=10 {
        assert_holds(&format!("fbm(hit.position * 7.0, {octaves}, 2.0, 0.5) == fbm(hit.position * 7.0, {octaves})"));
        assert_holds(&format!("fbm(hit.uv * 7.0, {octaves}, 2, 0.5) == fbm(hit.uv * 7.0, {octaves})"));
    }
    assert_holds("fbm(hit.position, 4, 3.0, 0.3) != fbm(hit.position, 4)");
    assert_holds("is_nan(worley(vec2(0.0 / 0.0, 1)).x)");
}

#[test]
fn wrong_arguments_of_patterns_and_colors() {
    for (expression, said) in [
        ("stripes(vec2(1, 2), 0.5)", "it is called as `stripes(x, width)`"),
        ("stripes(0.5, 0.5, \"a\")", "it is called as `stripes(x, width, filter)`"),
        ("checker(1.0)", "it is called as `checker(point)`"),
        ("checker(vec4(1.0), 0.1)", "it is called as `checker(point, filter)`"),
        ("dots(vec3(1.0), 0.5)", "`dots` cannot be called with (vec3, float)"),
        ("hatch(hit.uv, hit.uv)", "`hatch` cannot be called with (vec2, vec2)"),
        ("cross_hatch(1, 2, 3)", "`cross_hatch` cannot be called with (int, int, int)"),
        ("rotate(vec3(1.0), 1)", "`rotate` cannot be called with (vec3, int)"),
        ("worley(1.0)", "`worley` cannot be called with (float)"),
        ("fbm(hit.uv, 11, 2.0, 0.5)", "`fbm` takes 1 to 10 octaves, not 11"),
        ("fbm(hit.uv, 3, 0.5, 0.5)", "`fbm` takes a lacunarity of 1 to 4, not 0.5"),
        ("fbm(hit.uv, 3, 2.0, -1)", "`fbm` takes a gain of 0 to 1, not -1"),
        ("hsl(hit.uv, 1, 1)", "`hsl` cannot be called with (vec2, int, int)"),
        ("oklab(\"a\", 1, 1)", "`oklab` cannot be called with"),
        ("mix_oklab(rgb(1, 0, 0), 1.0, 0.5)", "it is called as `mix_oklab(a, b, t)`"),
        ("temperature(rgb(1, 0, 0))", "`temperature` cannot be called with (vec3)"),
        ("srgb_from_rgb(1.0)", "it is called as `srgb_from_rgb(color)`"),
    ] {
        let found = complaint(&format!("fn surface(hit, p) {{\n    #{{ aov_x: {expression} }}\n}}"));
        assert!(found.contains(said) && found.contains("first.rhai:2:"), "{expression}: {found}");
    }
}

#[test]
fn color_spaces() {
    assert_gives("hsl(0.0, 1.0, 0.5)", [1.0, 0.0, 0.0]);
    assert_gives("hsl_from_rgb(rgb(1, 0, 0))", [0.0, 1.0, 0.5]);
    assert_holds(
        "srgb_from_rgb(rgb(0, 1, 7)).r == 0.0 && length(srgb_from_rgb(rgb(0, 1, 7)) - rgb(0, 1, 1)) < 0.000001",
    );
    assert_holds("length(srgb(srgb_from_rgb(rgb(0.2, 0.5, 0.9))) - rgb(0.2, 0.5, 0.9)) < 0.000001");
    assert_holds("length(oklab(oklab_from_rgb(rgb(0.2, 0.5, 0.9))) - rgb(0.2, 0.5, 0.9)) < 0.00001");
    assert_holds("length(oklch(oklch_from_rgb(rgb(0.2, 0.5, 0.9))) - rgb(0.2, 0.5, 0.9)) < 0.00001");
    let middle = "oklab_from_rgb(mix_oklab(rgb(0, 0, 1), rgb(1, 1, 1), 0.5))";
    let mean = "(oklab_from_rgb(rgb(0, 0, 1)) + oklab_from_rgb(rgb(1, 1, 1))) / 2";
    assert_holds(&format!("length({middle} - {mean}) < 0.00001"));
    assert_holds("temperature(2000).r == 1.0 && temperature(2000).b < 0.1");
}
