//! `line(pair, p)`: the function of a shader that styles the lines which samples see, one by one (DESIGN section 3.6).
//!
//! It is compiled, analysed and run as `surface` is: as a kernel over batches of lines, or by the interpreter.

use std::sync::Arc;

use rhai::{Dynamic, Map};

use super::analysis::Finding;
use super::fault::Fault;
use super::kernel::Kernel;
use super::library::kind;
use super::names::{KINDS, OTHER, OutputSet, PAIR_INPUTS, PATH_KINDS, PairSet, PathKind};
use super::output::{self, RowFault};
use crate::math::{Vec2, Vec3};
use crate::sample::PairBatch;

/// What `line` writes, as outputs of a kernel.
pub(super) const WRITTEN: OutputSet = OutputSet::COLOR.union(OutputSet::OPACITY);

/// The `line` of a material's shader.
#[derive(Debug)]
pub(super) struct LineShader {
    /// Whether it may give an opacity.
    pub opacity: bool,
    /// The kernel, or why there is none; `None` if the interpreter was asked for.
    pub kernel: Option<Result<Arc<Kernel>, Finding>>,
}

impl LineShader {
    pub fn kernel(&self) -> Option<&Arc<Kernel>> {
        self.kernel.as_ref()?.as_ref().ok()
    }

    /// The columns of a [`PairBatch`] that must be filled.
    pub fn needs(&self) -> PairSet {
        match self.kernel() {
            Some(kernel) => {
                let slice = kernel.slice(WRITTEN);
                // Lines that fail are given to the interpreter.
                if slice.may_fail { PairSet::all() } else { slice.pair_inputs }
            }
            None => PairSet::all(),
        }
    }
}

/// What scripts make of lines, one row for each row of a [`PairBatch`].
#[derive(Clone, Debug, Default, PartialEq)]
pub struct LineStyles {
    /// Linear RGB; `None` leaves the line its colour.
    pub color: Vec<Option<Vec3>>,
    /// Multiplies the line's opacity. May be any number: the line pass stops what is none.
    pub opacity: Vec<f32>,
}

/// What `line` returned for one row.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct LineRow {
    pub color: Option<Vec3>,
    pub opacity: f32,
}

impl LineRow {
    /// What a line gets whose script failed.
    pub const MARKER: Self = Self { color: Some(Vec3::new(1.0, 0.0, 1.0)), opacity: 1.0 };

    /// Reads a record.
    pub fn read(value: &Dynamic) -> Result<Self, RowFault> {
        let Ok(record) = value.as_map_ref() else {
            let fault = Fault::new(format!("`line` must return a record, but it returned {}", kind(value)));
            return Err(RowFault { key: None, fault: fault.hint("return #{ color: …, opacity: … }, or #{}") });
        };
        let mut row = Self { color: None, opacity: 1.0 };
        for (key, value) in record.iter() {
            let read = match key.as_str() {
                "color" => output::color(key, value).map(|color| row.color = Some(color)),
                "opacity" => output::number(key, value).map(|opacity| row.opacity = opacity),
                _ => Err(Fault::new(format!("`line` gives no `{key}`")).hint("it gives `color` and `opacity`")),
            };
            read.map_err(|fault| RowFault { key: Some(key.to_string()), fault })?;
        }
        Ok(row)
    }
}

/// What the interpreter gives `line` for a row, all columns filled. A column that is not gives no key.
pub(super) fn pair_record(pairs: &PairBatch, row: usize) -> Dynamic {
    let mut pair = side_record(pairs, row, false);
    pair.insert(OTHER.into(), Dynamic::from_map(side_record(pairs, row, true)));
    Dynamic::from_map(pair)
}

fn side_record(pairs: &PairBatch, row: usize, other: bool) -> Map {
    let inputs = PAIR_INPUTS.iter().filter(|input| input.of_side || !other);
    inputs.filter_map(|input| Some((input.name.into(), value(pairs, row, other, input.input)?))).collect()
}

fn value(pairs: &PairBatch, row: usize, other: bool, input: PairSet) -> Option<Dynamic> {
    let side = &pairs.sides[usize::from(other)];
    let float = |column: &[f32]| column.get(row).map(|x| Dynamic::from_float(*x));
    let id = |column: &[u32]| column.get(row).map(|id| Dynamic::from_int((*id).into()));
    let vector = |column: &[[f32; 3]]| column.get(row).map(|v| Dynamic::from(Vec3::from(*v)));
    match input {
        PairSet::KIND => pairs.kind.get(row).map(|kind| Dynamic::from(KINDS[*kind as usize])),
        PairSet::PATH_KIND => pairs.path.get(row).map(|path| Dynamic::from(PATH_KINDS[PathKind::of(*path) as usize])),
        PairSet::DISTANCE => float(&pairs.distance),
        PairSet::OWN => pairs.own.get(row).map(|own| Dynamic::from_bool(*own)),
        PairSet::WIDTH => float(&pairs.width),
        PairSet::COLOR => vector(&pairs.color),
        PairSet::OPACITY => float(&pairs.opacity),
        PairSet::PIXEL => pairs.pixel.get(row).map(|pixel| Dynamic::from(Vec2::from(*pixel))),
        PairSet::OBJECT_ID => id(&side.object),
        PairSet::MATERIAL_ID => id(&side.material),
        PairSet::DEPTH => float(&side.depth),
        PairSet::POSITION => vector(&side.position),
        PairSet::NORMAL => vector(&side.normal),
        PairSet::FEATURE => vector(&side.feature),
        _ => None,
    }
}
