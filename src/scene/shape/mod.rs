//! Built-in shapes: parameters in, [`Mesh`] out.
//!
//! Every shape is centred on the origin of its own space, has y as its axis, and by default fits the cube from −1 to 1.
//! Its front faces outwards (a plane and a disc face up). Normals are exact and smooth along curved faces, and split at
//! edges; uv covers 0 … 1 with v downwards, as images do, so that a texture reads the right way round from outside.
//! `polygons` are the cells of the grid that a face is cut into (a flat cap is one polygon), so that a script can
//! draw the edges of a plane's cells.
//!
//! Vertices that lie on each other have the same bits, so closed shapes are watertight.

mod cut;

use crate::diag::Diagnostic;
use crate::scene::mesh::Mesh;

/// The largest number of segments in one direction.
pub const MAX_SEGMENTS: u32 = 2048;

/// Segments around a round shape: its silhouette is within 0.2 pixels of round when it is 1000 pixels tall.
pub const AROUND: u32 = 128;

/// A knot runs around a torus; the radius of that torus' tube as a share of the knot's radius.
pub const KNOT_COIL: f64 = 0.4;

/// A built-in shape. Lengths are in object space; `segments` says how finely each direction is cut.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Shape {
    /// A ball.
    Sphere {
        /// Its radius.
        radius: f64,
        /// Around the axis (at least 3) and from pole to pole (at least 2).
        segments: [u32; 2],
    },
    /// A box with six flat faces.
    Box {
        /// Edge lengths along x, y and z.
        size: [f64; 3],
        /// Cells along x, y and z.
        segments: [u32; 3],
    },
    /// A rectangle that faces up.
    Plane {
        /// Edge lengths along x and z.
        size: [f64; 2],
        /// Cells along x and z.
        segments: [u32; 2],
    },
    /// A cylinder with flat caps.
    Cylinder {
        /// Its radius.
        radius: f64,
        /// From cap to cap.
        height: f64,
        /// Around the axis (at least 3) and along it.
        segments: [u32; 2],
    },
    /// A cone with its tip up and a flat base.
    Cone {
        /// Radius of the base.
        radius: f64,
        /// From base to tip.
        height: f64,
        /// Around the axis (at least 3) and along it.
        segments: [u32; 2],
    },
    /// A ring around the axis.
    Torus {
        /// Radius of the circle that the tube runs along.
        radius: f64,
        /// Radius of the tube, less than `radius`.
        tube_radius: f64,
        /// Around the axis and around the tube, at least 3 each.
        segments: [u32; 2],
    },
    /// A round disc that faces up.
    Disc {
        /// Its radius.
        radius: f64,
        /// Around, at least 3.
        segments: u32,
    },
    /// A cylinder with half balls for caps.
    Capsule {
        /// Radius of cylinder and caps.
        radius: f64,
        /// With the caps: at least twice the radius.
        height: f64,
        /// Around the axis (at least 3) and from pole to rim of each cap.
        segments: [u32; 2],
    },
    /// A tube along a trefoil knot.
    Knot {
        /// Radius of the circle that the knot winds about; the knot lies on a torus with a tube of 0.4 times this.
        radius: f64,
        /// Radius of the tube, less than 0.4 times `radius`.
        tube_radius: f64,
        /// Along the tube and around it, at least 3 each.
        segments: [u32; 2],
    },
}

/// A parameter with which a shape cannot be made.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct ShapeFault {
    /// Its name: `radius`, `height`, `size`, `tube_radius` or `segments`.
    pub parameter: &'static str,
    /// What is wrong.
    pub message: String,
}

impl From<ShapeFault> for Diagnostic {
    fn from(fault: ShapeFault) -> Self {
        Self::error(fault.message)
    }
}

impl Shape {
    /// A ball of radius 1.
    pub const SPHERE: Self = Self::Sphere { radius: 1.0, segments: [AROUND, AROUND / 2] };
    /// A cube with edges of 2.
    pub const BOX: Self = Self::Box { size: [2.0; 3], segments: [1; 3] };
    /// A square with edges of 2.
    pub const PLANE: Self = Self::Plane { size: [2.0; 2], segments: [1; 2] };
    /// A cylinder of radius 1 and height 2.
    pub const CYLINDER: Self = Self::Cylinder { radius: 1.0, height: 2.0, segments: [AROUND, 1] };
    /// A cone of radius 1 and height 2.
    pub const CONE: Self = Self::Cone { radius: 1.0, height: 2.0, segments: [AROUND, 1] };
    /// A ring of outer radius 1.
    pub const TORUS: Self = Self::Torus { radius: 0.75, tube_radius: 0.25, segments: [AROUND, AROUND / 2] };
    /// A disc of radius 1.
    pub const DISC: Self = Self::Disc { radius: 1.0, segments: AROUND };
    /// A capsule of radius 1/2 and height 2.
    pub const CAPSULE: Self = Self::Capsule { radius: 0.5, height: 2.0, segments: [AROUND, AROUND / 4] };
    /// A knot of outer radius 1.
    pub const KNOT: Self = Self::Knot { radius: 0.6, tube_radius: 0.16, segments: [4 * AROUND, 48] };

