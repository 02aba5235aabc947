//! Models that other programs exported. They are not part of the project; where they are absent, these tests skip.

use std::path::{Path, PathBuf};

use tusche::diag::Diagnostics;
use tusche::files::FileStore;
use tusche::math::DVec3;
use tusche::scene::SceneBuilder;
use tusche::scene::camera::{Camera, Projection};
use tusche::scene::framing;
use tusche::scene::gltf::ModelTime;

use super::load_model;

/// The path of a model, or `None` (told) where the models are absent. `TUSCHE_MODELS` names another folder of models.
fn shared(name: &str) -> Option<PathBuf> {
    let beside = || Path::new(env!("CARGO_MANIFEST_DIR")).join("../shared/models");
    let path = std::env::var_os("TUSCHE_MODELS").map_or_else(beside, PathBuf::from).join(name);
    if path.exists() {
        return Some(path);
    }
    eprintln!("SKIPPED: {} is absent", path.display());
    None
}

/// Objects, meshes, materials, textures, triangles.
type Counts = [usize; 5];

#[test]
fn counts() {
    let expected: [(&str, Counts); 7] = [
        ("FlightHelmet/FlightHelmet.gltf", [6, 6, 6, 15, 94_722]),
        ("kenney/alien.glb", [6, 6, 5, 0, 292]),
        ("kenney/cakeBirthday.glb", [6, 2, 7, 0, 444]),
        ("kenney/tile.glb", [1, 1, 2, 0, 20]),
        ("kenney/craft_speederD.gltf", [1, 1, 4, 0, 322]),
        ("fox/Fox.glb", [1, 1, 1, 1, 576]),
        ("bench/knots.glb", [10, 10, 10, 0, 104_762]),
    ];
    for (name, counts) in expected {
        let Some(path) = shared(name) else { continue };
        let (scene, warnings) = load(&path, ModelTime::Rest);
        assert_eq!(warnings.to_string(), "", "{name}");
        let scene = scene.build().unwrap_or_else(|faults| panic!("{name}: {faults}"));
        let found = [
            scene.objects().len(),
            scene.meshes().len(),
            scene.materials().len(),
            scene.textures().len(),
            scene.triangle_count(),
        ];
        assert_eq!(found, counts, "{name}");
        for mesh in scene.meshes() {
            assert!(mesh.normals.iter().all(|normal| normal.is_normalized()), "{name}");
            assert!(mesh.tangents.iter().all(|tangent| tangent.truncate().is_normalized()), "{name}");
        }
    }
}

#[test]
fn the_fox_walks() {
    let Some(path) = shared("fox/Fox.glb") else { return };
    let at = |frame: f64| framing::bounds(&load(&path, ModelTime::Frame(frame)).0).unwrap();
    let (first, tenth) = (at(0.0), at(10.0));
    assert_ne!(first, tenth);
    // Whatever it does, it stays a fox of the same size, standing on the ground.
    for (low, high) in [first, tenth] {
        assert!((high - low - DVec3::new(30., 75., 140.)).abs().max_element() < 15.0, "{low} {high}");
        assert!(low.y.abs() < 2.0, "{low}");
    }
}

#[test]
fn the_benchmark_brings_its_camera() {
    let Some(path) = shared("bench/knots.glb") else { return };
    let (scene, _) = load(&path, ModelTime::Rest);
    let camera = scene.cameras.iter().find(|camera| camera.name == "cam").unwrap();
    assert!(camera.position.distance(DVec3::new(0., 5.2, 12.5)) < 1e-6);
    let expected = Camera::look_at(
        "cam",
        Projection::Perspective { fov_y: 36.0_f64.to_radians() },
        DVec3::new(0., 5.2, 12.5),
        DVec3::new(0., 1.3, 0.),
        DVec3::Y,
    )
    .unwrap();
    let apart = camera.world_from_camera - expected.world_from_camera;
    assert!(apart.to_cols_array().iter().all(|difference| difference.abs() < 1e-6), "{camera:?}");
}

fn load(path: &Path, time: ModelTime) -> (SceneBuilder, Diagnostics) {
    load_model(path, &FileStore::new(), time, None, [1280, 720]).unwrap_or_else(|faults| panic!("{faults}"))
}
