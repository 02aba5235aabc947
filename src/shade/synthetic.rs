//! Hits made by formula: what a renderer would hand to shaders, without a scene.
//!
//! They stand on a small stage: a ball of radius 1 on a plane, seen from in front, under a sun and a lamp whose shadows
//! the ball casts. Every column of [`HitBatch`] is filled, and values agree with each other as in a real picture
//! (unit normals on the side the ray came from, uv and polygons from the place, visibility from the stage), so that
//! branches of scripts are taken as often as they would be. Most hits are the camera's; some are mirrored, refracted,
//! shadow rays, or seen from behind.
//!
//! [`pairs`] are lines between such hits, as `line(pair, p)` gets them.
//!
//! No hit has attributes, so that `hit.attribute` gives its default.
//!
//! The same call gives the same bits on every machine. `tusche shader check` and `bench` run shaders over these hits.

use std::f32::consts::TAU;

use super::batch::{HitBatch, LightSample};
use super::names::PathKind;
use crate::math::{Vec2, Vec3, Vec4, portable};
use crate::sample::{NodePath, PairBatch, PairSide};
use crate::scene::settings::LineType;

/// Lights of the stage.
pub const LIGHTS: usize = 2;

/// Where the stage's camera stands.
const EYE: Vec3 = Vec3::new(0.0, 2.0, 7.0);
/// The ball, which touches the plane `y = 0`.
const CENTER: Vec3 = Vec3::new(0.0, 1.0, 0.0);
/// Pixels that one world unit at distance 1 covers: a picture 540 pixels tall, seen at 30 degrees.
const PIXELS_AT_UNIT_DISTANCE: f32 = 1008.0;
/// The plane reaches this far from the middle.
const PLANE_HALF: f32 = 4.0;
/// Polygons around the ball; half as many from pole to pole.
const AROUND: f32 = 32.0;
/// Polygons along each side of the plane.
const CELLS: f32 = 8.0;

/// A batch of `len` hits. Batches of other seeds hold other hits; `material_id` is 1.
#[must_use]
pub fn hits(len: usize, seed: u64) -> HitBatch {
    let mut batch = HitBatch {
        len,
        more_uvs: vec![Vec::with_capacity(len)],
        light_count: LIGHTS,
        time: 1.25,
        material_id: 1,
        ..HitBatch::default()
    };
    for row in 0..len {
        push(&mut batch, &mut Random::new(seed, row as u64));
    }
    batch
}

/// A batch of `len` lines between neighbouring hits of the stage, some at its rim. Batches of other seeds hold other lines.
#[must_use]
pub fn pairs(len: usize, seed: u64) -> PairBatch {
    let mut batch = PairBatch { len, ..PairBatch::default() };
    let hits = hits(2 * len, seed);
    for row in 0..len {
        let mut random = Random::new(!seed, row as u64);
        let is_miss = random.next() < 0.2;
        let same_object = hits.object_id[2 * row] == hits.object_id[2 * row + 1];
        batch.kind.push(match (is_miss, same_object) {
            (true, _) => LineType::Outline,
            (false, false) => LineType::Silhouette,
            _ => LineType::ALL[2 + (random.next() * (LineType::ALL.len() - 2) as f32) as usize],
        });
        batch.path.push(match hits.path_kind[2 * row] {
            PathKind::Reflection => NodePath::CAMERA.reflected(),
            PathKind::Refraction => NodePath::CAMERA.refracted(),
            _ => NodePath::CAMERA,
        });
        batch.distance.push(random.next());
        batch.own.push(random.next() < 0.5);
        batch.width.push(0.5 + 7.5 * random.next());
        batch.color.push([random.next(), random.next(), random.next()]);
        batch.opacity.push(if random.next() < 0.8 { 1.0 } else { random.next() });
        batch.pixel.push([960.0 * random.next(), 540.0 * random.next()]);
        for (index, side) in batch.sides.iter_mut().enumerate() {
            let hit = 2 * row + index;
            let is_miss = is_miss && index == 1;
            side.object.push(if is_miss { 0 } else { hits.object_id[hit] });
            side.material.push(if is_miss { 0 } else { hits.material_id });
            side.depth.push(if is_miss { PairSide::FARTHEST } else { hits.depth[hit] });
            side.position.push(if is_miss { [0.0; 3] } else { hits.position[hit].to_array() });
            side.normal.push(if is_miss { [0.0, 0.0, 1.0] } else { hits.normal[hit].to_array() });
            side.feature.push(if is_miss { [0.0; 3] } else { hits.color[hit].truncate().to_array() });
        }
    }
    batch
}

