//! Inputs and lights: from the columns of a batch to registers.

use super::super::ir::{Column, Kind};
use super::super::slice::Register;
use super::bank::{Block, LANES, mask};
use super::{Chunk, Registers};
use crate::shade::batch::LightSample;
use crate::shade::library::hit;
use crate::shade::names::{PairSet, PathKind};

impl Registers {
    #[inline(always)]
    pub(super) fn input(&mut self, column: Column, lane: usize, result: Register, chunk: &Chunk<'_>) {
        let hits = chunk.hits;
        if let Column::Pair { input, other, .. } = column {
            return self.pair_input(input, other, lane, result, chunk);
        }
        match column.kind() {
            Kind::Float => {
                let mut out = self.floats.take(result);
                match column {
                    Column::Position => load(&mut out, &hits.position, chunk, |v| v[lane]),
                    Column::Normal => load(&mut out, &hits.normal, chunk, |v| v[lane]),
                    Column::GeometricNormal => load(&mut out, &hits.geometric_normal, chunk, |v| v[lane]),
                    Column::Incoming => load(&mut out, &hits.incoming, chunk, |v| v[lane]),
                    Column::Uv(0) => load(&mut out, &hits.uv, chunk, |v| v[lane]),
                    Column::Uv(set) => match hits.more_uvs.get(set as usize - 1) {
                        Some(column) => load(&mut out, column, chunk, |v| v[lane]),
                        // Missing sets read as 0.
                        None => out[..chunk.blocks()].fill(Block([0.0; LANES])),
                    },
                    Column::Tangent => load(&mut out, &hits.tangent, chunk, |v| v[lane]),
                    Column::Color => load(&mut out, &hits.color, chunk, |v| v[lane]),
                    Column::Barycentric => load(&mut out, &hits.barycentric, chunk, |v| v[lane]),
                    Column::Distance => load(&mut out, &hits.distance, chunk, |x| x),
                    Column::Depth => load(&mut out, &hits.depth, chunk, |x| x),
                    Column::PixelsPerUnit => load(&mut out, &hits.pixels_per_unit, chunk, |x| x),
                    Column::Curvature => load(&mut out, &hits.curvature, chunk, |x| x),
                    Column::Footprint => load(&mut out, &hits.footprint, chunk, |x| x),
                    Column::UvFootprint => load(&mut out, &hits.uv_footprint, chunk, |x| x),
                    _ => out[0] = Block([hits.time; LANES]),
                }
                self.floats.put(result, out);
            }
            Kind::Int => {
                let mut out = self.ints.take(result);
                match column {
                    Column::ObjectId => load(&mut out, &hits.object_id, chunk, i64::from),
                    Column::PolygonId => load(&mut out, &hits.polygon_id, chunk, i64::from),
                    Column::PathKind => load(&mut out, &hits.path_kind, chunk, PathKind::place),
                    Column::AttributeSet if hits.attribute_set.is_empty() => {
                        out[..chunk.blocks()].fill(Block([-1; LANES]));
                    }
                    Column::AttributeSet => load(&mut out, &hits.attribute_set, chunk, i64::from),
                    _ => out[0] = Block([hits.light_count as i64; LANES]),
                }
                self.ints.put(result, out);
            }
            Kind::Bool => {
                let mut out = self.bools.take(result);
                load(&mut out, &hits.front_facing, chunk, mask);
                self.bools.put(result, out);
            }
        }
    }

    /// An input on `pair` or `pair.other`.
    #[inline(always)]
    fn pair_input(&mut self, input: PairSet, other: bool, lane: usize, result: Register, chunk: &Chunk<'_>) {
        let Some(pairs) = chunk.pairs else { return };
        let side = &pairs.sides[usize::from(other)];
        match input {
            PairSet::OWN => {
                let mut out = self.bools.take(result);
                load(&mut out, &pairs.own, chunk, mask);
                self.bools.put(result, out);
            }
            PairSet::KIND | PairSet::PATH_KIND | PairSet::OBJECT_ID | PairSet::MATERIAL_ID => {
                let mut out = self.ints.take(result);
                match input {
                    PairSet::KIND => load(&mut out, &pairs.kind, chunk, |kind| kind as i64),
                    PairSet::PATH_KIND => load(&mut out, &pairs.path, chunk, |path| PathKind::of(path).place()),
                    PairSet::OBJECT_ID => load(&mut out, &side.object, chunk, i64::from),
                    _ => load(&mut out, &side.material, chunk, i64::from),
                }
                self.ints.put(result, out);
            }
            _ => {
                let mut out = self.floats.take(result);
                match input {
                    PairSet::DISTANCE => load(&mut out, &pairs.distance, chunk, |x| x),
                    PairSet::WIDTH => load(&mut out, &pairs.width, chunk, |x| x),
                    PairSet::COLOR => load(&mut out, &pairs.color, chunk, |v| v[lane]),
                    PairSet::OPACITY => load(&mut out, &pairs.opacity, chunk, |x| x),
                    PairSet::PIXEL => load(&mut out, &pairs.pixel, chunk, |v| v[lane]),
                    PairSet::DEPTH => load(&mut out, &side.depth, chunk, |x| x),
                    PairSet::POSITION => load(&mut out, &side.position, chunk, |v| v[lane]),
                    PairSet::NORMAL => load(&mut out, &side.normal, chunk, |v| v[lane]),
                    _ => load(&mut out, &side.feature, chunk, |v| v[lane]),
                }
                self.floats.put(result, out);
            }
        }
    }

