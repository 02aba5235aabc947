//! Native functions with static types: what scripts may do with them, and what is said when they are wrong.

use tusche::math::{Vec2, Vec3, Vec4};
use tusche::shade::{Host, NativeFunction, NativeType, NativeValue, OutputBatch, Package, Shaders};

use super::{batch, rendered, scene, shade};

fn given(host: &Host, expression: &str) -> Vec3 {
    let script = format!("fn surface(hit, p) {{ #{{ color: {expression} }} }}");
    let (outputs, errors) = shade(&scene(&[&script]), host, &batch(3));
    let faults = errors.into_diagnostics();
    assert!(faults.is_empty(), "{expression}: {}", rendered(&faults));
    outputs.color[0].expect("the script gives a colour")
}

fn told(host: &Host, expression: &str) -> String {
    let script = format!("fn surface(hit, p) {{ #{{ color: {expression} }} }}");
    let (_, errors) = shade(&scene(&[&script]), host, &batch(3));
    rendered(&errors.into_diagnostics())
}

fn refused(host: &Host) -> String {
    let plain = "fn surface(hit, p) { #{} }";
    match Shaders::compile(&scene(&[plain]), host) {
        Ok(_) => String::new(),
        Err(faults) => rendered(&faults),
    }
}

#[test]
fn any_number_of_parameters_is_passed_in_order() {
    let host = Host::new()
        .with_function(NativeFunction::new("none", || 7.0_f32))
        .with_function(NativeFunction::new("one", |a: f32| a + 1.0))
        .with_function(NativeFunction::new("two", |a: f32, b: f32| a * 10.0 + b))
        .with_function(NativeFunction::new("three", |a: f32, b: f32, c: f32| Vec3::new(a, b, c)))
        .with_function(NativeFunction::new("four", |a: f32, b: f32, c: f32, d: f32| Vec4::new(a, b, c, d)))
        .with_function(NativeFunction::new("five", |a: f32, b: f32, c: f32, d: f32, e: f32| {
            a + b * 10.0 + c * 100.0 + d * 1000.0 + e * 10_000.0
        }))
        .with_function(NativeFunction::new("six", |a: f32, b: f32, c: f32, d: f32, e: f32, f: f32| {
            a + b * 10.0 + c * 100.0 + d * 1000.0 + e * 10_000.0 + f * 100_000.0
        }));
    assert_eq!(given(&host, "rgb(none(), one(2), two(3, 4.0))"), Vec3::new(7.0, 3.0, 34.0));
    assert_eq!(given(&host, "three(1, 2.0, 3)"), Vec3::new(1.0, 2.0, 3.0));
    assert_eq!(given(&host, "vec3(four(1, 2, 3, 4).yzw)"), Vec3::new(2.0, 3.0, 4.0));
    assert_eq!(given(&host, "rgb(five(1, 2, 3, 4, 5), six(1, 2, 3, 4, 5, 6), 0)"), Vec3::new(54_321.0, 654_321.0, 0.0));
    assert_eq!(given(&host, "rgb(2.0.one(), 0, 0)"), Vec3::new(3.0, 0.0, 0.0), "called as a method");
}

#[test]
fn any_type_is_passed_and_given() {
    let host = Host::new()
        .with_function(NativeFunction::new("flip", |x: bool| !x))
        .with_function(NativeFunction::new("next", |x: i64| x + 1))
        .with_function(NativeFunction::new("half", |x: f32| x * 0.5))
        .with_function(NativeFunction::new("turned", |v: Vec2| Vec2::new(-v.y, v.x)))
        .with_function(NativeFunction::new("doubled", |v: Vec3| v * 2.0))
        .with_function(NativeFunction::new("opaque", |v: Vec4| Vec4::new(v.x, v.y, v.z, 1.0)));
    assert_eq!(given(&host, "if flip(false) { gray(next(2)) } else { gray(0) }"), Vec3::splat(3.0));
    assert_eq!(given(&host, "vec3(turned(vec2(1, 2)), half(3))"), Vec3::new(-2.0, 1.0, 1.5));
    assert_eq!(given(&host, "doubled(rgb(1, 2, 3))"), Vec3::new(2.0, 4.0, 6.0));
    assert_eq!(given(&host, "opaque(vec4(1, 2, 3, 4)).xyw"), Vec3::new(1.0, 2.0, 1.0));
    assert_eq!(given(&host, "gray(7 / next(1))"), Vec3::splat(3.0), "it is an int");
}

