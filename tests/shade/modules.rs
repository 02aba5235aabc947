//! Modules: what they mean, and what is said when they are wrong.

use super::*;
use crate::common::root;
use tusche::files::FileStore;
use tusche::scene::script_files;

/// Compiles and shades the first of some files, whose names are paths; gives the colour, or what is said.
fn try_shade(files: &[(&str, &str)]) -> Result<Vec3, String> {
    let folder = root().join("modules-of-a-test");
    let mut store = FileStore::new();
    for (name, text) in files {
        store = store.with_file(folder.join(name), *text);
    }
    let path = folder.join(files[0].0);
    let text = store.read_text(&path).map_err(|fault| rendered(&fault.into()))?;
    let mut builder = scene(&[""; 1]).into_builder();
    builder.scripts[0] = Script { source: text, path: Some(path) };
    let mut faults = Diagnostics::default();
    script_files::load(&mut builder, &store, &mut faults);
    let shown = |faults: &Diagnostics| rendered(faults).replace(&format!("{}/", folder.display()), "");
    if faults.has_errors() {
        return Err(shown(&faults));
    }
    let scene = builder.build().map_err(|faults| shown(&faults))?;
    let (shaders, _) = Shaders::compile(&scene, &Host::new()).map_err(|faults| shown(&faults))?;
    let mut outputs = OutputBatch::default();
    let mut errors = ShadeErrors::default();
    Shading::new(&scene, &shaders).shade(MaterialId(0), &batch(1), OutputSet::all(), &mut outputs, &mut errors);
    if errors.is_empty() { Ok(outputs.color[0].expect("a colour")) } else { Err(shown(&errors.into_diagnostics())) }
}

#[track_caller]
fn assert_said(files: &[(&str, &str)], place: &str, words: &[&str]) {
    let said = try_shade(files).expect_err("something is wrong");
    assert!(said.contains(&format!("--> {place}\n")), "not at {place}: {said}");
    for word in words {
        assert!(said.contains(word), "no `{word}` in:\n{said}");
    }
}

#[test]
fn functions_of_modules_are_called() {
    let files = [
        ("main.rhai", "import \"lib/tone\" as t;\nfn surface(hit, p) { #{ color: gray(t::half(hit.normal.y)) } }"),
        ("lib/tone.rhai", "//! Tones.\nfn half(x) { scaled(x, 0.5) }\nprivate fn scaled(x, by) { x * by }"),
    ];
    assert_eq!(try_shade(&files), Ok(Vec3::splat(0.5)));
}