/// A place on the stage.
struct Place {
    position: Vec3,
    /// Outwards.
    normal: Vec3,
    /// Outwards, of the polygon around the place.
    geometric_normal: Vec3,
    /// Along u.
    tangent: Vec3,
    uv: Vec2,
    object_id: u32,
    polygon_id: u32,
    curvature: f32,
    /// How far uv moves along one world unit, about.
    uv_per_unit: f32,
}

fn push(batch: &mut HitBatch, random: &mut Random) {
    let place = if random.next() < 0.6 { on_ball(random) } else { on_plane(random) };
    let kind = match random.next() {
        x if x < 0.75 => PathKind::Camera,
        x if x < 0.87 => PathKind::Reflection,
        x if x < 0.95 => PathKind::Refraction,
        _ => PathKind::Shadow,
    };
    let front = random.next() < 0.9;
    let side = if front { 1.0 } else { -1.0 };
    let (geometric_normal, normal) = (place.geometric_normal * side, place.normal * side);
    let (incoming, distance, depth) = arrival(&place, kind, geometric_normal, random);

    batch.position.push(place.position);
    batch.normal.push(normal);
    batch.geometric_normal.push(geometric_normal);
    batch.incoming.push(incoming);
    batch.uv.push(place.uv);
    batch.more_uvs[0].push(Vec2::new(place.uv.y, 1.0 - place.uv.x) * 2.0);
    batch.tangent.push(place.tangent.extend(if random.next() < 0.8 { 1.0 } else { -1.0 }));
    let color = Vec3::new(random.next(), random.next(), random.next());
    batch.color.push(if random.next() < 0.5 { Vec4::ONE } else { color.extend(random.next()) });
    batch.object_id.push(place.object_id);
    batch.polygon_id.push(place.polygon_id);
    let (a, b) = (random.next(), random.next());
    // Folded into the lower triangle of the unit square.
    let (a, b) = if a + b > 1.0 { (1.0 - a, 1.0 - b) } else { (a, b) };
    batch.barycentric.push(Vec3::new(1.0 - a - b, a, b));
    batch.distance.push(distance);
    batch.depth.push(depth);
    batch.path_kind.push(kind);
    batch.front_facing.push(front);
    batch.pixels_per_unit.push(PIXELS_AT_UNIT_DISTANCE / depth);
    batch.curvature.push(place.curvature * side);
    batch.footprint.push(depth / PIXELS_AT_UNIT_DISTANCE);
    batch.uv_footprint.push(depth / PIXELS_AT_UNIT_DISTANCE * place.uv_per_unit);
    batch.lights.extend([sun(place.position, place.normal), lamp(place.position, place.normal)]);
}

fn on_ball(random: &mut Random) -> Place {
    let uv = Vec2::new(random.next(), random.next());
    // From pole to pole the height is uniform, so that the places are uniform on the ball.
    let normal = on_sphere(uv);
    let cell = (uv * Vec2::new(AROUND, AROUND / 2.0)).floor();
    let middle = (cell + 0.5) / Vec2::new(AROUND, AROUND / 2.0);
    let angle = uv.x * TAU;
    Place {
        position: CENTER + normal,
        normal,
        geometric_normal: on_sphere(middle),
        tangent: Vec3::new(-portable::sin(angle), 0.0, portable::cos(angle)),
        uv,
        object_id: 1,
        polygon_id: (cell.y * AROUND + cell.x) as u32,
        curvature: 1.0,
        uv_per_unit: 1.0 / TAU,
    }
}

