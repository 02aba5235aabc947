//! Sixteen hits at a time: the formulas of [`Bsdf`], operation by operation, in loops over lanes that the compiler vectorises for
//! the instructions that [`pulp::Arch`] finds at run time. What comes out is what [`Bsdf`] gives of each, bit for bit.

use std::f32::consts::PI;

use super::{Bsdf, MIRROR_ROUGHNESS};
use crate::math::{Vec3, portable};

/// Hits of a batch.
pub const LANES: usize = 16;

type Lanes = [f32; LANES];

/// Vectors by axis.
type Axes = [Lanes; 3];

/// What sixteen surfaces scatter towards their viewers.
#[derive(Clone, Debug)]
pub struct BsdfLanes {
    base_color: Axes,
    metallic: Lanes,
    roughness: Lanes,
    specular: Lanes,
    ior: Lanes,
    surrounding: Lanes,
    /// [`Bsdf::dielectric_f0`], once it is worked out.
    f0: Lanes,
    transmission: Lanes,
    normal: Axes,
    occlusion: Lanes,
    view: Axes,
    /// From all around, seen in the mirror direction.
    mirrored: Axes,
    radiance: Axes,
}

/// A light as sixteen hits see it.
#[derive(Clone, Debug)]
pub struct LightLanes {
    direction: Axes,
    irradiance: Axes,
    /// Whether the light is seen at all.
    seen: [bool; LANES],
}

#[inline(always)]
fn set(axes: &mut Axes, lane: usize, value: Vec3) {
    for (axis, value) in axes.iter_mut().zip(value.to_array()) {
        axis[lane] = value;
    }
}

/// As [`f32::clamp`] to 0 … 1.
#[inline(always)]
fn clamped(x: f32) -> f32 {
    let x = if x < 0.0 { 0.0 } else { x };
    if x > 1.0 { 1.0 } else { x }
}

/// As [`f32::max`], of a number that may be NaN and one that is not.
#[inline(always)]
fn at_least(x: f32, least: f32) -> f32 {
    if x > least { x } else { least }
}

impl Default for LightLanes {
    fn default() -> Self {
        let zero = [[0.0; LANES]; 3];
        Self { direction: zero, irradiance: zero, seen: [false; LANES] }
    }
}

impl LightLanes {
    /// Lights one hit: from a unit direction, with an irradiance on a surface that faces it.
    #[inline]
    pub fn set(&mut self, lane: usize, direction: Vec3, irradiance: Vec3) {
        set(&mut self.direction, lane, direction);
        set(&mut self.irradiance, lane, irradiance);
        self.seen[lane] = true;
    }
}

impl Default for BsdfLanes {
    fn default() -> Self {
        let (zero, zeros) = ([0.0; LANES], [[0.0; LANES]; 3]);
        Self {
            base_color: zeros,
            metallic: zero,
            roughness: zero,
            specular: zero,
            ior: zero,
            surrounding: zero,
            f0: zero,
            transmission: zero,
            normal: zeros,
            occlusion: zero,
            view: zeros,
            mirrored: zeros,
            radiance: zeros,
        }
    }
}

impl BsdfLanes {
    /// Makes a lane a surface seen from `view` (unit, away from it), which emits `emission`. `mirrored` is the background seen in the
    /// mirror direction; it is asked for only if it matters.
    #[inline]
    pub fn set(&mut self, lane: usize, bsdf: &Bsdf, view: Vec3, emission: Vec3, mirrored: impl FnOnce() -> Vec3) {
        set(&mut self.base_color, lane, bsdf.base_color);
        self.metallic[lane] = bsdf.metallic;
        self.roughness[lane] = bsdf.roughness;
        self.specular[lane] = bsdf.specular;
        (self.ior[lane], self.surrounding[lane]) = (bsdf.ior, bsdf.surrounding);
        self.transmission[lane] = bsdf.transmission;
        set(&mut self.normal, lane, bsdf.normal);
        self.occlusion[lane] = bsdf.occlusion;
        set(&mut self.view, lane, view);
        let asks = bsdf.roughness < 1.0 && !bsdf.is_mirror();
        set(&mut self.mirrored, lane, if asks { mirrored() } else { Vec3::ZERO });
        set(&mut self.radiance, lane, emission);
    }

    /// The radiance of a lane towards its viewer.
    #[must_use]
    pub fn radiance(&self, lane: usize) -> Vec3 {
        Vec3::from_array(self.radiance.each_ref().map(|axis| axis[lane]))
    }

    /// Adds what the surfaces scatter of the light of some lights, as [`Bsdf::scatter`] gives it, and then of light from all
    /// around, as [`Bsdf::surroundings`] does; of mirrors that is not added.
    pub fn light(&mut self, arch: pulp::Arch, lights: &[LightLanes], ambient: Vec3) {
        arch.dispatch(Light { surfaces: self, lights, ambient });
    }

