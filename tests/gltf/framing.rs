//! Cameras and lights: the model's own, and those a bare model is given.

use std::path::Path;

use proptest::prelude::*;
use serde_json::json;
use tusche::diag::Diagnostics;
use tusche::files::FileStore;
use tusche::math::{DMat3, DVec2, DVec3, Vec3};
use tusche::scene::SceneBuilder;
use tusche::scene::camera::{Camera, Projection};
use tusche::scene::framing::{FILL, bounds, default_lights, frame_camera};
use tusche::scene::gltf::ModelTime;
use tusche::scene::light::LightKind;

use super::{Model, load_model};

fn load(model: &Model, camera: Option<&str>) -> (SceneBuilder, Diagnostics) {
    load_model(Path::new("model.gltf"), &model.store(), ModelTime::Rest, camera, [300, 200])
        .unwrap_or_else(|faults| panic!("{faults}"))
}

/// Where a point is in the picture: −1 … 1 both ways, and its depth.
fn project(camera: &Camera, size: [u32; 2], point: DVec3) -> (DVec2, f64) {
    let Projection::Perspective { fov_y } = camera.projection else { panic!() };
    let local = camera.world_from_camera.transpose() * (point - camera.position);
    let tan = (fov_y / 2.0).tan();
    let aspect = f64::from(size[0]) / f64::from(size[1]);
    (DVec2::new(local.x / (tan * aspect), local.y / tan) / -local.z, -local.z)
}

fn corners(low: DVec3, high: DVec3) -> Vec<DVec3> {
    (0..8)
        .map(|i| DVec3::new([low.x, high.x][i & 1], [low.y, high.y][i >> 1 & 1], [low.z, high.z][i >> 2 & 1]))
        .collect()
}

proptest! {
    #[test]
    fn the_box_fills_the_tighter_direction_exactly(
        middle in prop::array::uniform3(-1e6..1e6_f64),
        extent in prop::array::uniform3(0.0..10.0_f64),
        size in prop::array::uniform2(16_u32..4000),
    ) {
        let (low, high) = (DVec3::from(middle), DVec3::from(middle) + DVec3::from(extent));
        prop_assume!(extent.iter().any(|length| *length > 0.1));
        let camera = frame_camera(Some((low, high)), size);
        let points: Vec<_> = corners(low, high).into_iter().map(|corner| project(&camera, size, corner)).collect();
        prop_assert!(points.iter().all(|(_, depth)| *depth > 0.0));
        let least = points.iter().fold(DVec2::INFINITY, |least, (point, _)| least.min(*point));
        let greatest = points.iter().fold(DVec2::NEG_INFINITY, |greatest, (point, _)| greatest.max(*point));
        let spans = (greatest - least) / 2.0;
        prop_assert!((spans.max_element() - FILL).abs() < 1e-6, "{least} … {greatest}");
        let tight = if spans.x > spans.y { (least.x, greatest.x) } else { (least.y, greatest.y) };
        prop_assert!((tight.0 + tight.1).abs() < 1e-6);
        // In the other direction the margins need not be equal, but the box is inside.
        prop_assert!(least.min_element() > -FILL - 1e-6 && greatest.max_element() < FILL + 1e-6);
        // From the front (+z), the right and above.
        let towards = camera.world_from_camera.z_axis;
        prop_assert!(towards.z > towards.x && towards.x > 0.0 && towards.y > 0.0);
    }
}

#[test]
fn degenerate_boxes_are_framed_too() {
    let point = DVec3::new(3., 4., 5.);
    for bounds in
        [None, Some((point, point)), Some((point, point + DVec3::Z * 1e-9)), Some((-point * 1e30, point * 1e30))]
    {
        let camera = frame_camera(bounds, [640, 480]);
        assert!(camera.position.is_finite() && camera.world_from_camera.is_finite(), "{bounds:?}");
        let (low, high) = bounds.unwrap_or_default();
        assert_ne!(camera.position, (low + high) / 2.0);
    }
}

#[test]
fn bounds_are_those_of_the_placed_vertices() {
    let mut model = Model::triangle();
    let half = std::f64::consts::FRAC_1_SQRT_2;
    model.root(json!({ "mesh": 0, "translation": [10, 0, 0], "rotation": [0, 0, half, half] }));
    let (scene, _) = model.import();
    let (low, high) = bounds(&scene).unwrap();
    assert!(low.distance(DVec3::ZERO) < 1e-6 && high.distance(DVec3::new(10., 1., 0.)) < 1e-6, "{low} {high}");
    assert_eq!(bounds(&SceneBuilder::default()), None);
}

#[test]
fn a_bare_model_has_all_it_needs() {
    let (scene, warnings) = load(&Model::triangle(), None);
    assert!(warnings.is_empty());
    assert_eq!(scene.render.size, [300, 200]);
    assert_eq!(scene.lights.iter().map(|light| light.name.as_str()).collect::<Vec<_>>(), ["key", "fill", "rim"]);
    let scene = scene.build().unwrap();
    assert_eq!(scene.camera().name, "framed");
    assert_eq!(scene.objects()[0].name, "model/thing");
}

#[test]
fn an_empty_model_is_a_picture_of_the_background() {
    let (scene, warnings) = load(&Model::new(), None);
    assert_eq!(warnings.to_string(), "model.gltf: warning: the model shows no triangles");
    assert!(scene.build().unwrap().objects().is_empty());
}

