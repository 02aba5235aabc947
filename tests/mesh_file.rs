//! Meshes from OBJ and PLY files.

use std::path::Path;

use crate::common::{golden, render_with, root};
use proptest::prelude::*;
use tusche::files::FileStore;
use tusche::film::Layer;
use tusche::math::{Vec2, Vec3};
use tusche::render::RenderOptions;
use tusche::scene::file;
use tusche::scene::mesh::Mesh;
use tusche::scene::mesh_file::read;

const CUBE: &str = "\
# a cube of quadrangles, one of them a hexagon's half
mtllib nowhere.mtl
o cube
v -1 -1 -1
v  1 -1 -1
v  1  1 -1
v -1  1 -1
v -1 -1  1
v  1 -1  1
v  1  1  1
v -1  1  1
vt 0 0
vt 1 0
vt 1 1
vt 0 1
g sides
usemtl red
s off
f 1/1 4/4 3/3 2/2
f 5/1 6/2 7/3 8/4
f 1/1 2/2 6/3 5/4
f 2/1 3/2 7/3 6/4
f 3/1 4/2 8/3 7/4
f -8/1 -4/2 -1/3 -5/4
";

fn mesh(name: &str, contents: impl Into<Vec<u8>>) -> Result<Mesh, String> {
    let path = Path::new(name);
    let files = FileStore::new().with_file(path, contents);
    read(path, &files).map(|mesh| (*mesh).clone()).map_err(|fault| fault.render(false))
}

#[test]
fn an_obj_keeps_polygons_and_shares_corners_that_are_alike() {
    let cube = mesh("cube.obj", CUBE).unwrap_or_else(|fault| panic!("{fault}"));
    assert_eq!(cube.triangles.len(), 12);
    assert_eq!(cube.polygons, (0..6).flat_map(|face| [face, face]).collect::<Vec<_>>());
    assert!(cube.is_closed(), "its faces look outwards, all of them");
    // Three faces meet in each corner, with texture coordinates of their own: of 24 corners some are alike.
    assert!((8..=24).contains(&cube.positions.len()), "{}", cube.positions.len());
    assert!(cube.normals.is_empty());
    // v grows downwards here, and upwards there.
    let at = |position: Vec3| cube.positions.iter().position(|known| *known == position);
    let corner = at(Vec3::new(1.0, -1.0, -1.0)).expect("the second vertex is used");
    assert!([Vec2::new(1.0, 1.0), Vec2::new(0.0, 1.0)].contains(&cube.uvs[0][corner]), "{}", cube.uvs[0][corner]);
}

#[test]
fn normals_count_only_if_every_corner_has_one() {
    let text = "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nvn 0 0 2\nvn 0 0 0\n";
    let all = mesh("a.obj", format!("{text}f 1//1 2//1 3//2\n")).unwrap_or_else(|fault| panic!("{fault}"));
    assert_eq!(all.normals, [Vec3::Z, Vec3::Z, Vec3::ZERO]);
    let some = mesh("a.obj", format!("{text}f 1//1 2//1 3//2\nf 1 2 4\n")).unwrap_or_else(|fault| panic!("{fault}"));
    assert!(some.normals.is_empty() && some.triangles.len() == 2 && some.positions.len() == 4, "{some:?}");
}

