//! Cutting shapes into triangles.
//!
//! All faces are grids: cells in rows, each cell two triangles and one polygon. Round shapes are *lathed*: a profile
//! turned about the y axis. Positions are computed in double precision from whole numbers, in a way that gives the
//! same bits to vertices that meet (see [`turn`] and [`coordinate`]).

use std::f64::consts::FRAC_PI_2;
use std::ops::RangeInclusive;

use super::{KNOT_COIL, Shape};
use crate::math::{DVec2, DVec3, Vec2};
use crate::scene::mesh::Mesh;

pub(super) fn mesh(shape: &Shape) -> Mesh {
    let mut cutter = Cutter { mesh: Mesh { name: shape.name().to_owned(), uvs: vec![Vec::new()], ..Mesh::default() } };
    match *shape {
        Shape::Sphere { radius, segments: [around, rings] } => {
            cutter.lathe(around, &arc(0.0, radius, 0.0, 0..=rings, 2 * rings, [0.0, 1.0]));
        }
        Shape::Box { size, segments } => cutter.cuboid(size, segments),
        Shape::Plane { size: [x, z], segments: [n, m] } => {
            cutter.face([x, 0.0, z], [n, 1, m], (DVec3::X, DVec3::Z));
        }
        Shape::Cylinder { radius, height, segments: [around, along] } => {
            cutter.lathe(around, &straight([radius, radius], height, along));
            cutter.cap(radius, height / 2.0, around, 1.0);
            cutter.cap(radius, -height / 2.0, around, -1.0);
        }
        Shape::Cone { radius, height, segments: [around, along] } => {
            cutter.lathe(around, &straight([0.0, radius], height, along));
            cutter.cap(radius, -height / 2.0, around, -1.0);
        }
        Shape::Torus { radius, tube_radius, segments: [around, tube] } => {
            cutter.lathe(around, &arc(radius, tube_radius, 0.0, 0..=tube, tube, [0.0, 1.0]));
        }
        Shape::Disc { radius, segments } => cutter.cap(radius, 0.0, segments, 1.0),
        Shape::Capsule { radius, height, segments: [around, rings] } => {
            cutter.lathe(around, &capsule(radius, height, rings));
        }
        Shape::Knot { radius, tube_radius, segments } => cutter.knot(radius, tube_radius, segments),
    }
    cutter.mesh
}

/// Sine and cosine of `i / n` of a full turn: exact at quarter turns, periodic in `i`, and symmetric between quarters.
fn turn(i: u32, n: u32) -> (f64, f64) {
    let quarters = 4 * u64::from(i % n);
    let (quarter, rest) = (quarters / u64::from(n), quarters % u64::from(n));
    let angle = FRAC_PI_2 * (rest as f64 / f64::from(n));
    let (sin, cos) = if rest == 0 { (0.0, 1.0) } else { (libm::sin(angle), libm::cos(angle)) };
    match quarter {
        0 => (sin, cos),
        1 => (cos, -sin),
        2 => (-sin, -cos),
        _ => (-cos, sin),
    }
}

/// The unit vector at `i / n` of the way around the y axis, counter-clockwise seen from above, from −z.
fn around_axis(i: u32, n: u32) -> DVec3 {
    let (sin, cos) = turn(i, n);
    DVec3::new(-sin, 0.0, -cos)
}

/// The `k`-th of `n` + 1 points that cut an edge centred on 0; the `n − k`-th has the same bits, negated.
fn coordinate(k: u32, n: u32, edge: f64) -> f64 {
    edge * ((2.0 * f64::from(k) - f64::from(n)) / (2.0 * f64::from(n)))
}

/// A point of a profile that is turned about the y axis.
#[derive(Clone, Copy)]
struct ProfilePoint {
    /// Distance from the axis; exactly 0 at a pole.
    radius: f64,
    y: f64,
    /// Outward normal: away from the axis, and up.
    normal: DVec2,
    /// Texture coordinate.
    v: f64,
}

