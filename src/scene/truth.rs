//! `[truth]`: which lines a picture must show, known by geometry. Rendering does not look at it; a study measures against it.

use std::f64::consts::TAU;

use super::camera::{Camera, Projection};
use crate::diag::Span;
use crate::math::{DVec2, DVec3};

/// All lines that a picture must show, and where they were declared.
#[derive(Clone, Debug)]
pub struct Truth {
    /// The lines. Where they cover each other, they are one.
    pub curves: Vec<TruthCurve>,
    /// Where it was declared.
    pub span: Option<Span>,
}

/// A line along a curve: all that is within half its width of it.
#[derive(Clone, Debug, PartialEq)]
pub struct TruthCurve {
    /// The curve.
    pub shape: TruthShape,
    /// Full width in pixels.
    pub width: f64,
}

/// A curve that edges of a picture lie on.
#[derive(Clone, Debug, PartialEq)]
pub enum TruthShape {
    /// Straight edges from point to point of the film, in pixels from the upper left corner.
    Film(Vec<DVec2>),
    /// A circle on the film, in pixels.
    FilmCircle {
        /// Its middle.
        center: DVec2,
        /// Its radius.
        radius: f64,
    },
    /// Straight edges from point to point of the world.
    World(Vec<DVec3>),
    /// The outline of a ball.
    Ball {
        /// Its middle in the world.
        center: DVec3,
        /// Its radius in world units.
        radius: f64,
    },
    /// The rim of a flat disc.
    Disc {
        /// Its middle in the world.
        center: DVec3,
        /// Two radii at a right angle.
        axes: [DVec3; 2],
    },
}

/// How far the straight pieces of a circle may lie inside of it, in pixels.
const FLATNESS: f64 = 1e-4;
/// The most pieces of a circle.
const MOST_PIECES: f64 = 65_536.0;

impl TruthShape {
    /// The curve on the film of a picture of `size` pixels, as points that straight pieces join, in pixels from the upper left
    /// corner. `None` if some of it is not before the camera.
    #[must_use]
    pub fn on_film(&self, camera: &Camera, size: [u32; 2]) -> Option<Vec<DVec2>> {
        let project = |point: DVec3| camera.film_position(size, point);
        match self {
            Self::Film(points) => Some(points.clone()),
            Self::FilmCircle { center, radius } => {
                Some(circle(*radius).map(|[cos, sin]| *center + *radius * DVec2::new(cos, sin)).collect())
            }
            Self::World(points) => points.iter().copied().map(project).collect(),
            Self::Ball { center, radius } => {
                let (center, axes) = outline(camera, *center, *radius)?;
                projected_circle(center, axes, project)
            }
            Self::Disc { center, axes } => projected_circle(*center, *axes, project),
        }
    }
}

/// The circle on a ball along which a camera's rays touch it: its middle, and two radii at a right angle. `None` if the camera is
/// inside.
fn outline(camera: &Camera, center: DVec3, radius: f64) -> Option<(DVec3, [DVec3; 2])> {
    let Projection::Perspective { .. } = camera.projection else {
        let [x, y] = [camera.world_from_camera.x_axis, camera.world_from_camera.y_axis];
        return Some((center, [x * radius, y * radius]));
    };
    let way = center - camera.position;
    let distance = way.length();
    let sine = radius / distance;
    if sine.is_nan() || sine >= 1.0 {
        return None;
    }
    let toward = way / distance;
    let (x, y) = toward.any_orthonormal_pair();
    let rim = radius * (1.0 - sine * sine).sqrt();
    Some((center - toward * (radius * sine), [x * rim, y * rim]))
}

fn projected_circle(
    center: DVec3,
    axes: [DVec3; 2],
    project: impl Fn(DVec3) -> Option<DVec2> + Copy,
) -> Option<Vec<DVec2>> {
    let points = |radius: f64| circle(radius).map(move |[cos, sin]| center + axes[0] * cos + axes[1] * sin);
    // How large it is on the film tells how finely to cut it.
    let rough = points(1.0).map(project).collect::<Option<Vec<_>>>()?;
    let middle = project(center)?;
    let largest = rough.iter().map(|point| point.distance(middle)).fold(0.0, f64::max);
    points(largest).map(project).collect()
}