/// The point of the unit sphere at `uv`: u around, v from the top down.
fn on_sphere(uv: Vec2) -> Vec3 {
    let height = 1.0 - 2.0 * uv.y;
    let radius = (1.0 - height * height).max(0.0).sqrt();
    let angle = uv.x * TAU;
    Vec3::new(radius * portable::cos(angle), height, radius * portable::sin(angle)).normalize()
}

fn on_plane(random: &mut Random) -> Place {
    let uv = Vec2::new(random.next(), random.next());
    let cell = (uv * CELLS).floor();
    let across = (uv * 2.0 - 1.0) * PLANE_HALF;
    Place {
        position: Vec3::new(across.x, 0.0, across.y),
        normal: Vec3::Y,
        geometric_normal: Vec3::Y,
        tangent: Vec3::X,
        uv,
        object_id: 2,
        polygon_id: (cell.y * CELLS + cell.x) as u32,
        curvature: 0.0,
        uv_per_unit: 0.5 / PLANE_HALF,
    }
}

/// Direction of the ray that met the place, its length, and the length of the path from the camera.
fn arrival(place: &Place, kind: PathKind, facing: Vec3, random: &mut Random) -> (Vec3, f32, f32) {
    let from_eye = place.position - EYE;
    if kind == PathKind::Camera && from_eye.dot(facing) < 0.0 {
        let distance = from_eye.length();
        return (from_eye / distance, distance, distance);
    }
    // From anywhere on the side that the hit faces.
    let from = on_sphere(Vec2::new(random.next(), random.next()));
    let from = if from.dot(facing) < 0.0 { -from } else { from };
    let distance = 0.25 + 6.0 * random.next();
    let before = if kind == PathKind::Camera { 0.0 } else { 2.0 + 6.0 * random.next() };
    (-from, distance, before + distance)
}

fn sun(position: Vec3, outwards: Vec3) -> LightSample {
    let direction = Vec3::new(0.48, 0.8, 0.36);
    let visibility = if is_shadowed(position, outwards, direction, f32::INFINITY) { 0.0 } else { 1.0 };
    LightSample { direction, radiance: Vec3::new(2.3, 2.25, 2.15), visibility }
}

fn lamp(position: Vec3, outwards: Vec3) -> LightSample {
    let towards = Vec3::new(-3.0, 2.5, 1.5) - position;
    let distance = towards.length();
    let direction = towards / distance;
    // A pane of coloured glass stands before half of the stage.
    let open = if position.z > 0.5 { 0.5 } else { 1.0 };
    let visibility = if is_shadowed(position, outwards, direction, distance) { 0.0 } else { open };
    LightSample { direction, radiance: Vec3::new(5.0, 7.0, 9.0) / (distance * distance), visibility }
}

/// Whether the ball is in the way.
fn is_shadowed(position: Vec3, outwards: Vec3, direction: Vec3, distance: f32) -> bool {
    let to_center = CENTER - position;
    let along = to_center.dot(direction);
    let is_on_ball = (to_center.length() - 1.0).abs() < 1e-3;
    if is_on_ball {
        return outwards.dot(direction) <= 0.0;
    }
    along > 0.0 && along < distance && to_center.length_squared() - along * along < 1.0
}

/// Numbers 0 ≤ x < 1 that look random, each row's by itself.
struct Random {
    state: u64,
}

impl Random {
    fn new(seed: u64, row: u64) -> Self {
        Self { state: mixed(seed ^ mixed(row.wrapping_add(1))) }
    }

    fn next(&mut self) -> f32 {
        self.state = self.state.wrapping_add(0x9E37_79B9_7F4A_7C15);
        (mixed(self.state) >> 40) as f32 / (1 << 24) as f32
    }
}

