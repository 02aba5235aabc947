//! Closures: what they mean, and that they cannot be used to exhaust memory or the stack.

use super::*;

/// The colour of a `surface` with this body.
fn shaded(body: &str) -> Vec3 {
    let script = format!("fn surface(hit, p) {{ {body} }}");
    let (outputs, errors) = shade(&scene(&[&script]), &Host::new(), &batch(1));
    assert!(errors.is_empty(), "{body}: {}", rendered(&errors.into_diagnostics()));
    outputs.color[0].expect("the script gives a colour")
}

#[test]
fn a_closure_is_called_by_its_name() {
    assert_eq!(shaded("let f = |x| x * 2.0; #{ color: gray(f.call(3.0)) }"), Vec3::splat(6.0));
    assert_eq!(shaded("let f = || 0.5; #{ color: gray(f.call()) }"), Vec3::splat(0.5));
    assert_eq!(shaded("let f = |x, y| { let z = x - y; z * z }; #{ color: gray(f.call(3, 1.0)) }"), Vec3::splat(4.0));
    assert_eq!(shaded("let f = |v| v; #{ color: gray(f.call(hit.normal).y) }"), Vec3::splat(1.0));
}

#[test]
fn captured_variables_are_shared() {
    assert_eq!(shaded("let a = 1.0; let f = |x| x + a; a = 5.0; #{ color: gray(f.call(1)) }"), Vec3::splat(6.0));
    assert_eq!(
        shaded("let a = 1.0; let f = || { a += 1.0; }; f.call(); f.call(); #{ color: gray(a) }"),
        Vec3::splat(3.0)
    );
    assert_eq!(shaded("let a = [1.0]; let f = |x| a.push(x); f.call(2.0); #{ color: gray(a[1]) }"), Vec3::splat(2.0));
    assert_eq!(
        shaded("let a = #{ b: 1.0 }; let f = |x| { a.b = x; }; f.call(2.0); #{ color: gray(a.b) }"),
        Vec3::splat(2.0)
    );
    assert_eq!(shaded("let f = || hit.uv.y; #{ color: gray(f.call()) }"), Vec3::splat(0.3));
}

#[test]
fn closures_call_closures() {
    assert_eq!(
        shaded(
            "let a = 1.0; let f = |x| x + a; let g = |x| { a = 10.0; f.call(x) * 2.0 }; #{ color: gray(g.call(1.0)) }"
        ),
        Vec3::splat(22.0)
    );
    assert_eq!(
        shaded("let f = |x| { let g = |y| x * y; g.call(2.0) + g.call(3.0) }; #{ color: gray(f.call(2.0)) }"),
        Vec3::splat(10.0)
    );
}

#[test]
fn copies_of_shared_values_are_copies() {
    // Values in records and arrays are never shared, or the engine could not tell their size.
    let body = "let a = [1.0]; let f = || a.push(2.0); let r = #{ a: a }; let l = [a, a]; l.push(a); f.call();
        let b = a; b.push(3.0); #{ color: vec3(r.a.len(), l[2].len() + l.len(), a.len()) }";
    assert_eq!(shaded(body), Vec3::new(1.0, 4.0, 2.0));
}

/// Asserts that a body is refused at a place, and why.
#[track_caller]
fn assert_refused(body: &str, place: &str, why: &str) {
    let said = complaint(&format!("fn id(x) {{ x }}\nfn surface(hit, p) {{\n    {body}\n}}"));
    assert!(said.contains(why) && said.contains(&format!("first.rhai:{place}\n")), "{body}: {said}");
}

#[test]
fn a_closure_can_be_put_nowhere() {
    let bound = "a closure can only be bound to a variable, and called by its name";
    let called = "`f` is a closure, and can only be called";
    assert_refused("#{ a: |x| x }", "3:11", bound);
    assert_refused("[|x| x]; #{}", "3:6", bound);
    assert_refused("id(|x| x); #{}", "3:8", bound);
    assert_refused("let a = 1; let f = [|x| x + a]; #{}", "3:25", bound);
    assert_refused("let f = 0; f = |x| x; #{}", "3:20", bound);
    assert_refused("let f = |x| |y| x + y; #{}", "3:17", bound);
    assert_refused("if true { |x| x } else { 1 }", "3:15", bound);
    assert_refused("let f = |x| x; let g = f; #{}", "3:28", called);
    assert_refused("let f = |x| x; id(f); #{}", "3:23", called);
    assert_refused("let f = |x| x; let g = |x| f; g.call(1); #{}", "3:32", called);
    assert_refused("let f = |x| x; let a = #{ f: f }; #{}", "3:34", called);
    assert_refused("let f = |x| x; f = 1; #{}", "3:20", called);
    assert_refused("let f = |x| x; f.curry(1); #{}", "3:22", "expecting name of a property");
    assert_refused("let f = |x| x; let y = [1].map(f); #{}", "3:36", called);
    assert_refused("let f = |x| x; return f;", "3:27", called);
    assert_refused("let f = |x| x; f", "3:20", called);
}

#[test]
fn chains_of_closures_cannot_be_built() {
    let why = "is the name of a closure and of something else";
    assert_refused("let f = |x| x; for f in 0..3 { } #{}", "3:24", why);
    assert_refused("let f = |f| f + 1; f.call(1); #{}", "3:13", why);
    assert_refused("let f = 1; let f = |x| x; #{}", "3:9", why);
    // A closure that captures an older one of the same name: as deep as the text, not as the loop.
    let body =
        "let f = |x| x; for i in 0..100 { let f = |x| f.call(x) + 1.0; f.call(1.0); } #{ color: gray(f.call(1.0)) }";
    assert_eq!(shaded(body), Vec3::splat(1.0));
    // A closure cannot see itself.
    assert_refused("let f = |x| f.call(x); #{}", "3:17", "there is no variable `f` here");
}

#[test]
fn call_belongs_to_closures() {
    assert_refused("let x = 1; x.call(2); #{}", "3:18", "`call` belongs to closures");
    assert_refused("let f = |x| x; call(f, 2); #{}", "3:25", "`f` is a closure, and can only be called");
    assert_refused("let y = call(id, 2); #{}", "3:13", "`call` is written behind the closure");
}

#[test]
fn arguments_of_closures_are_counted() {
    assert_refused("let a = 1; let f = |x| x + a; f.call(1, 2); #{}", "3:37", "this closure takes 1 argument, not 2");
}

#[test]
fn errors_in_closures_are_placed() {
    let said = complaint(
        "fn surface(hit, p) {\n    let f = |x| {\n        x + \"a\".b\n    };\n    #{ line_width: f.call(1) }\n}",
    );
    assert!(said.contains("first.rhai:3:"), "{said}");
    let said =
        complaint("fn surface(hit, p) {\n    let f = |x| [x][hit.object_id];\n    #{ line_width: f.call(1) }\n}");
    assert!(said.contains("first.rhai:2:") && said.contains("the closure was called at line 3, column 22"), "{said}");
}

#[test]
fn endless_closures_end() {
    let said = complaint("fn surface(hit, p) { let f = || { loop {} }; f.call(); #{} }");
    assert!(said.contains("did not finish within"), "{said}");
    let said = complaint("fn down(n) { let f = |x| down(x + 1); f.call(n) } fn surface(hit, p) { down(0); #{} }");
    assert!(said.contains("functions call each other more than"), "{said}");
}
