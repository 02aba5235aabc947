//! Builds a scene in Rust, mesh and script included, without any file.
//!
//! Run it with `cargo run --release --example scene_by_hand`.

use tusche::diag::{Diagnostics, Source};
use tusche::film::Layer;
use tusche::math::{DAffine3, DVec3, Vec3};
use tusche::plan::Plan;
use tusche::render::{Control, PictureFile, RenderOptions, layers_of, render_files};
use tusche::scene::camera::{Camera, Projection};
use tusche::scene::light::{Light, LightKind};
use tusche::scene::material::{Material, Script};
use tusche::scene::mesh::Mesh;
use tusche::scene::settings::RayKinds;
use tusche::scene::{Object, SceneBuilder};
use tusche::shade::{Host, Shaders};

const SCRIPT: &str = r"
//! Paper whose ink is blue in the light and red in the shade.
fn surface(hit, p) {
    let lit = smoothstep(0.0, 1.0, luminance(hit.irradiance));
    #{
        base_color: rgb(0.9, 0.9, 0.85),
        line_color: mix(rgb(0.7, 0.1, 0.1), rgb(0.1, 0.2, 0.7), lit),
        line_width: 4.0,
    }
}
";

fn main() -> Result<(), Diagnostics> {
    let mut scene = SceneBuilder::default();
    scene.render.size = [320, 240];
    // Creases: the faces of the octahedron differ in their normals only.
    scene.lines.normal = Some(20.0);

    let projection = Projection::Perspective { fov_y: 30.0_f64.to_radians() };
    scene.cameras.push(Camera::look_at("camera", projection, DVec3::new(2.8, 2.1, 7.0), DVec3::ZERO, DVec3::Y)?);
    scene.lights.push(Light {
        name: "sun".into(),
        kind: LightKind::Sun { direction: Vec3::new(1.0, 2.0, 1.0).normalize(), irradiance: Vec3::splat(3.0) },
        shadows: true,
    });

    let script = scene.add_script(Script { source: Source::new("two_inks.rhai", SCRIPT), path: None });
    let material = scene.add_material(Material {
        name: "paper".into(),
        script,
        params: Default::default(),
        priority: None,
        dielectric_priority: 0,
        double_sided: true,
        lines: Default::default(),
        span: None,
    });
    // An octahedron: no normals given, so each face is flat.
    let mesh = scene.add_mesh(Mesh {
        name: "octahedron".into(),
        positions: vec![Vec3::X, Vec3::Y, Vec3::Z, Vec3::NEG_X, Vec3::NEG_Y, Vec3::NEG_Z],
        triangles: vec![[0, 1, 2], [1, 3, 2], [3, 4, 2], [4, 0, 2], [1, 0, 5], [3, 1, 5], [4, 3, 5], [0, 4, 5]],
        ..Mesh::default()
    });
    for (name, x) in [("left", -1.1), ("right", 1.1)] {
        scene.add_object(Object {
            name: name.into(),
            mesh,
            materials: vec![material],
            world_from_object: DAffine3::from_translation(DVec3::new(x, 0.0, 0.0)) * DAffine3::from_rotation_y(x),
            priority: None,
            visible_to: RayKinds::all(),
            lines: true,
            group: None,
            span: None,
        });
    }
    let scene = scene.build()?;

    let (shaders, _warnings) = Shaders::compile(&scene, &Host::new())?;
    let files = [PictureFile { path: "scene_by_hand.png".into(), layers: vec![Layer::Rgba] }];
    let plan = Plan::new(&scene, &shaders, &layers_of(&files));
    render_files(&scene, &shaders, &plan, &files, &RenderOptions::default(), &Control::default())?;
    Ok(())
}