/// The finaliser of SplitMix64 (Steele, Lea, Flood 2014).
fn mixed(x: u64) -> u64 {
    let x = (x ^ (x >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
    let x = (x ^ (x >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
    x ^ (x >> 31)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn values_are_what_the_contract_promises() {
        let hits = hits(4096, 7);
        let unit = |v: Vec3| (v.length() - 1.0).abs() < 1e-5;
        for row in 0..hits.len {
            assert!(unit(hits.normal[row]) && unit(hits.geometric_normal[row]) && unit(hits.incoming[row]));
            assert!(unit(hits.tangent[row].truncate()) && hits.tangent[row].w.abs() == 1.0);
            assert!(hits.tangent[row].truncate().dot(hits.normal[row]).abs() < 1e-5);
            assert!(hits.incoming[row].dot(hits.geometric_normal[row]) <= 0.0, "the ray comes from the normal's side");
            assert!(hits.normal[row].dot(hits.geometric_normal[row]) > 0.0);
            assert!(hits.depth[row] >= hits.distance[row] && hits.distance[row] > 0.0);
            assert!(
                (hits.barycentric[row].element_sum() - 1.0).abs() < 1e-6 && hits.barycentric[row].min_element() >= 0.0
            );
            assert!(hits.uv[row].min_element() >= 0.0 && hits.uv[row].max_element() < 1.0);
            assert!(hits.position[row].y >= 0.0 && hits.pixels_per_unit[row] > 0.0);
        }
        for light in &hits.lights {
            assert!(unit(light.direction) && light.radiance.min_element() > 0.0);
            assert!((0.0..=1.0).contains(&light.visibility));
        }
    }

    #[test]
    fn every_column_is_filled_and_varies() {
        let hits = hits(512, 1);
        let HitBatch { len, position, more_uvs, object_id, polygon_id, path_kind, front_facing, lights, .. } = &hits;
        let lengths = [
            position.len(),
            hits.normal.len(),
            hits.geometric_normal.len(),
            hits.incoming.len(),
            hits.uv.len(),
            more_uvs[0].len(),
            hits.tangent.len(),
            hits.color.len(),
            object_id.len(),
            polygon_id.len(),
            hits.barycentric.len(),
            hits.distance.len(),
            hits.depth.len(),
            path_kind.len(),
            front_facing.len(),
            hits.pixels_per_unit.len(),
            hits.curvature.len(),
            hits.footprint.len(),
            hits.uv_footprint.len(),
            lights.len() / LIGHTS,
        ];
        assert_eq!(lengths, [*len; 20]);
        for kind in [PathKind::Camera, PathKind::Reflection, PathKind::Refraction, PathKind::Shadow] {
            assert!(path_kind.contains(&kind), "{kind:?}");
        }
        assert!(front_facing.contains(&true) && front_facing.contains(&false));
        assert!(object_id.contains(&1) && object_id.contains(&2));
        for light in 0..LIGHTS {
            let visibilities: Vec<f32> = lights.iter().skip(light).step_by(LIGHTS).map(|l| l.visibility).collect();
            assert!(visibilities.contains(&0.0) && visibilities.contains(&1.0), "light {light} casts shadows");
        }
        assert!(lights.iter().any(|light| light.visibility == 0.5));
    }

    #[test]
    fn lines_are_of_every_kind_and_agree_with_themselves() {
        let pairs = pairs(512, 1);
        for kind in LineType::ALL {
            assert!(pairs.kind.contains(&kind), "{kind:?}");
        }
        for row in 0..pairs.len {
            let [own, other] = pairs.sides.each_ref().map(|side| side.object[row]);
            assert!(own > 0 && (other == 0) == (pairs.kind[row] == LineType::Outline));
            assert_eq!(pairs.sides[1].depth[row] == PairSide::FARTHEST, other == 0);
            assert!((0.0..1.0).contains(&pairs.distance[row]) && (0.0..=1.0).contains(&pairs.opacity[row]));
        }
    }

    #[test]
    fn a_longer_batch_begins_with_the_shorter_one() {
        let (short, long) = (hits(10, 3), hits(20, 3));
        assert_eq!(short.position, long.position[..10]);
        assert_eq!(short.lights, long.lights[..10 * LIGHTS]);
        assert_ne!(hits(10, 4).position, short.position);
    }
}