/// An arc about a point `offset` from the axis and `y` high: `steps` of an `n`-th of a turn each, counted from the top,
/// over the given range of v.
fn arc(offset: f64, radius: f64, y: f64, steps: RangeInclusive<u32>, n: u32, v: [f64; 2]) -> Vec<ProfilePoint> {
    let (first, last) = (*steps.start(), *steps.end());
    steps
        .map(|k| {
            let (sin, cos) = turn(k, n);
            let share = f64::from(k - first) / f64::from(last - first);
            ProfilePoint {
                radius: offset + radius * sin,
                y: y + radius * cos,
                normal: DVec2::new(sin, cos),
                v: v[0] + (v[1] - v[0]) * share,
            }
        })
        .collect()
}

/// A straight profile from the top, with the radii at top and bottom.
fn straight([top, bottom]: [f64; 2], height: f64, along: u32) -> Vec<ProfilePoint> {
    let normal = DVec2::new(height, bottom - top).normalize();
    (0..=along)
        .map(|k| {
            let v = f64::from(k) / f64::from(along);
            ProfilePoint { radius: top + (bottom - top) * v, y: -coordinate(k, along, height), normal, v }
        })
        .collect()
}

fn capsule(radius: f64, height: f64, rings: u32) -> Vec<ProfilePoint> {
    let straight = height - 2.0 * radius;
    let quarter = FRAC_PI_2 * radius;
    // v follows the length along the profile, so that textures keep their proportions.
    let rim = quarter / (2.0 * quarter + straight);
    let mut profile = arc(0.0, radius, straight / 2.0, 0..=rings, 4 * rings, [0.0, rim]);
    let lower = arc(0.0, radius, -straight / 2.0, rings..=2 * rings, 4 * rings, [1.0 - rim, 1.0]);
    // A capsule as short as a ball has one rim, not two.
    let shared = usize::from(straight == 0.0);
    profile.extend_from_slice(&lower[shared..]);
    profile
}

struct Vertex {
    position: DVec3,
    normal: DVec3,
    uv: DVec2,
}

struct Cutter {
    mesh: Mesh,
}

impl Cutter {
    fn vertex(&mut self, vertex: Vertex) -> u32 {
        let mesh = &mut self.mesh;
        mesh.positions.push(vertex.position.as_vec3());
        mesh.normals.push(vertex.normal.as_vec3());
        mesh.uvs[0].push(Vec2::new(vertex.uv.x as f32, vertex.uv.y as f32));
        (mesh.positions.len() - 1) as u32
    }

    fn triangle(&mut self, corners: [u32; 3], polygon: u32) {
        self.mesh.triangles.push(corners);
        self.mesh.polygons.push(polygon);
    }

    fn next_polygon(&self) -> u32 {
        self.mesh.polygons.last().map_or(0, |last| last + 1)
    }

    /// A grid of `columns` × `rows` cells. `vertex(i, j)` counts columns to the right and rows down, seen from the front.
    fn grid(&mut self, [columns, rows]: [u32; 2], vertex: impl Fn(u32, u32) -> Vertex) {
        let first = self.mesh.positions.len() as u32;
        for j in 0..=rows {
            for i in 0..=columns {
                self.vertex(vertex(i, j));
            }
        }
        let polygon = self.next_polygon();
        let index = |i: u32, j: u32| first + j * (columns + 1) + i;
        for j in 0..rows {
            for i in 0..columns {
                let cell = polygon + j * columns + i;
                let [a, b, c, d] = [index(i, j), index(i + 1, j), index(i + 1, j + 1), index(i, j + 1)];
                self.triangle([a, d, c], cell);
                self.triangle([a, c, b], cell);
            }
        }
    }

    /// A profile, listed from the top, turned about the y axis.
    ///
    /// Where the profile touches the axis, each cell is one triangle whose tip has the normal and the u of the cell's
    /// middle: no single value would do for all of them.
    fn lathe(&mut self, around: u32, profile: &[ProfilePoint]) {
        let row = |cutter: &mut Self, point: &ProfilePoint| {
            let pole = point.radius == 0.0;
            let first = cutter.mesh.positions.len() as u32;
            for i in 0..=around {
                // A pole's vertices stand for cells, so there is one less of them.
                if pole && i == around {
                    break;
                }
                let (step, steps) = if pole { (2 * i + 1, 2 * around) } else { (i, around) };
                let outward = around_axis(step, steps);
                cutter.vertex(Vertex {
                    position: outward * point.radius + DVec3::Y * point.y,
                    normal: outward * point.normal.x + DVec3::Y * point.normal.y,
                    uv: DVec2::new(f64::from(step) / f64::from(steps), point.v),
                });
            }
            (first, pole)
        };
        let Some((top, rest)) = profile.split_first() else { return };
        let mut upper = row(self, top);
        for point in rest {
            let lower = row(self, point);
            let polygon = self.next_polygon();
            for i in 0..around {
                let (a, d) = (upper.0 + i, lower.0 + i);
                match (upper.1, lower.1) {
                    (false, false) => {
                        self.triangle([a, d, d + 1], polygon + i);
                        self.triangle([a, d + 1, a + 1], polygon + i);
                    }
                    (true, _) => self.triangle([a, d, d + 1], polygon + i),
                    (false, true) => self.triangle([a, d, a + 1], polygon + i),
                }
            }
            upper = lower;
        }
    }