#[test]
fn wrong_arguments_are_told_with_the_form() {
    let bricks = NativeFunction::new("bricks", |uv: Vec2, mortar: f32| uv.x + mortar)
        .documented("bricks(uv, mortar)", "1 on a brick, 0 on mortar");
    let host = Host::new().with_function(bricks).with_function(NativeFunction::new("pick", |n: i64| n));
    let wrong = told(&host, "gray(bricks(hit.position, 0.1))");
    assert!(wrong.contains("`bricks` cannot be called with (vec3, float)"), "{wrong}");
    assert!(wrong.contains("it is called as `bricks(uv, mortar)`: 1 on a brick, 0 on mortar"), "{wrong}");
    assert!(wrong.contains("first.rhai:1:"), "{wrong}");
    let short = told(&host, "gray(bricks(hit.uv))");
    assert!(short.contains("`bricks` cannot be called with (vec2)") && short.contains("bricks(uv, mortar)"), "{short}");
    let float = told(&host, "gray(pick(1.5))");
    assert!(float.contains("`pick` cannot be called with (float)") && float.contains("pick(int)"), "{float}");
    let misspelt = told(&host, "gray(brick(hit.uv, 0.1))");
    assert!(misspelt.contains("there is no function `brick`"), "{misspelt}");
    assert!(misspelt.contains("did you mean `bricks`?"), "{misspelt}");
    let of_library = told(&host, "gray(smothstep(0, 1, 0.5))");
    assert!(of_library.contains("did you mean `smoothstep`?"), "{of_library}");
}

#[test]
fn a_fault_is_told_at_the_call() {
    let root =
        NativeFunction::new(
            "root",
            |x: f32| {
                if x < 0.0 { Err(format!("`root` has no value at {x}")) } else { Ok(x.sqrt()) }
            },
        );
    assert!(root.can_fail());
    let host = Host::new().with_function(root);
    assert_eq!(given(&host, "gray(root(4))"), Vec3::splat(2.0));
    let fault = told(&host, "gray(root(-1.5))");
    assert!(fault.contains("`root` has no value at -1.5") && fault.contains("first.rhai:1:"), "{fault}");
}

#[test]
fn constants_are_words() {
    let host = Host::new().with_constant("GOLDEN", 1.618_f32).with_constant("COUNT", 3_i64).with_constant("ON", true);
    assert_eq!(
        given(&host, "if ON { rgb(GOLDEN, COUNT / 2, PI) } else { gray(0) }"),
        Vec3::new(1.618, 1.0, std::f32::consts::PI)
    );
}

struct Walls(&'static str);

impl Package for Walls {
    fn name(&self) -> &'static str {
        self.0
    }

    fn register(&self, host: Host) -> Host {
        host.with_constant("COURSES", 12_i64).with_function(NativeFunction::new("bricks", |uv: Vec2| uv.x))
    }
}

#[test]
fn names_that_are_taken_are_refused_all_at_once() {
    let host = Host::new()
        .with_package(&Walls("masonry"))
        .with_package(&Walls("walls"))
        .with_function(NativeFunction::new("smoothstep", |x: f32| x))
        .with_function(NativeFunction::new("+", |x: f32| x))
        .with_function(NativeFunction::new("while", |x: f32| x))
        .with_function(NativeFunction::new("eval", |x: f32| x))
        .with_function(NativeFunction::new("push", |x: f32| x))
        .with_constant("PI", 3.0_f32)
        .with_constant("bricks", 3.0_f32);
    let faults = refused(&host);
    for fault in [
        "the constant `COURSES` of the package `walls` cannot be registered: it is registered by the package `masonry` already",
        "the native function `bricks` of the package `walls` cannot be registered: it is registered by the package `masonry`",
        "the native function `smoothstep` cannot be registered: it is a function of the library",
        "the native function `+` cannot be registered: it is no word",
        "the native function `while` cannot be registered: it is no word",
        "the native function `eval` cannot be registered: it is a word with a meaning of its own",
        "the native function `push` cannot be registered: it is a word with a meaning of its own",
        "the constant `PI` cannot be registered: it is a constant of the library",
        "the constant `bricks` cannot be registered: it is registered by the package `masonry` already",
    ] {
        assert!(faults.contains(fault), "{fault}\nis not in\n{faults}");
    }
    assert_eq!(host.check().unwrap_err().0.len(), 9);
    assert_eq!(refused(&Host::new().with_package(&Walls("masonry"))), "");
}

