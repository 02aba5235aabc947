//! The reference page is that of the code, and its examples work.

use super::*;
use crate::common::{golden, root};
use tusche::files::FileStore;
use tusche::scene::script_files;
use tusche::shade::names::{INPUTS, OUTPUTS};
use tusche::shade::{InputSet, library, reference};

#[test]
fn the_page_is_that_of_the_code() {
    golden(&root().join("shaders/README.md"), &reference::markdown());
}

/// Shades with one script beside an image `grain.png`.
fn assert_works(script: &str) {
    let path = root().join("reference-of-a-test/main.rhai");
    let mut png = std::io::Cursor::new(Vec::new());
    image::DynamicImage::new_rgba8(2, 2).write_to(&mut png, image::ImageFormat::Png).expect("it is written");
    let files = FileStore::new().with_file(&path, script).with_file(path.with_file_name("grain.png"), png.into_inner());
    let params = BTreeMap::from([("map".to_owned(), (texture(), None))]);
    let mut builder = scene_with(&[script], params).into_builder();
    builder.scripts[0] = Script { source: files.read_text(&path).expect("it is there"), path: Some(path) };
    let mut faults = Diagnostics::default();
    script_files::load(&mut builder, &files, &mut faults);
    assert!(faults.is_empty(), "{script}: {}", rendered(&faults));
    let scene = builder.build().unwrap_or_else(|faults| panic!("{faults}"));
    let (outputs, errors) = shade(&scene, &Host::new(), &batch(2));
    assert!(errors.is_empty(), "{script}: {}", rendered(&errors.into_diagnostics()));
    assert_eq!(outputs.len, 2);
    let (shaders, _) = Shaders::compile(&scene, &Host::new()).expect("it compiled before");
    assert!(shaders.all()[0].analysis().complete, "{script}: {:?}", shaders.all()[0].analysis().blame);
}

#[test]
fn every_example_works() {
    for function in library::functions() {
        let name = function.name;
        let example = function.example;
        assert!(example.contains(&format!("{name}(")), "the example of `{name}` does not show it: {example}");
        let value = match function.types.rsplit("→ ").next() {
            Some("true or false") => format!("if {example} {{ 1.0 }} else {{ 0.0 }}"),
            _ => example.to_owned(),
        };
        assert_works(&format!("fn params() {{ #{{ map: () }} }}\nfn surface(hit, p) {{ #{{ aov_x: {value} }} }}"));
    }
}

#[test]
fn every_input_and_output_is_there() {
    assert_eq!(INPUTS.len(), InputSet::named().count());
    let flags = InputSet::named().fold(InputSet::MORE_UVS, |all, (_, input)| all | input);
    assert_eq!(flags, InputSet::all());
    let outputs = OUTPUTS.iter().fold(OutputSet::empty(), |all, entry| all | entry.output);
    assert_eq!(outputs, OutputSet::all());
    for input in INPUTS.iter().filter(|entry| !InputSet::CALLED.contains(entry.input)) {
        let name = input.name;
        let value = match input.kind {
            "vec2" => format!("vec3(hit.{name}, 0)"),
            "vec4" => format!("hit.{name}.xyz"),
            "text" => format!("if hit.{name} == \"camera\" {{ 1 }} else {{ 0 }}"),
            "true or false" => format!("if hit.{name} {{ 1 }} else {{ 0 }}"),
            _ => format!("hit.{name}"),
        };
        assert_works(&format!("fn params() {{ #{{ map: () }} }}\nfn surface(hit, p) {{ #{{ aov_x: {value} }} }}"));
    }
}