    /// A flat round cap, one polygon, that faces up (`side` 1) or down (−1); it fits a lathed rim of the same radius.
    fn cap(&mut self, radius: f64, y: f64, around: u32, side: f64) {
        let polygon = self.next_polygon();
        let mut point = |outward: DVec3| {
            self.vertex(Vertex {
                position: outward * radius + DVec3::Y * y,
                normal: DVec3::Y * side,
                uv: DVec2::new(0.5 + 0.5 * outward.x, 0.5 + 0.5 * side * outward.z),
            })
        };
        let middle = point(DVec3::ZERO);
        let rim: Vec<_> = (0..around).map(|i| point(around_axis(i, around))).collect();
        for (i, &from) in rim.iter().enumerate() {
            let to = rim[(i + 1) % rim.len()];
            let corners = if side > 0.0 { [middle, from, to] } else { [middle, to, from] };
            self.triangle(corners, polygon);
        }
    }

    fn cuboid(&mut self, size: [f64; 3], segments: [u32; 3]) {
        let (x, y, z) = (DVec3::X, DVec3::Y, DVec3::Z);
        for axes in [(x, -y), (-x, -y), (-z, -y), (z, -y), (x, z), (x, -z)] {
            self.face(size, segments, axes);
        }
    }

    /// One face of a box, given by which way is right and which is down on it, seen from the front.
    fn face(&mut self, size: [f64; 3], segments: [u32; 3], (right, down): (DVec3, DVec3)) {
        let size = DVec3::from(size);
        let cells = |axis: DVec3| (0..3).find(|k| axis[*k] != 0.0).map_or(1, |k| segments[k]);
        let (columns, rows) = (cells(right), cells(down));
        let normal = down.cross(right);
        self.grid([columns, rows], |i, j| {
            // Coordinates are odd in their index, so the two faces at an edge agree whichever way they count.
            let across = right * coordinate(i, columns, right.abs().dot(size));
            let downwards = down * coordinate(j, rows, down.abs().dot(size));
            Vertex {
                position: across + downwards + normal * (normal.abs().dot(size) / 2.0),
                normal,
                uv: DVec2::new(f64::from(i) / f64::from(columns), f64::from(j) / f64::from(rows)),
            }
        });
    }

    /// A tube along the (2, 3) torus knot.
    ///
    /// The curve lies on a torus, whose normal is perpendicular to it everywhere: with it as frame the tube closes
    /// without a twist to hide. The normal of a tube of constant radius points away from the curve in any frame.
    fn knot(&mut self, radius: f64, tube_radius: f64, [along, tube]: [u32; 2]) {
        let coil = KNOT_COIL * radius;
        self.grid([along, tube], |i, j| {
            let (once, thrice) = (2 * i % along, turn(3 * i % along, along));
            let outward = around_axis(once, along);
            let (sin, cos) = thrice;
            let reach = radius + coil * cos;
            let sideways = DVec3::Y.cross(outward);
            let tangent = sideways * (2.0 * reach) + (DVec3::Y * cos - outward * sin) * (3.0 * coil);
            let normal = outward * cos + DVec3::Y * sin;
            let binormal = tangent.cross(normal).normalize();
            let (tube_sin, tube_cos) = turn(j, tube);
            let away = normal * tube_cos + binormal * tube_sin;
            Vertex {
                position: outward * reach + DVec3::Y * (coil * sin) + away * tube_radius,
                normal: away.normalize(),
                uv: DVec2::new(f64::from(i) / f64::from(along), f64::from(j) / f64::from(tube)),
            }
        });
    }
}
