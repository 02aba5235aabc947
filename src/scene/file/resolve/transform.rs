//! Where an object stands: `translate`, `rotate`, `scale` or `matrix`.

use std::f64::consts::FRAC_PI_2;

use super::super::document::Node;
use super::super::format::{self, TINY};
use super::vector;
use crate::diag::{Diagnostic, Diagnostics};
use crate::math::{DAffine3, DMat3, DVec3, DVec4};

/// The transform that an object's keys give, in double precision.
pub(super) fn world_from_object(object: &format::Object, node: &Node, faults: &mut Diagnostics) -> DAffine3 {
    if let Some(matrix) = &object.matrix {
        if let Some(other) = ["translate", "rotate", "scale"].into_iter().find(|key| node.mentions(key)) {
            let message = format!("`{other}` and `matrix` are both given");
            let fault = Diagnostic::error(message).at(node.key_span("matrix"));
            faults.push(fault.hint("a matrix says all: where the object stands, how it is turned and scaled"));
        }
        return from_matrix(matrix).unwrap_or_else(|message| {
            faults.push(Diagnostic::error(message).at(node.span_of("matrix")));
            DAffine3::IDENTITY
        });
    }
    let scale = match object.scale {
        None => DVec3::ONE,
        Some(format::Scale::All(factor)) => DVec3::splat(factor),
        Some(format::Scale::Each(factors)) => vector(factors),
    };
    if let Some(axis) = (0..3).find(|axis| scale[*axis].abs() < TINY) {
        let axis = ["x", "y", "z"][axis];
        let message = format!("this scale squeezes the object to nothing along {axis}");
        let fault = Diagnostic::error(message).at(node.span_of("scale"));
        faults.push(fault.hint("for something flat use the shape `plane` or `disc`"));
    }
    DAffine3 {
        matrix3: rotation(object.rotate.map_or(DVec3::ZERO, vector)) * DMat3::from_diagonal(scale),
        translation: object.translate.map_or(DVec3::ZERO, vector),
    }
}

fn from_matrix(matrix: &[f64; 16]) -> Result<DAffine3, &'static str> {
    let [x, y, z, translation] = [0, 4, 8, 12].map(|at| DVec4::from_slice(&matrix[at..at + 4]));
    if [x.w, y.w, z.w] != [0.0; 3] || translation.w != 1.0 {
        return Err("the last row of this matrix must be 0, 0, 0, 1; the numbers are listed column by column");
    }
    let columns = [x, y, z].map(DVec4::truncate);
    let lengths = columns.map(DVec3::length);
    let matrix3 = DMat3::from_cols_array_2d(&columns.map(|column| column.to_array()));
    let volume = matrix3.determinant() / lengths.iter().product::<f64>();
    if lengths.iter().any(|length| *length < TINY) || volume.abs() < TINY {
        return Err("this matrix squeezes the object flat: it has no inverse");
    }
    Ok(DAffine3 { matrix3, translation: translation.truncate() })
}

/// Rotation about the fixed axes x, then y, then z, by angles in degrees.
fn rotation(degrees: DVec3) -> DMat3 {
    let [x, y, z] = degrees.to_array().map(sin_cos_degrees);
    let about_x = DMat3::from_cols(DVec3::X, DVec3::new(0.0, x.1, x.0), DVec3::new(0.0, -x.0, x.1));
    let about_y = DMat3::from_cols(DVec3::new(y.1, 0.0, -y.0), DVec3::Y, DVec3::new(y.0, 0.0, y.1));
    let about_z = DMat3::from_cols(DVec3::new(z.1, z.0, 0.0), DVec3::new(-z.0, z.1, 0.0), DVec3::Z);
    about_z * about_y * about_x
}

/// Sine and cosine of an angle in degrees, exact at right angles: what is turned by 90 stays aligned with the axes.
fn sin_cos_degrees(degrees: f64) -> (f64, f64) {
    let turned = degrees.rem_euclid(360.0);
    let quarter = (turned / 90.0).floor();
    let rest = (turned - 90.0 * quarter) / 90.0 * FRAC_PI_2;
    let (sin, cos) = (libm::sin(rest), libm::cos(rest));
    match quarter as u8 {
        0 => (sin, cos),
        1 => (cos, -sin),
        2 => (-sin, -cos),
        3 => (-cos, sin),
        // `rem_euclid` rounds tiny negative angles up to a full turn.
        _ => (0.0, 1.0),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn right_angles_are_exact() {
        for (degrees, expected) in
            [(0.0, (0.0, 1.0)), (90.0, (1.0, 0.0)), (180.0, (0.0, -1.0)), (-90.0, (-1.0, 0.0)), (3600.0, (0.0, 1.0))]
        {
            assert_eq!(sin_cos_degrees(degrees), expected, "{degrees}");
        }
    }

    #[test]
    fn other_angles_agree_with_the_library() {
        for step in -500..500 {
            let degrees = f64::from(step) * 1.37;
            let (sin, cos) = sin_cos_degrees(degrees);
            let (expected_sin, expected_cos) = degrees.to_radians().sin_cos();
            assert!((sin - expected_sin).abs() < 1e-13 && (cos - expected_cos).abs() < 1e-13, "{degrees}");
        }
        assert_eq!(sin_cos_degrees(-1e-300), (0.0, 1.0));
    }

    #[test]
    fn rotations_turn_counter_clockwise_about_fixed_axes_in_order() {
        assert_eq!(rotation(DVec3::new(90.0, 0.0, 0.0)) * DVec3::Y, DVec3::Z);
        assert_eq!(rotation(DVec3::new(0.0, 90.0, 0.0)) * DVec3::Z, DVec3::X);
        assert_eq!(rotation(DVec3::new(0.0, 0.0, 90.0)) * DVec3::X, DVec3::Y);
        // Y goes to Z by the first turn, and on to X by the second.
        assert_eq!(rotation(DVec3::new(90.0, 90.0, 0.0)) * DVec3::Y, DVec3::X);
    }

    #[test]
    fn matrices_are_read_by_columns() {
        let mut matrix = [0.0; 16];
        (matrix[0], matrix[5], matrix[10], matrix[15]) = (1.0, 2.0, 3.0, 1.0);
        (matrix[12], matrix[13], matrix[14]) = (4.0, 5.0, 6.0);
        let transform = from_matrix(&matrix).unwrap();
        assert_eq!(transform.transform_point3(DVec3::ONE), DVec3::new(5.0, 7.0, 9.0));
    }
}
