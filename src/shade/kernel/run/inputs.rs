//! Inputs and lights: from the columns of a batch to registers.

use super::super::ir::{Column, Kind};
use super::super::slice::Register;
use super::bank::{Block, LANES, mask};
use super::{Chunk, Registers};
use crate::math::Vec3;
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
        let count = chunk.hits.light_count;
        let mut outs: [Vec<Block<f32>>; LIGHT] = std::array::from_fn(|i| self.floats.take(results[i]));
        let lights = chunk.lights();
        // Hits whose index is out of range have failed; they may read anything.
        let in_range = |index: i64| usize::try_from(index).unwrap_or_default().min(count.saturating_sub(1));
        let index_of = self.ints.view(index);
        // Mostly a loop asks for the same light at all hits, and there are few.
        match (index_of.uniform().map(in_range), count) {
            (Some(light), 1) => load_light::<1>(&mut outs, lights, light),
            (Some(light), 2) => load_light::<2>(&mut outs, lights, light),
            (Some(light), 3) => load_light::<3>(&mut outs, lights, light),
            (Some(light), 4) => load_light::<4>(&mut outs, lights, light),
            _ if lights.is_empty() => {}
            _ => {
                for block in 0..chunk.blocks() {
                    let index = index_of.block(block);
                    let hits = picked(lights, block, chunk.rows, count, |lane| in_range(index[lane]));
                    store(&mut outs, block, columns(&hits, 0));
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
        let count = chunk.hits.light_count;
        let mut outs: [Vec<Block<f32>>; 3] = std::array::from_fn(|i| self.floats.take(results[i]));
        let lights = chunk.lights();
        let normals = chunk.hits.normal.get(chunk.first..chunk.first + chunk.rows).unwrap_or_default();
        match count {
            1 => add_lights::<1>(&mut outs, lights, normals),
            2 => add_lights::<2>(&mut outs, lights, normals),
            3 => add_lights::<3>(&mut outs, lights, normals),
            4 => add_lights::<4>(&mut outs, lights, normals),
            _ => {
                for block in 0..chunk.blocks() {
                    let mut sum = [[0.0; LANES]; 3];
                    let mut room = None;
                    if let Some(normals) = block_of(normals, block, &mut room)
                        && !lights.is_empty()
                    {
                        for light in 0..count {
                            let hits = picked(lights, block, chunk.rows, count, |_| light);
                            add_light(&mut sum, normals, &columns(&hits, 0));
                        }
                    }
                    store(&mut outs, block, sum);
                }
            }
        }
        for (register, out) in results.iter().zip(outs) {
            self.floats.put(*register, out);
        }
    }
}

impl<'a> Chunk<'a> {
    /// The lights of its hits, hit by hit; none if they are not filled.
    #[inline(always)]
    fn lights(&self) -> &'a [LightSample] {
        let count = self.hits.light_count;
        self.hits.lights.get(self.first * count..(self.first + self.rows) * count).unwrap_or_default()
    }
}

/// Columns of a light sample: direction, radiance, visibility.
const LIGHT: usize = 7;

/// One light of each hit of a block, as columns. Where the number of lights is known to the compiler, so are the
/// distances between the samples, and these loads become shuffles of whole vectors.
#[inline(always)]
fn columns<const COUNT: usize>(hits: &[[LightSample; COUNT]; LANES], light: usize) -> [[f32; LANES]; LIGHT] {
    let mut columns = [[0.0; LANES]; LIGHT];
    for lane in 0..LANES {
        let LightSample { direction, radiance, visibility } = &hits[lane][light];
        columns[0][lane] = direction.x;
        columns[1][lane] = direction.y;
        columns[2][lane] = direction.z;
        columns[3][lane] = radiance.x;
        columns[4][lane] = radiance.y;
        columns[5][lane] = radiance.z;
        columns[6][lane] = *visibility;
    }
    columns
}

/// One light of each hit of a block, whatever the number of lights.
#[inline(always)]
fn picked(
    lights: &[LightSample],
    block: usize,
    rows: usize,
    count: usize,
    light: impl Fn(usize) -> usize,
) -> [[LightSample; 1]; LANES] {
    std::array::from_fn(|lane| [lights[(block * LANES + lane).min(rows - 1) * count + light(lane)]])
}

/// The rows of a block; the last row is repeated to fill it, in `room`.
#[inline(always)]
fn block_of<'a, T: Copy>(rows: &'a [T], block: usize, room: &'a mut Option<[T; LANES]>) -> Option<&'a [T; LANES]> {
    let (whole, rest) = rows.as_chunks::<LANES>();
    match (whole.get(block), rest.last()) {
        (Some(rows), _) => Some(rows),
        (None, Some(last)) => Some(room.insert(std::array::from_fn(|lane| *rest.get(lane).unwrap_or(last)))),
        (None, None) => None,
    }
}

#[inline(always)]
fn store<const COLUMNS: usize>(outs: &mut [Vec<Block<f32>>; COLUMNS], block: usize, columns: [[f32; LANES]; COLUMNS]) {
    for (out, column) in outs.iter_mut().zip(columns) {
        out[block].0 = column;
    }
}

#[inline(always)]
fn load_light<const COUNT: usize>(outs: &mut [Vec<Block<f32>>; LIGHT], lights: &[LightSample], light: usize) {
    let (hits, _) = lights.as_chunks::<COUNT>();
    for block in 0..hits.len().div_ceil(LANES) {
        let mut room = None;
        let Some(hits) = block_of(hits, block, &mut room) else { break };
        store(outs, block, columns(hits, light));
    }
}

#[inline(always)]
fn add_lights<const COUNT: usize>(outs: &mut [Vec<Block<f32>>; 3], lights: &[LightSample], normals: &[Vec3]) {
    let (hits, _) = lights.as_chunks::<COUNT>();
    for block in 0..normals.len().div_ceil(LANES) {
        let (mut sum, mut room, mut room_of_normals) = ([[0.0; LANES]; 3], None, None);
        if let Some(hits) = block_of(hits, block, &mut room)
            && let Some(normals) = block_of(normals, block, &mut room_of_normals)
        {
            for light in 0..COUNT {
                add_light(&mut sum, normals, &columns(hits, light));
            }
        }
        store(outs, block, sum);
    }
}

#[inline(always)]
fn add_light(sum: &mut [[f32; LANES]; 3], normals: &[Vec3; LANES], light: &[[f32; LANES]; LIGHT]) {
    let [x, y, z, red, green, blue, visibility] = light;
    for lane in 0..LANES {
        let facing = hit::facing(normals[lane], Vec3::new(x[lane], y[lane], z[lane]));
        sum[0][lane] += red[lane] * visibility[lane] * facing;
        sum[1][lane] += green[lane] * visibility[lane] * facing;
        sum[2][lane] += blue[lane] * visibility[lane] * facing;
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