    /// Its name, as in scene files.
    #[must_use]
    pub fn name(&self) -> &'static str {
        match self {
            Self::Sphere { .. } => "sphere",
            Self::Box { .. } => "box",
            Self::Plane { .. } => "plane",
            Self::Cylinder { .. } => "cylinder",
            Self::Cone { .. } => "cone",
            Self::Torus { .. } => "torus",
            Self::Disc { .. } => "disc",
            Self::Capsule { .. } => "capsule",
            Self::Knot { .. } => "knot",
        }
    }

    /// The triangles.
    ///
    /// # Errors
    /// If a length is not a positive number that a 32-bit float can hold, segments are too few or above
    /// [`MAX_SEGMENTS`], a tube is too thick for its ring, or a capsule is too short for its caps.
    pub fn mesh(&self) -> Result<Mesh, ShapeFault> {
        self.check()?;
        Ok(cut::mesh(self))
    }

    fn check(&self) -> Result<(), ShapeFault> {
        match *self {
            Self::Sphere { radius, segments: [around, rings] } => {
                length("radius", radius)?;
                at_least(&[(around, 3, "around"), (rings, 2, "from pole to pole")])
            }
            Self::Box { size, segments: [x, y, z] } => {
                size.iter().try_for_each(|edge| length("size", *edge))?;
                at_least(&[(x, 1, "along x"), (y, 1, "along y"), (z, 1, "along z")])
            }
            Self::Plane { size, segments: [x, z] } => {
                size.iter().try_for_each(|edge| length("size", *edge))?;
                at_least(&[(x, 1, "along x"), (z, 1, "along z")])
            }
            Self::Cylinder { radius, height, segments: [around, along] }
            | Self::Cone { radius, height, segments: [around, along] } => {
                length("radius", radius)?;
                length("height", height)?;
                at_least(&[(around, 3, "around"), (along, 1, "along")])
            }
            Self::Torus { radius, tube_radius, segments: [around, tube] } => {
                length("radius", radius)?;
                tube_below(tube_radius, radius, "`radius`")?;
                at_least(&[(around, 3, "around"), (tube, 3, "around the tube")])
            }
            Self::Disc { radius, segments } => {
                length("radius", radius)?;
                at_least(&[(segments, 3, "around")])
            }
            Self::Capsule { radius, height, segments: [around, rings] } => {
                length("radius", radius)?;
                length("height", height)?;
                if height < 2.0 * radius {
                    let message =
                        format!("a capsule of radius {radius} is at least {} high, found {height}", 2.0 * radius);
                    return Err(ShapeFault { parameter: "height", message });
                }
                at_least(&[(around, 3, "around"), (rings, 1, "from pole to rim")])
            }
            Self::Knot { radius, tube_radius, segments: [along, tube] } => {
                length("radius", radius)?;
                tube_below(tube_radius, KNOT_COIL * radius, "0.4 times `radius`")?;
                at_least(&[(along, 3, "along"), (tube, 3, "around the tube")])
            }
        }
    }
}

fn length(parameter: &'static str, value: f64) -> Result<(), ShapeFault> {
    // Squares of lengths must stay normal 32-bit floats.
    if (1e-18..=1e18).contains(&value) {
        return Ok(());
    }
    Err(ShapeFault { parameter, message: format!("`{parameter}` must be a positive length, found {value}") })
}

fn tube_below(tube_radius: f64, limit: f64, what: &str) -> Result<(), ShapeFault> {
    let parameter = "tube_radius";
    length(parameter, tube_radius)?;
    if tube_radius < limit {
        return Ok(());
    }
    let message = format!("the tube would run into itself: `tube_radius` must be less than {what}, {limit}");
    Err(ShapeFault { parameter, message })
}

fn at_least(segments: &[(u32, u32, &str)]) -> Result<(), ShapeFault> {
    for &(count, least, direction) in segments {
        if !(least..=MAX_SEGMENTS).contains(&count) {
            let message = format!("{least} to {MAX_SEGMENTS} segments are possible {direction}, found {count}");
            return Err(ShapeFault { parameter: "segments", message });
        }
    }
    Ok(())
}
