//! Cameras: from a film position to a ray.

use crate::diag::Diagnostic;
use crate::math::{DMat3, DVec2, DVec3, Vec3, portable};

/// How directions relate to film positions.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Projection {
    /// A pinhole.
    Perspective {
        /// Vertical field of view in radians, 0 < fov < π.
        fov_y: f64,
    },
    /// Parallel rays.
    Orthographic {
        /// Height of the view in world units, > 0.
        height: f64,
    },
}

/// A camera. Film positions are in pixels from the upper left corner of the picture.
#[derive(Clone, Debug, PartialEq)]
pub struct Camera {
    /// Its name, for `--camera`.
    pub name: String,
    /// Perspective or orthographic.
    pub projection: Projection,
    /// World position.
    pub position: DVec3,
    /// Rotation of the camera's axes into the world: columns are right, up and *backward*.
    pub world_from_camera: DMat3,
    /// How far the film is moved, in pixels: the picture's (0, 0) shows what lies at this film position otherwise.
    pub film_shift: DVec2,
}

impl Camera {
    /// A camera at `position` that looks at `target`, with `up` pointing upwards in the picture.
    ///
    /// # Errors
    /// If the camera looks at itself, along its up vector, or a number is not finite.
    pub fn look_at(
        name: impl Into<String>,
        projection: Projection,
        position: DVec3,
        target: DVec3,
        up: DVec3,
    ) -> Result<Self, Diagnostic> {
        if !(position.is_finite() && target.is_finite() && up.is_finite()) {
            return Err(Diagnostic::error("camera position, target and up must be finite numbers"));
        }
        let backward = (position - target)
            .try_normalize()
            .ok_or_else(|| Diagnostic::error("the camera looks at itself: position and target are the same point"))?;
        let right = up
            .try_normalize()
            .map(|up| up.cross(backward))
            .filter(|right| right.length() > 1e-9)
            .ok_or_else(|| Diagnostic::error("the camera's up vector is zero or points along the line of sight"))?
            .normalize();
        let up = backward.cross(right);
        Ok(Self {
            name: name.into(),
            projection,
            position,
            world_from_camera: DMat3::from_cols(right, up, backward),
            film_shift: DVec2::ZERO,
        })
    }

    /// The ray through a film position of a picture of `size` pixels: [`CameraRays::ray`], for those who want only one.
    #[must_use]
    pub fn ray(&self, size: [u32; 2], pixel: [i32; 2], offset: [f32; 2]) -> (Vec3, Vec3) {
        self.rays(size).ray(pixel, offset)
    }

    /// Makes ready for many rays of a picture of `size` pixels.
    #[must_use]
    pub fn rays(&self, size: [u32; 2]) -> CameraRays {
        let half = match self.projection {
            Projection::Perspective { fov_y } => libm::tan(fov_y / 2.0),
            Projection::Orthographic { height } => height / 2.0,
        };
        CameraRays {
            is_orthographic: matches!(self.projection, Projection::Orthographic { .. }),
            half,
            size: size.map(f64::from),
            film_shift: self.film_shift,
            world_from_camera: self.world_from_camera,
        }
    }

    /// Where a point of the world lies on the film of a picture of `size` pixels, in pixels from its upper left corner; `None` if it
    /// is not before the camera.
    #[must_use]
    pub fn film_position(&self, size: [u32; 2], world: DVec3) -> Option<DVec2> {
        let seen = self.world_from_camera.transpose() * (world - self.position);
        let half_view = match self.projection {
            Projection::Perspective { fov_y } if seen.z < 0.0 => -seen.z * libm::tan(fov_y / 2.0),
            Projection::Perspective { .. } => return None,
            Projection::Orthographic { height } => height / 2.0,
        };
        let [width, height] = size.map(f64::from);
        let scale = height / 2.0 / half_view;
        Some(DVec2::new(width / 2.0 + seen.x * scale, height / 2.0 - seen.y * scale) - self.film_shift)
    }

    /// The angle between the rays of neighbouring pixels in the middle of the picture (radians; 0 if parallel) and
    /// the distance between their origins (world units; 0 if they meet).
    #[must_use]
    pub fn pixel_spread(&self, height_px: u32) -> (f32, f32) {
        match self.projection {
            Projection::Perspective { fov_y } => (2.0 * portable::tan((fov_y / 2.0) as f32) / height_px as f32, 0.0),
            Projection::Orthographic { height } => (0.0, (height / f64::from(height_px)) as f32),
        }
    }
}

/// A camera's rays for a picture of some size.
#[derive(Clone, Copy, Debug)]
pub struct CameraRays {
    is_orthographic: bool,
    /// Half the height of the view: at distance 1, or in world units.
    half: f64,
    /// In pixels.
    size: [f64; 2],
    film_shift: DVec2,
    world_from_camera: DMat3,
}

impl CameraRays {
    /// The ray through a film position: origin and direction.
    ///
    /// The origin is relative to the camera's position, so that rays keep their precision far from the world's origin.
    /// The film position is a whole pixel plus an offset in 0 … 1, so that wide pictures keep theirs. The direction
    /// has unit length.
    #[inline]
    #[must_use]
    pub fn ray(&self, pixel: [i32; 2], offset: [f32; 2]) -> (Vec3, Vec3) {
        let [width, height] = self.size;
        let (shift, half) = (self.film_shift, self.half);
        let x = (f64::from(pixel[0]) - width / 2.0 + f64::from(offset[0]) + shift.x) / (height / 2.0);
        let y = -(f64::from(pixel[1]) - height / 2.0 + f64::from(offset[1]) + shift.y) / (height / 2.0);
        if self.is_orthographic {
            let origin = self.world_from_camera * DVec3::new(x * half, y * half, 0.0);
            return (origin.as_vec3(), -self.world_from_camera.z_axis.as_vec3().normalize());
        }
        let direction = self.world_from_camera * DVec3::new(x * half, y * half, -1.0);
        (Vec3::ZERO, direction.normalize().as_vec3())
    }