    #[inline(always)]
    fn find_f0(&mut self) {
        for i in 0..LANES {
            let relative = self.ior[i] / self.surrounding[i];
            let r = (relative - 1.0) / (relative + 1.0);
            self.f0[i] = r * r * self.specular[i];
        }
    }

    #[inline(always)]
    fn add_light(&mut self, light: &LightLanes) {
        let Self { base_color, metallic, roughness, specular, f0, transmission, normal, view, radiance, .. } = self;
        let [[nx, ny, nz], [vx, vy, vz], [lx, ly, lz]] = [&*normal, &*view, &light.direction];
        let mut sums = *radiance;
        let [red, green, blue] = &mut sums;
        for i in 0..LANES {
            let cos_light = nx[i] * lx[i] + ny[i] * ly[i] + nz[i] * lz[i];
            let (hx, hy, hz) = (vx[i] + lx[i], vy[i] + ly[i], vz[i] + lz[i]);
            let scale = 1.0 / (hx * hx + hy * hy + hz * hz).sqrt();
            let has_length = scale < f32::INFINITY && scale > 0.0;
            let (hx, hy, hz) = (hx * scale, hy * scale, hz * scale);
            let (hx, hy, hz) = if has_length { (hx, hy, hz) } else { (0.0, 0.0, 0.0) };
            let x = clamped(1.0 - (hx * vx[i] + hy * vy[i] + hz * vz[i]));
            let x2 = x * x;
            let fresnel = x2 * x2 * x;
            let dielectric = f0[i] + (specular[i] - f0[i]) * fresnel;
            let diffuse = (1.0 - dielectric) / PI;
            let lambert = (1.0 - metallic[i]) * (1.0 - transmission[i]);

            let alpha = roughness[i] * roughness[i];
            let alpha2 = alpha * alpha;
            let cos_view = at_least(nx[i] * vx[i] + ny[i] * vy[i] + nz[i] * vz[i], 1e-4);
            let cos_half = clamped(nx[i] * hx + ny[i] * hy + nz[i] * hz);
            let d = cos_half * cos_half * (alpha2 - 1.0) + 1.0;
            let distribution = alpha2 / (PI * d * d);
            let shadowing = cos_light * (cos_view * cos_view * (1.0 - alpha2) + alpha2).sqrt();
            let masking = cos_view * (cos_light * cos_light * (1.0 - alpha2) + alpha2).sqrt();
            let ggx = distribution * 0.5 / (shadowing + masking);

            let is_mirror = roughness[i] <= MIRROR_ROUGHNESS;
            let is_behind = cos_light <= 0.0;
            let of_channel = |base: f32, irradiance: f32, sum: f32| {
                let metal = base + (1.0 - base) * fresnel;
                let reflectance = dielectric * (1.0 - metallic[i]) + metal * metallic[i];
                let specular = if is_mirror { 0.0 } else { reflectance * ggx };
                let scattered = (base * lambert * diffuse + specular) * irradiance * cos_light;
                let scattered = if is_behind { 0.0 } else { scattered };
                if light.seen[i] { sum + scattered } else { sum }
            };
            red[i] = of_channel(base_color[0][i], light.irradiance[0][i], red[i]);
            green[i] = of_channel(base_color[1][i], light.irradiance[1][i], green[i]);
            blue[i] = of_channel(base_color[2][i], light.irradiance[2][i], blue[i]);
        }
        *radiance = sums;
    }