#[test]
fn each_file_has_names_of_its_own() {
    // The engine's own modules let these functions see each other.
    let files = [
        (
            "main.rhai",
            "import \"a\" as m; import \"b.rhai\" as n;
             fn tone(x) { x + 100.0 }
             fn surface(hit, p) { let f = |x| tone(x); #{ color: vec3(tone(0.0) + f.call(0.0), m::of(1.0), n::of(1.0)) } }",
        ),
        ("a.rhai", "import \"b\" as m;\nfn tone(x) { x + 10.0 }\nfn of(x) { let f = |x| tone(x); f.call(tone(x)) + m::of(0.0) }"),
        ("b.rhai", "fn tone(x) { x + 1.0 }\nfn of(x) { let f = |x| tone(x); f.call(tone(x)) }"),
    ];
    assert_eq!(try_shade(&files), Ok(Vec3::new(200.0, 23.0, 3.0)));
    // Nor does a module see what the script that imports it defines.
    let files = [
        ("main.rhai", "import \"a\" as a;\nfn tone(x) { x }\nfn surface(hit, p) { #{ color: a::of(1.0) } }"),
        ("a.rhai", "fn of(x) {\n    gray(tone(x))\n}"),
    ];
    assert_said(&files, "a.rhai:2:10", &["there is no function `tone`", "`of` was called at main.rhai:3:"]);
}

#[test]
fn own_functions_shadow_the_library_by_their_number_of_parameters() {
    let files = [
        ("main.rhai", "import \"a\" as a;\nfn surface(hit, p) { #{ color: vec3(a::of(3.0), saturate(5.0), 0.0) } }"),
        (
            "a.rhai",
            "fn saturate(x, y) { x + y }\nfn of(x) { saturate(x) + saturate(1.0, 2.0) + [x].len() }\nfn len(a, b) { 7 }",
        ),
    ];
    assert_eq!(try_shade(&files), Ok(Vec3::new(5.0, 1.0, 0.0)));
}

#[test]
fn methods_of_modules_work_within_them() {
    let files = [
        ("main.rhai", "import \"a\" as a;\nfn surface(hit, p) { #{ color: gray(a::of(3.0)) } }"),
        ("a.rhai", "fn twice() { this *= 2.0; }\nfn of(x) { x.twice(); x }"),
    ];
    assert_eq!(try_shade(&files), Ok(Vec3::splat(6.0)));
}

#[test]
fn paths_lead_up_and_built_in_modules_are_found() {
    let files = [
        ("shaders/main.rhai", "import \"../lib/./a\" as a;\nfn surface(hit, p) { #{ color: gray(a::of(0.25)) } }"),
        ("lib/a.rhai", "import \"builtin:lib/hatching\" as h;\nfn of(x) { h::stroke(0.5, 1.0) * x }"),
    ];
    assert_eq!(try_shade(&files), Ok(Vec3::splat(0.25)));
}

#[test]
fn not_found() {
    let main = "import \"lib/hatchin\" as h;\nfn surface(hit, p) { #{} }";
    assert_said(
        &[("main.rhai", main)],
        "main.rhai:1:8",
        &["cannot read the module", "lib/hatchin.rhai", "no such file"],
    );
    let main = "import \"builtin:lib/hatchin\" as h;\nfn surface(hit, p) { #{} }";
    assert_said(
        &[("main.rhai", main)],
        "main.rhai:1:8",
        &["no built-in module `lib/hatchin`", "did you mean `lib/hatching`?"],
    );
    let main = "import \"/lib/a\" as h;\nfn surface(hit, p) { #{} }";
    assert_said(&[("main.rhai", main)], "main.rhai:1:8", &["a script must name files relative to itself"]);
    let main = "import \"lib\\\\a\" as h;\nfn surface(hit, p) { #{} }";
    assert_said(&[("main.rhai", main)], "main.rhai:1:8", &["written with `/`"]);
}

#[test]
fn circles() {
    let files = [
        ("main.rhai", "import \"a\" as a;\nfn surface(hit, p) { #{} }"),
        ("a.rhai", "import \"b\" as b;\nfn f() { 1 }"),
        ("b.rhai", "fn g() { 1 }\nimport \"a\" as a;"),
    ];
    assert_said(&files, "b.rhai:2:8", &["leads back to a file", "a.rhai → b.rhai → a.rhai"]);
    let files = [("main.rhai", "import \"main\" as a;\nfn surface(hit, p) { #{} }")];
    assert_said(&files, "main.rhai:1:8", &["main.rhai → main.rhai"]);
}

#[test]
fn too_many_and_too_deep() {
    let name = |n: usize| format!("m{n}.rhai");
    let names: Vec<String> = (0..100).map(name).collect();
    let chain: Vec<String> = (1..=100).map(|n| format!("import \"m{n}\" as m;\nfn f() {{ 1 }}")).collect();
    let main = "import \"m0\" as m;\nfn surface(hit, p) { #{} }".to_owned();
    let mut files = vec![("main.rhai", main.as_str())];
    files.extend(names.iter().zip(&chain).map(|(name, text)| (name.as_str(), text.as_str())));
    files.push(("m100.rhai", ""));
    assert_said(&files, "m15.rhai:1:8", &["modules import each other more than 16 deep"]);

    let imports: String = (0..100).map(|n| format!("import \"m{n}\" as m{n};\n")).collect();
    let main = format!("{imports}fn surface(hit, p) {{ #{{}} }}");
    let mut files = vec![("main.rhai", main.as_str())];
    files.extend(names.iter().map(|name| (name.as_str(), "fn f() { 1 }")));
    assert_said(&files, "main.rhai:65:8", &["a script can have at most 64 modules"]);
}

#[test]
fn what_is_wrong_in_a_module_is_shown_there() {
    let main = ("main.rhai", "import \"a\" as a;\nfn surface(hit, p) {\n    #{ color: a::of(hit) }\n}");
    assert_said(&[main, ("a.rhai", "fn of(hit) {\n    let x = ;\n}")], "a.rhai:2:13", &["unexpected ';'"]);
    assert_said(&[main, ("a.rhai", "let x = 1;\nfn of(hit) { 1 }")], "a.rhai:1:1", &["only functions can stand"]);
    assert_said(&[main, ("a.rhai", "fn of(hit) {\n    hit.positon\n}")], "a.rhai:2:9", &["did you mean `position`?"]);
    let late = "private fn pick(a, i) {\n    a[i]\n}\nfn of(hit) {\n    pick([hit.normal], hit.object_id)\n}";
    assert_said(
        &[main, ("a.rhai", late)],
        "a.rhai:2:7",
        &["index 1 is out of range", "`pick` was called at line 5, column 5", "`of` was called at main.rhai:3:18"],
    );
    let endless = "fn of(hit) {\n    loop {}\n}";
    assert_said(&[main, ("a.rhai", endless)], "main.rhai:3:18", &["did not finish"]);
}

#[test]
fn calls_that_lead_nowhere() {
    let module = ("a.rhai", "fn stroke(x) { x }\nprivate fn hidden(x) { x }");
    let main = |body: &str| format!("import \"a\" as a;\nfn surface(hit, p) {{\n    #{{ color: {body} }}\n}}");
    let said =
        |body: &str, place: &str, words: &[&str]| assert_said(&[("main.rhai", &main(body)), module], place, words);
    said("a::strok(1)", "main.rhai:3:18", &["the module `a` has no function `strok`", "did you mean `stroke`?"]);
    said("a::xyz(1)", "main.rhai:3:18", &["there are: stroke"]);
    said("a::hidden(1)", "main.rhai:3:18", &["`hidden` is private to its module"]);
    said("a::stroke(1, 2)", "main.rhai:3:18", &["`a::stroke` takes 1 arguments, not 2"]);
    said("b::stroke(1)", "main.rhai:3:15", &["there is no module `b`"]);
    said("a::b::stroke(1)", "main.rhai:3:15", &["the modules of a module are its own"]);
}

#[test]
fn imports_stand_at_the_head() {
    let files = [("main.rhai", "fn surface(hit, p) {\n    import \"a\" as a;\n    #{}\n}"), ("a.rhai", "")];
    assert_said(&files, "main.rhai:2:5", &["`import` can only stand at the head of a script"]);
    let files = [("main.rhai", "import \"a\";\nfn surface(hit, p) { #{} }"), ("a.rhai", "")];
    assert_said(&files, "main.rhai:1:1", &["a module needs a name to be called by"]);
    let files = [("main.rhai", "import \"a\" + \"b\" as a;\nfn surface(hit, p) { #{} }"), ("a.rhai", "")];
    assert_said(&files, "main.rhai:1:1", &["must be written out as a text"]);
    let files = [("main.rhai", "import \"a\" as a;\nimport \"a\" as a;\nfn surface(hit, p) { #{} }"), ("a.rhai", "")];
    assert_said(&files, "main.rhai:2:8", &["another module is imported as `a`"]);
}

#[test]
fn modules_are_dependencies_of_the_scene() {
    let folder = root().join("modules-of-a-test");
    let text = "[materials.m]\nshader = \"main.rhai\"\n[[objects]]\nshape = \"sphere\"\nmaterial = \"m\"\n";
    let store = FileStore::new()
        .with_file(folder.join("scene.toml"), text)
        .with_file(folder.join("main.rhai"), "import \"a\" as a;\nfn surface(hit, p) { #{ roughness: a::half() } }")
        .with_file(folder.join("a.rhai"), "fn half() { 0.5 }");
    let (builder, _) = tusche::scene::file::load(&folder.join("scene.toml"), &store, &[], &Default::default())
        .unwrap_or_else(|faults| panic!("{}", rendered(&faults)));
    let scene = builder.build().expect("it is whole");
    let (shaders, _) = Shaders::compile(&scene, &Host::new()).unwrap_or_else(|faults| panic!("{}", rendered(&faults)));
    assert!(shaders.all()[0].analysis().complete);
    assert!(store.dependencies().contains(&folder.join("a.rhai")));
}