/// A square of one quadrangle or two triangles, in one of three encodings.
fn ply(encoding: &str, quadrangle: bool) -> Vec<u8> {
    let faces: &[&[i32]] = if quadrangle { &[&[0, 1, 2, 3]] } else { &[&[0, 1, 2], &[0, 2, 3]] };
    let mut bytes = format!(
        "ply\nformat {encoding} 1.0\ncomment a square\nelement vertex 4\nproperty float x\nproperty float y\n\
         property double z\nproperty float nx\nproperty float ny\nproperty float nz\nproperty uchar red\n\
         property uchar green\nproperty uchar blue\nproperty float s\nproperty float t\nproperty int flags\n\
         element face {}\nproperty list uchar int vertex_indices\nelement edge 1\nproperty int a\nend_header\n",
        faces.len()
    )
    .into_bytes();
    let corners = [[0.0_f32, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]];
    if encoding == "ascii" {
        for [x, y] in corners {
            bytes.extend(format!("{x} {y} 0.5 0 0 1 255 128 0 {x} {y} 7\n").bytes());
        }
        for face in faces {
            let list: Vec<String> = face.iter().map(i32::to_string).collect();
            bytes.extend(format!("{} {}\n", face.len(), list.join(" ")).bytes());
        }
        bytes.extend(b"3\n");
        return bytes;
    }
    let big = encoding == "binary_big_endian";
    let four = |bits: u32| if big { bits.to_be_bytes() } else { bits.to_le_bytes() };
    for [x, y] in corners {
        bytes.extend([x, y].map(|x| four(x.to_bits())).concat());
        bytes.extend(if big { 0.5_f64.to_be_bytes() } else { 0.5_f64.to_le_bytes() });
        bytes.extend([0.0_f32, 0.0, 1.0].map(|x| four(x.to_bits())).concat());
        bytes.extend([255, 128, 0]);
        bytes.extend([x.to_bits(), y.to_bits(), 7].map(four).concat());
    }
    for face in faces {
        bytes.push(face.len() as u8);
        face.iter().for_each(|index| bytes.extend(four(*index as u32)));
    }
    bytes.extend(four(3));
    bytes
}

#[test]
fn ply_is_the_same_in_all_encodings() {
    for quadrangle in [false, true] {
        let read = |encoding: &str| {
            mesh("square.ply", ply(encoding, quadrangle)).unwrap_or_else(|fault| panic!("{encoding}: {fault}"))
        };
        let text = read("ascii");
        assert_eq!(text.triangles, [[0, 1, 2], [0, 2, 3]]);
        assert_eq!(text.polygons, if quadrangle { vec![0, 0] } else { Vec::new() });
        assert_eq!(text.positions[2], Vec3::new(1.0, 1.0, 0.5));
        assert_eq!(text.normals, [Vec3::Z; 4]);
        assert_eq!(text.uvs[0][1], Vec2::new(1.0, 1.0));
        // Half of what a screen shows at most is about a fifth of its light.
        let color = text.colors[0];
        assert!(color.x == 1.0 && (color.y - 0.2159).abs() < 1e-3 && color.z == 0.0 && color.w == 1.0, "{color}");
        assert_eq!(read("binary_little_endian"), text);
        assert_eq!(read("binary_big_endian"), text);
    }
}

/// Objects of one file share its mesh, and a mesh draws what a shape draws.
#[test]
fn scenes_have_objects_of_meshes() {
    let picture = |object: &str| {
        let text = format!(
            "[render]\nsize = [48, 48]\nsamples = 4\n[camera]\nposition = [3, 2, 5]\ntarget = [0, 0, 0]\n\
             [[objects]]\n{object}\n[[objects]]\n{object}\ntranslate = [0.5, 0.5, 0.5]\n"
        );
        let path = Path::new("scene.toml");
        let files = FileStore::new().with_file(path, text).with_file("cube.obj", CUBE);
        let scene = file::load(path, &files, &[], &file::LoadOptions::default())
            .and_then(|(builder, _)| builder.build())
            .unwrap_or_else(|faults| panic!("{faults}"));
        assert_eq!((scene.objects().len(), scene.meshes().len()), (2, 1), "{object}");
        render_with(&scene, &[Layer::Rgba, Layer::Object], &RenderOptions::default()).0
    };
    let (mesh, shape) = (picture("mesh = \"cube.obj\""), picture("shape = \"box\""));
    let differ = |(a, b): (&Vec<f32>, &Vec<f32>)| a.iter().zip(b).filter(|(a, b)| (*a - *b).abs() > 1e-3).count();
    let differ: usize = mesh.channels.iter().zip(&shape.channels).map(differ).sum();
    assert_eq!(differ, 0);
}