    #[inline(always)]
    fn add_surroundings(&mut self, ambient: Vec3) {
        let Self {
            base_color,
            metallic,
            roughness,
            specular,
            f0,
            transmission,
            normal,
            occlusion,
            view,
            mirrored,
            radiance,
            ..
        } = self;
        let [[nx, ny, nz], [vx, vy, vz]] = [&*normal, &*view];
        let mut sums = *radiance;
        let [red, green, blue] = &mut sums;
        let mut power = [0.0; LANES];
        for i in 0..LANES {
            let cos_view = clamped(nx[i] * vx[i] + ny[i] * vy[i] + nz[i] * vz[i]);
            power[i] = portable::exp2(-9.28 * cos_view);
        }
        for i in 0..LANES {
            let r = roughness[i];
            let (x, y) = (1.0 - r, 0.0425 - 0.0275 * r);
            let x2 = x * x;
            let a = (if x2 < power[i] { x2 } else { power[i] }) * x + y;
            let scale = -1.04 * a + 1.04 - 0.572 * r;
            let bias = at_least(1.04 * a - 0.04 + 0.022 * r, 0.0);
            let dielectric = f0[i] * scale + bias * specular[i];
            let lambert = (1.0 - metallic[i]) * (1.0 - transmission[i]);
            let kept = 1.0 - clamped(dielectric);
            let is_mirror = r <= MIRROR_ROUGHNESS;
            let of_channel = |base: f32, mirrored: f32, ambient: f32, sum: f32| {
                let metal = base * scale + bias;
                let reflectance = dielectric * (1.0 - metallic[i]) + metal * metallic[i];
                let around = if r < 1.0 { mirrored * (1.0 - r) + ambient * r } else { ambient };
                let diffuse = base * lambert * ambient * kept;
                let all = (diffuse + reflectance * around) * occlusion[i];
                if is_mirror { sum } else { sum + all }
            };
            red[i] = of_channel(base_color[0][i], mirrored[0][i], ambient.x, red[i]);
            green[i] = of_channel(base_color[1][i], mirrored[1][i], ambient.y, green[i]);
            blue[i] = of_channel(base_color[2][i], mirrored[2][i], ambient.z, blue[i]);
        }
        *radiance = sums;
    }
}

struct Light<'a> {
    surfaces: &'a mut BsdfLanes,
    lights: &'a [LightLanes],
    ambient: Vec3,
}

impl pulp::WithSimd for Light<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: pulp::Simd>(self, _: S) {
        self.surfaces.find_f0();
        for light in self.lights {
            self.surfaces.add_light(light);
        }
        self.surfaces.add_surroundings(self.ambient);
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    fn share() -> impl Strategy<Value = f32> {
        prop_oneof![3 => 0.0f32..=1.0, 1 => Just(0.0), 1 => Just(1.0), 1 => Just(MIRROR_ROUGHNESS)]
    }

    fn color() -> impl Strategy<Value = Vec3> {
        (share(), share(), share()).prop_map(|(r, g, b)| Vec3::new(r, g, b) * 2.0)
    }

    fn direction() -> impl Strategy<Value = Vec3> {
        let component = || prop_oneof![3 => -1.0f32..1.0, 1 => Just(0.0), 1 => Just(1.0)];
        (component(), component(), component())
            .prop_map(|(x, y, z)| Vec3::new(x, y, z).try_normalize().unwrap_or(Vec3::Z))
    }

    fn bsdf() -> impl Strategy<Value = Bsdf> {
        let numbers = (share(), share(), share(), 0.2f32..3.0, share(), share());
        (color(), numbers, direction(), any::<bool>(), prop_oneof![Just(1.0f32), 0.5f32..2.0]).prop_map(
            |(
                base_color,
                (metallic, roughness, specular, ior, transmission, occlusion),
                normal,
                outside,
                surrounding,
            )| {
                let bsdf = Bsdf {
                    base_color,
                    metallic,
                    roughness,
                    specular,
                    ior,
                    transmission,
                    normal,
                    occlusion,
                    outside,
                    surrounding,
                };
                bsdf.checked()
            },
        )
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(400))]

        #[test]
        fn lanes_give_what_single_hits_give(
            hits in proptest::collection::vec((bsdf(), direction(), color(), color()), LANES),
            lights in proptest::collection::vec((direction(), color(), any::<u16>()), 0..4),
            ambient in color(),
        ) {
            let mut lanes = BsdfLanes::default();
            for (lane, (bsdf, view, emission, mirrored)) in hits.iter().enumerate() {
                lanes.set(lane, bsdf, *view, *emission, || *mirrored);
            }
            let seen = |mask: u16, lane: usize| mask >> lane & 1 != 0;
            let columns: Vec<LightLanes> = lights
                .iter()
                .map(|&(direction, irradiance, mask)| {
                    let mut column = LightLanes::default();
                    (0..LANES).filter(|lane| seen(mask, *lane)).for_each(|lane| column.set(lane, direction, irradiance));
                    column
                })
                .collect();
            lanes.light(pulp::Arch::new(), &columns, ambient);
            for (lane, (bsdf, view, emission, mirrored)) in hits.iter().enumerate() {
                let mut expected = *emission;
                for &(direction, irradiance, _) in lights.iter().filter(|(_, _, mask)| seen(*mask, lane)) {
                    expected += bsdf.scatter(*view, direction, irradiance);
                }
                if !bsdf.is_mirror() {
                    expected += bsdf.surroundings(*view, ambient, || *mirrored);
                }
                let bits = |value: Vec3| value.to_array().map(|x| if x.is_nan() { 1 } else { x.to_bits() });
                prop_assert_eq!(bits(lanes.radiance(lane)), bits(expected), "{:?}", bsdf);
            }
        }
    }
}
