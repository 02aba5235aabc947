//! Models that other programs exported. They are not part of the project; where they are absent, these tests skip.

use std::path::{Path, PathBuf};

use tusche::files::FileStore;
use tusche::scene::framing;
use tusche::scene::gltf::{ModelTime, load_model};

/// The path of a model, or `None` (told) where the models are absent.
fn shared(name: &str) -> Option<PathBuf> {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../shared/models").join(name);
    let path = match std::env::var_os("TUSCHE_MODELS") {
        Some(folder) => Path::new(&folder).join(name),
        None => path,
    };
    if path.exists() {
        return Some(path);
    }
    eprintln!("SKIPPED: {} is absent", path.display());
    None
}

#[test]
fn table() {
    for name in [
        "FlightHelmet/FlightHelmet.gltf",
        "kenney/alien.glb",
        "kenney/cakeBirthday.glb",
        "kenney/tile.glb",
        "kenney/craft_speederD.gltf",
        "fox/Fox.glb",
        "bench/knots.glb",
    ] {
        let Some(path) = shared(name) else { continue };
        let start = std::time::Instant::now();
        let (scene, warnings) = load_model(&path, &FileStore::new(), ModelTime::Rest, None, [1280, 720]).unwrap();
        let seconds = start.elapsed().as_secs_f64();
        let triangles: usize = scene.meshes.iter().map(|m| m.triangles.len()).sum();
        let vertices: usize = scene.meshes.iter().map(|m| m.positions.len()).sum();
        println!(
            "== {name} {seconds:.3}s objects {} meshes {} materials {} textures {} triangles {triangles} vertices {vertices}",
            scene.objects.len(),
            scene.meshes.len(),
            scene.materials.len(),
            scene.textures.len()
        );
        println!("{:?}", framing::bounds(&scene));
        println!("{warnings}");
        for o in &scene.objects {
            println!("  {} {:?} {:?} det {}", o.name, o.mesh, o.materials, o.world_from_object.matrix3.determinant());
        }
        for m in &scene.meshes {
            println!(
                "  mesh {} n{} t{} uv{} c{} slots{}",
                m.name,
                m.normals.len(),
                m.tangents.len(),
                m.uvs.len(),
                m.colors.len(),
                m.slot_count()
            );
        }
        for m in &scene.materials {
            println!(
                "  mat {} ds{} {:?}",
                m.name,
                m.double_sided,
                m.params.iter().map(|(k, v)| (k, &v.0)).collect::<Vec<_>>()
            );
        }
        for c in &scene.cameras {
            println!("  {c:?}");
        }
        println!("  {:?}", scene.lights.iter().map(|l| &l.name).collect::<Vec<_>>());
        scene.build().unwrap();
    }
}
