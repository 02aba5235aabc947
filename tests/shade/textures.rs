//! Images that scripts name.

use super::*;
use crate::common::root;
use tusche::files::FileStore;
use tusche::scene::script_files;

/// A PNG of 2 × 1 pixels: black and white, fully covered.
fn png() -> Vec<u8> {
    let mut bytes = Vec::new();
    let pixels = image::RgbaImage::from_raw(2, 1, vec![0, 0, 0, 255, 188, 188, 188, 255]).expect("two pixels");
    let mut cursor = std::io::Cursor::new(&mut bytes);
    image::DynamicImage::ImageRgba8(pixels).write_to(&mut cursor, image::ImageFormat::Png).expect("it is written");
    bytes
}

/// Compiles and shades a script beside `grain.png`; gives the colour, or what is said.
fn try_shade(text: &str) -> Result<Vec3, String> {
    let folder = root().join("textures-of-a-test");
    let path = folder.join("main.rhai");
    let store = FileStore::new()
        .with_file(&path, text)
        .with_file(folder.join("grain.png"), png())
        .with_file(folder.join("lib/grain.png"), png())
        .with_file(folder.join("lib/paper.rhai"), "fn at(uv) {\n    texture(\"grain.png\", uv).rgb\n}")
        .with_file(folder.join("broken.png"), "this is no picture");
    let source = store.read_text(&path).expect("it is there");
    let mut builder = scene(&[""; 1]).into_builder();
    builder.scripts[0] = Script { source, path: Some(path) };
    let mut faults = Diagnostics::default();
    script_files::load(&mut builder, &store, &mut faults);
    let shown = |faults: &Diagnostics| rendered(faults).replace(&format!("{}/", folder.display()), "");
    if faults.has_errors() {
        return Err(shown(&faults));
    }
    assert!(text.contains("import") || store.dependencies().contains(&folder.join("grain.png")));
    let scene = builder.build().map_err(|faults| shown(&faults))?;
    let (shaders, _) = Shaders::compile(&scene, &Host::new()).map_err(|faults| shown(&faults))?;
    let (mut outputs, mut errors) = (OutputBatch::default(), ShadeErrors::default());
    Shading::new(&scene, &shaders).shade(MaterialId(0), &batch(1), OutputSet::all(), &mut outputs, &mut errors);
    if errors.is_empty() { Ok(outputs.color[0].expect("a colour")) } else { Err(shown(&errors.into_diagnostics())) }
}

fn shaded(color: &str) -> Vec3 {
    try_shade(&format!("fn surface(hit, p) {{ #{{ color: {color} }} }}")).unwrap_or_else(|said| panic!("{said}"))
}

#[test]
fn a_texture_is_looked_up_by_its_path() {
    assert!((shaded("texture(\"grain.png\", vec2(0.75, 0.5)).rgb").x - 0.5).abs() < 0.01);
    assert_eq!(
        shaded("texture(\"grain.png\", vec2(0.75, 0.5), \"repeat\", \"linear\").rgb"),
        Vec3::splat(188.0 / 255.0)
    );
    assert_eq!(shaded("texture(\"grain.png\", vec2(-7.0, 0.5), \"clamp\").rgb"), Vec3::ZERO);
    assert!(shaded("texture(\"./grain.png\", vec2(1.25, 0.5), \"mirror\").rgb").x > 0.4);
    assert_eq!(shaded("texture(\"grain.png\", hit.uv).www * vec3(1, 0, 1)"), Vec3::new(1.0, 0.0, 1.0));
}

#[test]
fn modules_name_what_lies_beside_them() {
    let text = "import \"lib/paper\" as paper;\nfn surface(hit, p) { #{ color: paper::at(vec2(0.25, 0.5)) } }";
    assert_eq!(try_shade(text), Ok(Vec3::ZERO));
}

#[track_caller]
fn assert_said(color: &str, place: &str, words: &[&str]) {
    let said = try_shade(&format!("fn surface(hit, p) {{\n    #{{ color: {color} }}\n}}")).expect_err("it is wrong");
    assert!(said.contains(&format!("--> main.rhai:{place}\n")), "not at {place}: {said}");
    for word in words {
        assert!(said.contains(word), "no `{word}` in {said}");
    }
}

#[test]
fn faults_are_told_at_the_path() {
    assert_said("texture(\"gain.png\", hit.uv).rgb", "2:23", &["cannot read the image gain.png: no such file"]);
    assert_said("texture(\"broken.png\", hit.uv).rgb", "2:23", &["broken.png: this is not an image that Tusche reads"]);
    assert_said("texture(\"/grain.png\", hit.uv).rgb", "2:23", &["a script must name files relative to itself"]);
    assert_said(
        "texture(\"grain.png\", hit.uv, \"clmp\").rgb",
        "2:44",
        &["no wrap mode `clmp`", "did you mean `clamp`?"],
    );
    assert_said("texture(\"grain.png\", hit.uv, \"clamp\", \"xyz\").rgb", "2:53", &["there are: srgb, linear"]);
    assert_said("texture(\"grain.png\", hit.uv, p).rgb", "2:44", &["wrap mode of a texture must be written out"]);
}

#[test]
fn paths_are_written_out() {
    let words = ["the path of an image must be written out as a text where it is looked up"];
    assert_said(
        "{ let name = \"grain.png\"; let uv = texture(\"grain.png\", hit.uv); texture(name, hit.uv).rgb }",
        "2:83",
        &words,
    );
    assert_said("texture(\"grain\" + \".png\", texture(\"grain.png\", hit.uv).xy).rgb", "2:15", &words);
}