/// Cosines and sines of angles all around that cut a circle of a radius finely enough; the last is the first.
fn circle(radius: f64) -> impl Iterator<Item = [f64; 2]> {
    // A piece of angle a lies radius · a² / 8 inside.
    let pieces = (TAU * (radius / (8.0 * FLATNESS)).sqrt()).clamp(64.0, MOST_PIECES).ceil();
    (0..=pieces as u32).map(move |i| {
        let angle = TAU * f64::from(i % pieces as u32) / pieces;
        [libm::cos(angle), libm::sin(angle)]
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    const SIZE: [u32; 2] = [320, 200];

    fn camera(projection: Projection) -> Camera {
        let position = DVec3::new(3.0, 2.0, 7.0);
        Camera::look_at("c", projection, position, DVec3::new(0.2, 0.1, 0.0), DVec3::Y).expect("a good camera")
    }

    #[test]
    fn points_lie_on_the_film_where_their_rays_start() {
        for projection in [Projection::Perspective { fov_y: 0.7 }, Projection::Orthographic { height: 4.0 }] {
            let camera = Camera { film_shift: DVec2::new(3.5, -1.25), ..camera(projection) };
            for (pixel, offset) in [([17, 33], [0.25, 0.75]), ([300, 190], [0.5, 0.0])] {
                let (origin, direction) = camera.ray(SIZE, pixel, offset);
                let point = camera.position + origin.as_dvec3() + direction.as_dvec3() * 5.0;
                let found = camera.film_position(SIZE, point).expect("it is seen");
                let expected = [0, 1].map(|axis| f64::from(pixel[axis]) + f64::from(offset[axis]));
                assert!(found.distance(DVec2::from(expected)) < 1e-3, "{projection:?}: {found} for {expected:?}");
            }
        }
        let behind = DVec3::new(6.0, 4.0, 14.0);
        assert_eq!(camera(Projection::Perspective { fov_y: 0.7 }).film_position(SIZE, behind), None);
    }

    /// Rays just inside of the outline meet the ball, and those just outside do not.
    #[test]
    fn outlines_of_balls_are_where_rays_touch_them() {
        let (center, radius) = (DVec3::new(0.4, -0.3, 0.5), 0.8);
        for projection in [Projection::Perspective { fov_y: 0.9 }, Projection::Orthographic { height: 4.0 }] {
            let camera = camera(projection);
            let outline = TruthShape::Ball { center, radius }.on_film(&camera, SIZE).expect("it is seen");
            assert_eq!(outline.first(), outline.last(), "it is closed");
            let middle = outline.iter().skip(1).sum::<DVec2>() / (outline.len() - 1) as f64;
            for point in outline.iter().step_by(50) {
                for (share, meets) in [(0.9995, true), (1.0005, false)] {
                    let film = middle + (*point - middle) * share;
                    let pixel = [film.x.floor(), film.y.floor()];
                    let offset = [film.x - pixel[0], film.y - pixel[1]].map(|x| x as f32);
                    let (origin, direction) = camera.ray(SIZE, pixel.map(|x| x as i32), offset);
                    let (origin, direction) = (camera.position + origin.as_dvec3(), direction.as_dvec3());
                    let nearest = origin + direction * (center - origin).dot(direction);
                    assert_eq!(nearest.distance(center) < radius, meets, "{projection:?} at {film}");
                }
            }
        }
    }

    #[test]
    fn circles_are_cut_finely_and_what_is_behind_is_told() {
        let camera = camera(Projection::Perspective { fov_y: 0.7 });
        let shape = TruthShape::FilmCircle { center: DVec2::new(50.0, 40.0), radius: 30.0 };
        let points = shape.on_film(&camera, SIZE).expect("the film is before the camera");
        for pair in points.windows(2) {
            let middle = (pair[0] + pair[1]) / 2.0;
            assert!((middle.distance(DVec2::new(50.0, 40.0)) - 30.0).abs() <= 1.01 * FLATNESS);
        }
        let around = TruthShape::Ball { center: camera.position + DVec3::X, radius: 2.0 };
        assert_eq!(around.on_film(&camera, SIZE), None, "the camera is inside");
        let crossing = TruthShape::World(vec![DVec3::ZERO, DVec3::new(6.0, 4.0, 14.0)]);
        assert_eq!(crossing.on_film(&camera, SIZE), None);
    }
}
