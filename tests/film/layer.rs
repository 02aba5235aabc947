//! Layer names.

use tusche::diag::Diagnostic;
use tusche::film::{ChannelFormat, Layer};

#[test]
fn names_are_read_back() {
    let aovs = ["hatch", "ink"];
    for layer in Layer::FIXED.into_iter().chain([Layer::Aov(1, "ink".into())]) {
        assert_eq!(Layer::parse(&layer.to_string(), &aovs), Ok(layer.clone()), "{layer}");
    }
    let names: Vec<_> = Layer::FIXED.iter().map(ToString::to_string).collect();
    assert_eq!(
        names.join(" "),
        "rgba color line line.outline line.silhouette line.overlap line.material line.crease line.uv line.feature line.camera \
         line.reflection line.refraction line.hidden below Z N P uv object feature"
    );
}

#[test]
fn channels_are_named_as_compositing_programs_expect() {
    use ChannelFormat::{Float, Half, Uint};
    for (name, channels, format) in [
        ("rgba", "R G B A", Half),
        ("color", "color.R color.G color.B color.A", Half),
        ("line", "line.R line.G line.B line.A", Half),
        ("line.crease", "line.crease.R line.crease.G line.crease.B line.crease.A", Half),
        ("line.camera", "line.camera.R line.camera.G line.camera.B line.camera.A", Half),
        ("line.hidden", "line.hidden.R line.hidden.G line.hidden.B line.hidden.A", Half),
        ("below", "below.R below.G below.B below.A", Half),
        ("Z", "Z", Float),
        ("N", "N.X N.Y N.Z", Float),
        ("P", "P.X P.Y P.Z", Float),
        ("uv", "uv.U uv.V", Float),
        ("object", "object.id", Uint),
        ("feature", "feature.R feature.G feature.B", Half),
        ("aov_ink", "aov_ink.R aov_ink.G aov_ink.B", Float),
    ] {
        let layer = Layer::parse(name, &["ink"]).unwrap();
        let names: Vec<_> = layer.channels().into_iter().map(|channel| channel.name).collect();
        assert_eq!(names.join(" "), channels);
        assert!(layer.channels().iter().all(|channel| channel.format == format), "{name}");
    }
}

#[test]
fn unknown_names_are_errors_with_the_nearest_name() {
    let error = |name: &str, aovs: &[&str]| Layer::parse(name, aovs).unwrap_err().to_string();
    assert_eq!(error("line.creases", &[]), "error: there is no layer `line.creases` (did you mean `line.crease`?)");
    assert_eq!(error("z", &[]), "error: there is no layer `z` (did you mean `Z`?)");
    assert_eq!(
        error("beauty_pass", &["ink"]),
        "error: there is no layer `beauty_pass` (layers are rgba, color, line, line.outline, line.silhouette, \
         line.overlap, line.material, line.crease, line.uv, line.feature, line.camera, line.reflection, line.refraction, line.hidden, below, Z, N, P, uv, object, feature, aov_ink)"
    );
    assert_eq!(error("aov_inc", &["ink"]), "error: no shader of this scene writes `aov_inc` (did you mean `aov_ink`?)");
    let error: Diagnostic = "colour".parse::<Layer>().unwrap_err();
    assert_eq!(error.to_string(), "error: there is no layer `colour` (did you mean `color`?)");
}