#[test]
fn batch_forms_are_for_floats_only_and_are_checked() {
    let right =
        NativeFunction::new("right", |v: Vec3, x: f32| Vec2::new(v.x + v.y, v.z * x)).with_batch(|given, out| {
            for lane in 0..given[0].len() {
                out[0][lane] = given[0][lane] + given[1][lane];
                out[1][lane] = given[2][lane] * given[3][lane];
            }
        });
    let column = |shift: f32| (0..100).map(|i| i as f32 * 0.37 - shift).collect::<Vec<_>>();
    let columns = [column(1.0), column(2.0), column(3.0), column(f32::NAN)];
    let columns: Vec<&[f32]> = columns.iter().map(Vec::as_slice).collect();
    right.check(&columns).unwrap();
    assert!(right.check(&columns[..3]).unwrap_err().contains("do not fit"));
    let wrong = NativeFunction::new("wrong", |x: f32| x + 1.0).with_batch(|given, out| {
        for lane in 0..given[0].len() {
            out[0][lane] = given[0][lane] + if lane == 50 { 2.0 } else { 1.0 };
        }
    });
    assert!(wrong.check(&columns[..1]).unwrap_err().contains("but [19.5] in a batch"));

    let of_int = NativeFunction::new("of_int", |x: i64| x).with_batch(|_, _| {});
    let failing =
        NativeFunction::new("failing", |x: f32| if x > 0.0 { Ok(x) } else { Err("no".into()) }).with_batch(|_, _| {});
    let faults = refused(&Host::new().with_function(of_int).with_function(failing));
    assert!(faults.contains("`of_int` cannot be registered: it has a batch form"), "{faults}");
    assert!(faults.contains("`failing` cannot be registered: it has a batch form"), "{faults}");
}

#[test]
fn types_are_known_without_a_script() {
    let function = NativeFunction::new("f", |a: bool, b: i64, c: Vec4| if a { c.x + b as f32 } else { 0.0 });
    assert_eq!(function.parameters(), [NativeType::Bool, NativeType::Int, NativeType::Vec4]);
    assert_eq!(function.result(), NativeType::Float);
    let call = |b| function.call(&[NativeValue::Bool(true), b, Vec4::ONE.into()]);
    assert_eq!(call(NativeValue::Int(2)), Ok(NativeValue::Float(3.0)));
    assert_eq!(call(NativeValue::Float(2.0)).unwrap_err(), "`f` cannot be called with (bool, float, vec4)");
    let host = Host::new().with_function(function);
    assert!(host.functions().any(|known| known.name == "f" && known.form == "f(bool, int, vec4)"));
    assert!(host.functions().any(|known| known.name == "smoothstep"));
    assert!(host.native("f").is_some() && host.native("g").is_none());
}

#[test]
fn many_threads_call_one_function() {
    let host = Host::new().with_function(NativeFunction::new("mixed", |x: f32, y: f32| x * 3.0 + y));
    let script = "fn surface(hit, p) { #{ color: gray(mixed(hit.uv.x, hit.position.x)) } }";
    let run = || -> OutputBatch { shade(&scene(&[script]), &host, &batch(200)).0 };
    let alone = run().color;
    std::thread::scope(|scope| {
        let threads: Vec<_> = (0..8).map(|_| scope.spawn(|| run().color)).collect();
        for thread in threads {
            assert_eq!(thread.join().unwrap(), alone);
        }
    });
}