    #[inline(always)]
    pub(super) fn light(&mut self, index: Register, results: &[Register], chunk: &Chunk<'_>) {
        let hits = chunk.hits;
        let count = hits.light_count;
        let mut outs: [Vec<Block<f32>>; 7] = std::array::from_fn(|i| self.floats.take(results[i]));
        let lights = hits.lights.get(chunk.first * count..(chunk.first + chunk.rows) * count).unwrap_or_default();
        // Hits whose index is out of range have failed; they may read anything.
        let in_range = |index: i64| usize::try_from(index).unwrap_or_default().min(count.saturating_sub(1));
        let index_of = self.ints.view(index);
        if !lights.is_empty() {
            for block in 0..chunk.blocks() {
                let index = index_of.block(block);
                let first = block * LANES;
                let mut columns = [[0.0; LANES]; 7];
                let mut set = |lane: usize, light: &LightSample| {
                    columns[0][lane] = light.direction.x;
                    columns[1][lane] = light.direction.y;
                    columns[2][lane] = light.direction.z;
                    columns[3][lane] = light.radiance.x;
                    columns[4][lane] = light.radiance.y;
                    columns[5][lane] = light.radiance.z;
                    columns[6][lane] = light.visibility;
                };
                match (index_of.uniform(), lights.get(first * count..(first + LANES) * count)) {
                    // Mostly a loop asks for the same light at all hits.
                    (Some(light), Some(lights)) => {
                        let light = in_range(light);
                        for (lane, lights) in lights.chunks_exact(count).enumerate() {
                            set(lane, &lights[light]);
                        }
                    }
                    _ => {
                        for lane in 0..LANES {
                            let row = (first + lane).min(chunk.rows - 1);
                            set(lane, &lights[row * count + in_range(index[lane])]);
                        }
                    }
                }
                for (out, column) in outs.iter_mut().zip(columns) {
                    out[block].0 = column;
                }
            }
        }
        for (register, out) in results.iter().zip(outs) {
            self.floats.put(*register, out);
        }
    }

    /// As [`hit::irradiance`], for a block of hits at a time.
    #[inline(always)]
    pub(super) fn irradiance(&mut self, results: &[Register], chunk: &Chunk<'_>) {
        let hits = chunk.hits;
        let count = hits.light_count;
        let mut outs: [Vec<Block<f32>>; 3] = std::array::from_fn(|i| self.floats.take(results[i]));
        let rows = chunk.first..chunk.first + chunk.rows;
        let lights = hits.lights.get(rows.start * count..rows.end * count).unwrap_or_default();
        let normals = hits.normal.get(rows).unwrap_or_default();
        for block in 0..chunk.blocks() {
            let [mut red, mut green, mut blue] = [[0.0; LANES]; 3];
            if !normals.is_empty() && !lights.is_empty() {
                for light in 0..count {
                    for lane in 0..LANES {
                        let row = (block * LANES + lane).min(chunk.rows - 1);
                        let LightSample { direction, radiance, visibility } = lights[row * count + light];
                        let facing = hit::facing(normals[row], direction);
                        red[lane] += radiance.x * visibility * facing;
                        green[lane] += radiance.y * visibility * facing;
                        blue[lane] += radiance.z * visibility * facing;
                    }
                }
            }
            for (out, channel) in outs.iter_mut().zip([red, green, blue]) {
                out[block].0 = channel;
            }
        }
        for (register, out) in results.iter().zip(outs) {
            self.floats.put(*register, out);
        }
    }
}

/// Reads a column of a batch. The last row is repeated to fill the last block.
#[inline(always)]
fn load<S: Copy, T: Copy>(out: &mut [Block<T>], source: &[S], chunk: &Chunk<'_>, pick: impl Fn(S) -> T) {
    let Some(rows) = source.get(chunk.first..chunk.first + chunk.rows) else { return };
    let (whole, rest) = rows.as_chunks::<LANES>();
    for (out, rows) in out.iter_mut().zip(whole) {
        for (out, row) in out.0.iter_mut().zip(rows) {
            *out = pick(*row);
        }
    }
    if let Some(last) = rest.last() {
        let out = &mut out[whole.len()].0;
        for (lane, out) in out.iter_mut().enumerate() {
            *out = pick(*rest.get(lane).unwrap_or(last));
        }
    }
}