#[test]
fn default_lights_follow_the_camera() {
    let at = |target: DVec3| {
        let projection = Projection::Perspective { fov_y: 1.0 };
        let camera = Camera::look_at("c", projection, DVec3::new(0., 0., 5.), target, DVec3::Y).unwrap();
        let lights = default_lights(&camera, None);
        lights.into_iter().map(|light| match light.kind {
            LightKind::Sun { direction, .. } => direction,
            other => panic!("{other:?}"),
        })
    };
    for (forward, sideways) in at(DVec3::ZERO).zip(at(DVec3::new(5., 0., 5.))) {
        assert!(forward.is_normalized() && sideways.is_normalized());
        // Turned right by a quarter: what was on the right is now behind (+z), what was behind is now on the left.
        assert!(sideways.distance(Vec3::new(-forward.z, forward.y, forward.x)) < 1e-6);
    }
}

fn with_views() -> Model {
    let mut model = Model::triangle();
    model.json["cameras"] = json!([
        { "type": "perspective", "name": "lens", "perspective": { "yfov": 0.5, "znear": 0.1, "aspectRatio": 3 } },
        { "type": "orthographic", "name": "plan", "orthographic": { "xmag": 7, "ymag": 2, "znear": 0, "zfar": 9 } },
    ]);
    let half = std::f64::consts::FRAC_1_SQRT_2;
    model.root(json!({ "camera": 0, "name": "front", "translation": [0, 0, 9], "scale": [3, 2, 1] }));
    model.root(json!({ "camera": 1, "translation": [0, 5, 0], "rotation": [-half, 0, 0, half] }));
    model
}

#[test]
fn cameras_of_the_model() {
    let (scene, _) = load(&with_views(), None);
    let names: Vec<_> = scene.cameras.iter().map(|camera| camera.name.as_str()).collect();
    assert_eq!(names, ["framed", "front", "plan"]);
    let front = &scene.cameras[1];
    assert_eq!(front.projection, Projection::Perspective { fov_y: f64::from(0.5_f32) });
    assert_eq!((front.position, front.world_from_camera), (DVec3::new(0., 0., 9.), DMat3::IDENTITY));
    let plan = &scene.cameras[2];
    assert_eq!(plan.projection, Projection::Orthographic { height: 4.0 });
    // It looks down, with −z at the top of the picture.
    assert!(plan.world_from_camera.z_axis.distance(DVec3::Y) < 1e-7);
    assert!(plan.world_from_camera.y_axis.distance(DVec3::NEG_Z) < 1e-7);
    assert!(plan.world_from_camera.x_axis.distance(DVec3::X) < 1e-7);
}

#[test]
fn a_camera_is_chosen_by_name() {
    let (scene, _) = load(&with_views(), Some("plan"));
    assert_eq!(scene.build().unwrap().camera().name, "plan");
    let (scene, _) = load(&with_views(), Some("fornt"));
    assert_eq!(
        scene.build().unwrap_err().to_string(),
        "error: there is no camera named `fornt` (did you mean `front`?)"
    );
}

#[test]
fn a_camera_without_directions_is_a_warning() {
    let mut model = with_views();
    model.json["nodes"][1]["scale"] = json!([1, 0, 1]);
    let (scene, warnings) = load(&model, None);
    assert_eq!(scene.cameras.len(), 2);
    assert_eq!(
        warnings.to_string(),
        "model.gltf: warning: nodes[1]: its camera has no direction (a scale of 0) and cannot be used"
    );
}

#[test]
fn lights_of_the_model() {
    let mut model = Model::triangle();
    model.json["extensions"] = json!({ "KHR_lights_punctual": { "lights": [
        { "type": "directional", "color": [1, 0.5, 0.25], "intensity": 4 },
        { "type": "point", "intensity": 10 },
        { "type": "spot", "spot": { "innerConeAngle": 0.25, "outerConeAngle": 0.5 } },
        { "type": "spot", "spot": {} },
    ] } });
    let half = std::f64::consts::FRAC_1_SQRT_2;
    for light in 0..4 {
        model.root(json!({
            "translation": [1, 2, 3], "rotation": [-half, 0, 0, half], "scale": [2, 2, 2],
            "extensions": { "KHR_lights_punctual": { "light": light } },
        }));
    }
    let (scene, warnings) = load(&model, None);
    assert!(warnings.is_empty());
    let kinds: Vec<_> = scene.lights.iter().map(|light| &light.kind).collect();
    let position = DVec3::new(1., 2., 3.);
    let LightKind::Sun { direction, irradiance } = kinds[0] else { panic!() };
    assert!(direction.distance(Vec3::Y) < 1e-6);
    assert_eq!(*irradiance, Vec3::new(4., 2., 1.));
    assert_eq!(*kinds[1], LightKind::Point { position, intensity: Vec3::splat(10.) });
    let LightKind::Spot { direction, inner_cos, outer_cos, intensity, .. } = kinds[2] else { panic!() };
    assert!(direction.distance(Vec3::NEG_Y) < 1e-6);
    assert!((inner_cos - 0.25_f32.cos()).abs() < 1e-6 && (outer_cos - 0.5_f32.cos()).abs() < 1e-6);
    assert_eq!(*intensity, Vec3::ONE);
    let LightKind::Spot { inner_cos, outer_cos, .. } = kinds[3] else { panic!() };
    assert!(*inner_cos == 1.0 && (outer_cos - std::f32::consts::FRAC_1_SQRT_2).abs() < 1e-6);
    assert!(scene.lights.iter().all(|light| light.shadows));
    scene.build().unwrap();
}

#[test]
fn a_file_store_knows_what_a_model_depends_on() {
    let files = FileStore::new().with_file("a.glb", Model::triangle().glb());
    load_model(Path::new("a.glb"), &files, ModelTime::Rest, None, [8, 8]).unwrap();
    assert_eq!(files.dependencies(), [Path::new("a.glb")]);
}