/// What is wrong is told, with the line where there are lines.
#[test]
fn what_is_no_mesh_is_told() {
    let ply_head = "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\nproperty float z\n";
    let corners = "0 0 0\n1 0 0\n0 1 0\n";
    let faces = |count: u64, list: &str| {
        format!("{ply_head}element face {count}\nproperty list uchar int vertex_indices\nend_header\n{corners}{list}")
    };
    let cases: Vec<(&str, &str, Vec<u8>)> = vec![
        ("an empty file", "a.obj", Vec::new()),
        ("no faces", "a.obj", b"v 0 0 0\nv 1 0 0\nv 0 1 0\n".to_vec()),
        ("letters for a number", "a.obj", b"v 0 0 0\nv 1 zero 0\n".to_vec()),
        ("a corner too few", "a.obj", b"v 0 0 0\nv 1 0 0\nf 1 2\n".to_vec()),
        ("a vertex that is not there", "a.obj", b"v 0 0 0\nv 1 0 0\nf 1 2 3\n".to_vec()),
        ("far before the first vertex", "a.obj", b"v 0 0 0\nf -1 -2 -3\n".to_vec()),
        ("vertex 0", "a.obj", b"v 0 0 0\nf 0 0 0\n".to_vec()),
        ("no corner", "a.obj", b"v 0 0 0\nf 1 x 1\n".to_vec()),
        ("not a number", "a.obj", b"v NaN 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n".to_vec()),
        ("not text", "a.obj", vec![0xFF, 0xFE, 0, 0xC3, 0x28]),
        ("not a ply", "a.ply", b"obj\n".to_vec()),
        ("an index too large", "a.ply", faces(1, "3 0 1 3\n").into_bytes()),
        ("a negative index", "a.ply", faces(1, "3 0 1 -1\n").into_bytes()),
        ("two corners", "a.ply", faces(1, "2 0 1\n").into_bytes()),
        ("more faces promised than there are", "a.ply", faces(4_000_000_000_000, "3 0 1 2\n").into_bytes()),
        ("a word for a number", "a.ply", faces(1, "3 0 one 2\n").into_bytes()),
        ("cut off", "a.ply", ply("binary_little_endian", true)[..400].to_vec()),
        ("a glTF model", "a.glb", Vec::new()),
        ("another kind", "a.stl", Vec::new()),
    ];
    let mut told = String::new();
    for (what, name, bytes) in cases {
        let fault = mesh(name, bytes).expect_err(what);
        told.push_str(&format!("--- {what}\n{fault}\n"));
    }
    golden(&root().join("tests/golden/mesh_file/faults.txt"), &told);
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(600))]

    /// Bytes changed, cut out and repeated: there is a mesh or a message, and the mesh is sound.
    #[test]
    fn damaged_files_give_a_mesh_or_a_message(
        which in 0..4usize,
        damage in proptest::collection::vec((any::<u16>(), any::<u8>(), 0..4u8, 1..30usize), 1..8),
    ) {
        let (name, mut bytes) = match which {
            0 => ("a.obj", CUBE.as_bytes().to_vec()),
            1 => ("a.ply", ply("ascii", true)),
            2 => ("a.ply", ply("binary_little_endian", false)),
            _ => ("a.ply", ply("binary_big_endian", true)),
        };
        for (place, byte, kind, length) in damage {
            if bytes.is_empty() {
                break;
            }
            let place = usize::from(place) % bytes.len();
            let end = (place + length).min(bytes.len());
            match kind {
                0 => bytes[place] = byte,
                1 => drop(bytes.drain(place..end)),
                2 => {
                    let again = bytes[place..end].to_vec();
                    bytes.splice(place..place, again);
                }
                _ => bytes[place] = b"0123456789-/ \n"[usize::from(byte) % 14],
            }
        }
        if let Ok(mesh) = mesh(name, bytes) {
            let vertices = mesh.positions.len();
            prop_assert!(mesh.triangles.iter().flatten().all(|vertex| (*vertex as usize) < vertices));
            prop_assert!(mesh.normals.is_empty() || mesh.normals.len() == vertices);
            prop_assert!(mesh.uvs.iter().all(|set| set.len() == vertices));
            prop_assert!(mesh.positions.iter().all(|position| position.is_finite()));
        }
    }
}
