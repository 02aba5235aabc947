//! Functions of the library with static types, for kernels that have no instruction of their own for them: what the
//! interpreter calls, lane by lane, with the same bits.

use super::color;
use super::fractal::{self, layered};
use super::pattern;
use crate::math::{Vec2, Vec3, srgb_from_linear};
use crate::shade::native::NativeFunction;

/// A type as columns of floats.
trait Columns: Sized {
    const COUNT: usize;
    fn read(columns: &[&[f32]], row: usize) -> Self;
    fn write(self, columns: &mut [&mut [f32]], row: usize);
}

impl Columns for f32 {
    const COUNT: usize = 1;

    fn read(columns: &[&[f32]], row: usize) -> Self {
        columns[0][row]
    }

    fn write(self, columns: &mut [&mut [f32]], row: usize) {
        columns[0][row] = self;
    }
}

impl Columns for Vec2 {
    const COUNT: usize = 2;

    fn read(columns: &[&[f32]], row: usize) -> Self {
        Self::new(columns[0][row], columns[1][row])
    }

    fn write(self, columns: &mut [&mut [f32]], row: usize) {
        columns[0][row] = self.x;
        columns[1][row] = self.y;
    }
}

impl Columns for Vec3 {
    const COUNT: usize = 3;

    fn read(columns: &[&[f32]], row: usize) -> Self {
        Self::new(columns[0][row], columns[1][row], columns[2][row])
    }

    fn write(self, columns: &mut [&mut [f32]], row: usize) {
        columns[0][row] = self.x;
        columns[1][row] = self.y;
        columns[2][row] = self.z;
    }
}

macro_rules! natives {
    ($($name:literal($($argument:ident: $kind:ty),*) -> $result:ty = $value:expr;)*) => {
        vec![$({
            fn compute($($argument: $kind),*) -> $result { $value }
            NativeFunction::new($name, compute).with_batch(|inputs, outputs| {
                let rows = outputs.first().map_or(0, |column| column.len());
                for row in 0..rows {
                    let mut rest = inputs;
                    $(
                        let $argument = <$kind>::read(rest, row);
                        rest = &rest[<$kind>::COUNT..];
                    )*
                    let _ = rest;
                    compute($($argument),*).write(outputs, row);
                }
            })
        }),*]
    };
}

/// The functions. Those of one name differ in their parameters.
pub(in crate::shade) fn natives() -> Vec<NativeFunction> {
    let mut all = natives! {
        "stripes"(x: f32, width: f32) -> f32 = pattern::stripes(x, width, 0.0);
        "stripes"(x: f32, width: f32, filter: f32) -> f32 = pattern::stripes(x, width, filter);
        "checker"(point: Vec2) -> f32 = pattern::checker(&point.to_array(), 0.0);
        "checker"(point: Vec3) -> f32 = pattern::checker(&point.to_array(), 0.0);
        "checker"(point: Vec2, filter: f32) -> f32 = pattern::checker(&point.to_array(), filter);
        "checker"(point: Vec3, filter: f32) -> f32 = pattern::checker(&point.to_array(), filter);
        "dots"(uv: Vec2, radius: f32) -> f32 = pattern::dots(uv, radius, 0.0);
        "dots"(uv: Vec2, radius: f32, filter: f32) -> f32 = pattern::dots(uv, radius, filter);
        "hatch"(uv: Vec2, darkness: f32) -> f32 = pattern::hatch(uv, darkness, 0.0);
        "hatch"(uv: Vec2, darkness: f32, filter: f32) -> f32 = pattern::hatch(uv, darkness, filter);
        "cross_hatch"(uv: Vec2, darkness: f32) -> f32 = pattern::cross_hatch(uv, darkness, 0.0);
        "cross_hatch"(uv: Vec2, darkness: f32, filter: f32) -> f32 = pattern::cross_hatch(uv, darkness, filter);
        "rotate"(v: Vec2, radians: f32) -> Vec2 = pattern::rotate(v, radians);
        "hsl"(h: f32, s: f32, l: f32) -> Vec3 = color::rgb_from_hsl(h, s, l);
        "hsl_from_rgb"(color: Vec3) -> Vec3 = color::hsl_from_rgb(color);
        "srgb_from_rgb"(v: Vec3) -> Vec3 =
            Vec3::new(srgb_from_linear(v.x), srgb_from_linear(v.y), srgb_from_linear(v.z));
        "oklab"(l: f32, a: f32, b: f32) -> Vec3 = color::rgb_from_oklab(Vec3::new(l, a, b));
        "oklab"(lab: Vec3) -> Vec3 = color::rgb_from_oklab(lab);
        "oklab_from_rgb"(color: Vec3) -> Vec3 = color::oklab_from_rgb(color);
        "oklch"(l: f32, c: f32, h: f32) -> Vec3 = color::rgb_from_oklch(Vec3::new(l, c, h));
        "oklch"(lch: Vec3) -> Vec3 = color::rgb_from_oklch(lch);
        "oklch_from_rgb"(color: Vec3) -> Vec3 = color::oklch_from_rgb(color);
        "mix_oklab"(a: Vec3, b: Vec3, t: f32) -> Vec3 = color::mix_oklab(a, b, t);
        "temperature"(kelvin: f32) -> Vec3 = color::temperature(kelvin);
        "worley"(point: Vec2) -> Vec2 = fractal::worley([point.x, point.y], None);
        "worley"(point: Vec3) -> Vec2 = fractal::worley([point.x, point.y], Some(point.z));
    };
    let checked = |octaves: i64, lacunarity: f32, gain: f32| {
        // The interpreter has the words.
        fractal::layers(octaves, lacunarity, gain).map_err(|fault| fault.message)
    };
    all.push(NativeFunction::new("fbm", move |point: Vec2, octaves: i64, lacunarity: f32, gain: f32| {
        Ok::<f32, String>(layered([point.x, point.y], None, checked(octaves, lacunarity, gain)?, lacunarity, gain))
    }));
    all.push(NativeFunction::new("fbm", move |point: Vec3, octaves: i64, lacunarity: f32, gain: f32| {
        let octaves = checked(octaves, lacunarity, gain)?;
        Ok::<f32, String>(layered([point.x, point.y], Some(point.z), octaves, lacunarity, gain))
    }));
    all
}