    /// Bounds of the rays through all places of the pixels from `first` to `last` (both included, column and row): the least and the most of
    /// their origins, then of their directions, which have any length here. As exact as single precision.
    #[must_use]
    pub fn bounds(&self, first: [i32; 2], last: [i32; 2]) -> [[Vec3; 2]; 2] {
        let [width, height] = self.size;
        let (shift, half) = (self.film_shift, self.half);
        let across = |x: f64| (x - width / 2.0 + shift.x) / (height / 2.0) * half;
        let up = |y: f64| -(y - height / 2.0 + shift.y) / (height / 2.0) * half;
        let xs = [f64::from(first[0]), f64::from(last[0]) + 1.0].map(across);
        let ys = [f64::from(first[1]), f64::from(last[1]) + 1.0].map(up);
        let z = if self.is_orthographic { 0.0 } else { -1.0 };
        // Linear in the place on the film, so that corners bound it.
        let corners =
            [[0, 0], [0, 1], [1, 0], [1, 1]].map(|[x, y]| self.world_from_camera * DVec3::new(xs[x], ys[y], z));
        let bounds = [DVec3::min, DVec3::max].map(|of| corners.into_iter().reduce(of).unwrap_or_default().as_vec3());
        if self.is_orthographic {
            let direction = -self.world_from_camera.z_axis.as_vec3().normalize();
            return [bounds, [direction; 2]];
        }
        [[Vec3::ZERO; 2], bounds]
    }

    /// The rays through some film positions: x, y and z of their origins, then of their directions. Bit for bit those of
    /// [`Self::ray`], in loops that vectorise.
    #[inline(always)]
    #[must_use]
    pub fn rays<const N: usize>(&self, film: &[([i32; 2], [f32; 2]); N]) -> ([[f32; N]; 3], [[f32; N]; 3]) {
        let (mut origin, mut direction) = ([[0.0; N]; 3], [[0.0; N]; 3]);
        if self.is_orthographic {
            for (lane, &(pixel, offset)) in film.iter().enumerate() {
                let (from, towards) = self.ray(pixel, offset);
                for axis in 0..3 {
                    origin[axis][lane] = from[axis];
                    direction[axis][lane] = towards[axis];
                }
            }
            return (origin, direction);
        }
        let [width, height] = self.size;
        let (shift, half) = (self.film_shift, self.half);
        let [x_axis, y_axis, z_axis] = self.world_from_camera.to_cols_array_2d();
        let (mut x, mut y) = ([0.0; N], [0.0; N]);
        for lane in 0..N {
            let (pixel, offset) = film[lane];
            x[lane] = (f64::from(pixel[0]) - width / 2.0 + f64::from(offset[0]) + shift.x) / (height / 2.0) * half;
            y[lane] = -(f64::from(pixel[1]) - height / 2.0 + f64::from(offset[1]) + shift.y) / (height / 2.0) * half;
        }
        // One plain loop for each step: others do not vectorise.
        let along = |axis: usize| {
            let (mx, my, mz) = (x_axis[axis], y_axis[axis], -z_axis[axis]);
            let mut along = [0.0; N];
            for (along, (x, y)) in along.iter_mut().zip(x.iter().zip(&y)) {
                *along = mx * x + my * y + mz;
            }
            along
        };
        let [x, y, z] = [along(0), along(1), along(2)];
        let mut scale = [0.0; N];
        for lane in 0..N {
            scale[lane] = 1.0 / (x[lane] * x[lane] + y[lane] * y[lane] + z[lane] * z[lane]).sqrt();
        }
        for (direction, along) in direction.iter_mut().zip([x, y, z]) {
            for lane in 0..N {
                direction[lane] = (along[lane] * scale[lane]) as f32;
            }
        }
        (origin, direction)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn many_rays_at_once_are_those_made_one_by_one() {
        let projections = [
            Projection::Perspective { fov_y: 0.7 },
            Projection::Perspective { fov_y: 3.1 },
            Projection::Perspective { fov_y: 1e-4 },
            Projection::Orthographic { height: 3.0 },
        ];
        for projection in projections {
            let (from, target) = (DVec3::new(0.3, -7.1, 2.2), DVec3::new(0.1, 0.2, -0.3));
            let camera =
                Camera::look_at("", projection, from, target, DVec3::Y).unwrap_or_else(|error| panic!("{error:?}"));
            let rays = Camera { film_shift: DVec2::new(0.25, -3.5), ..camera }.rays([1921, 1079]);
            let film: [_; 16] = std::array::from_fn(|lane| {
                let lane = lane as i32;
                ([lane * 997 - 3000, 1500 - lane * 331], [lane as f32 / 16.3, 1.0 - lane as f32 / 17.1])
            });
            let (origin, direction) = rays.rays(&film);
            for (lane, (pixel, offset)) in film.into_iter().enumerate() {
                let (from, towards) = rays.ray(pixel, offset);
                let bits = |axes: [[f32; 16]; 3]| axes.map(|axis| axis[lane].to_bits());
                assert_eq!(bits(origin), from.to_array().map(f32::to_bits), "{projection:?}, {lane}");
                assert_eq!(bits(direction), towards.to_array().map(f32::to_bits), "{projection:?}, {lane}");
            }
        }
    }
}
