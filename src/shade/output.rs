//! From the record that `surface` returns to a row of an [`OutputBatch`].

use rhai::Dynamic;

use super::batch::OutputBatch;
use super::fault::Fault;
use super::library::kind;
use super::names::{AOV_PREFIX, OutputSet};
use crate::math::Vec3;

/// The outputs of one hit: what the record holds, checked and converted.
#[derive(Clone, Debug, Default, PartialEq)]
pub(super) struct Row {
    base_color: Option<Vec3>,
    metallic: Option<f32>,
    roughness: Option<f32>,
    specular: Option<f32>,
    ior: Option<f32>,
    transmission: Option<f32>,
    opacity: Option<f32>,
    emission: Option<Vec3>,
    normal: Option<Vec3>,
    occlusion: Option<f32>,
    feature: Option<Vec3>,
    line_color: Option<Vec3>,
    line_width: Option<f32>,
    line_opacity: Option<f32>,
    priority: Option<i32>,
    color: Option<Vec3>,
    /// By place in the list of names; may be shorter than it.
    aovs: Vec<Option<Vec3>>,
}

/// A fault of the record, and the key it is about.
pub(super) struct RowFault {
    pub key: Option<String>,
    pub fault: Fault,
}

/// Values of outputs that a script leaves out.
pub(super) mod defaults {
    use crate::math::Vec3;

    pub const BASE_COLOR: Vec3 = Vec3::splat(0.8);
    pub const METALLIC: f32 = 0.0;
    pub const ROUGHNESS: f32 = 1.0;
    pub const SPECULAR: f32 = 1.0;
    pub const IOR: f32 = 1.5;
    pub const TRANSMISSION: f32 = 0.0;
    pub const OPACITY: f32 = 1.0;
    pub const EMISSION: Vec3 = Vec3::ZERO;
    pub const OCCLUSION: f32 = 1.0;
    pub const FEATURE: Vec3 = Vec3::ZERO;
    pub const LINE_OPACITY: f32 = 1.0;
}

impl Row {
    /// What a hit gets whose script failed: it shines in a colour that no one chooses, and draws no line.
    pub fn marker() -> Self {
        Self { color: Some(Vec3::new(1.0, 0.0, 1.0)), line_width: Some(0.0), ..Self::default() }
    }

    /// Reads a record. `aovs` are the names of the extra outputs, sorted.
    pub fn read(value: &Dynamic, aovs: &[String]) -> Result<Self, RowFault> {
        let Ok(record) = value.as_map_ref() else {
            let fault = Fault::new(format!("`surface` must return a record, but it returned {}", kind(value)));
            let hint = if value.is_unit() {
                "the record comes last: a `let`, a loop, or an `if` without `else` gives nothing"
            } else {
                "return #{ base_color: … }"
            };
            return Err(RowFault { key: None, fault: fault.hint(hint) });
        };
        let mut row = Self::default();
        for (key, value) in record.iter() {
            row.put(key, value, aovs).map_err(|fault| RowFault { key: Some(key.to_string()), fault })?;
        }
        Ok(row)
    }

    fn put(&mut self, key: &str, value: &Dynamic, aovs: &[String]) -> Result<(), Fault> {
        let color = || color(key, value).map(Some);
        let number = || number(key, value).map(Some);
        match key {
            "base_color" => self.base_color = color()?,
            "metallic" => self.metallic = number()?,
            "roughness" => self.roughness = number()?,
            "specular" => self.specular = number()?,
            "ior" => self.ior = number()?,
            "transmission" => self.transmission = number()?,
            "opacity" => self.opacity = number()?,
            "emission" => self.emission = color()?,
            "normal" => self.normal = Some(vector(key, value)?),
            "occlusion" => self.occlusion = number()?,
            "feature" => self.feature = color()?,
            "line_color" => self.line_color = color()?,
            "line_width" => self.line_width = number()?,
            "line_opacity" => self.line_opacity = number()?,
            "priority" => self.priority = Some(whole(key, value)?),
            "color" => self.color = color()?,
            _ => {
                let name = key.strip_prefix(AOV_PREFIX).ok_or_else(|| unknown_output(key))?;
                let index = aovs.binary_search_by(|known| known.as_str().cmp(name)).map_err(|_| unseen_aov(key))?;
                if self.aovs.len() <= index {
                    self.aovs.resize(index + 1, None);
                }
                self.aovs[index] = color()?;
            }
        }
        Ok(())
    }
}

/// The error of a key that is no output.
pub(super) fn unknown_output(key: &str) -> Fault {
    let names: Vec<_> = OutputSet::named().map(|(name, _)| name).collect();
    let fault = Fault::new(format!("there is no output `{key}`")).propose(key, names.into_iter());
    fault.hint(format!("a layer of your own is called `{AOV_PREFIX}` and a name"))
}

fn unseen_aov(key: &str) -> Fault {
    Fault::new(format!("the layer `{key}` was not known before rendering"))
        .hint("write its key out in a record, so that the picture's layers can be planned")
}

fn mistyped(key: &str, wanted: &str, value: &Dynamic) -> Fault {
    Fault::new(format!("the output `{key}` must be {wanted}, but it is {}", kind(value)))
}

pub(super) fn number(key: &str, value: &Dynamic) -> Result<f32, Fault> {
    #[expect(clippy::cast_precision_loss, reason = "an int counts as the nearest float")]
    value.as_float().or_else(|_| value.as_int().map(|x| x as f32)).map_err(|_| mistyped(key, "a number", value))
}

fn vector(key: &str, value: &Dynamic) -> Result<Vec3, Fault> {
    value.read_lock::<Vec3>().map(|v| *v).ok_or_else(|| mistyped(key, "a vec3", value))
}

pub(super) fn color(key: &str, value: &Dynamic) -> Result<Vec3, Fault> {
    if let Some(color) = value.read_lock::<Vec3>() {
        return Ok(*color);
    }
    number(key, value).map(Vec3::splat).map_err(|_| {
        let fault = mistyped(key, "a vec3 or a number", value);
        if kind(value) == "vec4" { fault.hint("take its first three with `.rgb`") } else { fault }
    })
}

fn whole(key: &str, value: &Dynamic) -> Result<i32, Fault> {
    let int = value.as_int().map_err(|_| mistyped(key, "an int", value))?;
    i32::try_from(int)
        .map_err(|_| Fault::new(format!("the output `{key}` must be within ±{}, but it is {int}", i32::MAX)))
}

/// Empties the columns, and gives the wanted ones and the extra ones room.
pub(super) fn start(outputs: &mut OutputBatch, aovs: usize) {
    let OutputBatch {
        len,
        base_color,
        metallic,
        roughness,
        specular,
        ior,
        transmission,
        opacity,
        emission,
        normal,
        occlusion,
        feature,
        line_color,
        line_width,
        line_opacity,
        priority,
        color,
        aovs: extra,
    } = outputs;
    *len = 0;
    for column in [metallic, roughness, specular, ior, transmission, opacity, occlusion, line_opacity] {
        column.clear();
    }
    for column in [base_color, emission, feature] {
        column.clear();
    }
    for column in [normal, line_color, color] {
        column.clear();
    }
    line_width.clear();
    priority.clear();
    extra.resize_with(aovs, Vec::new);
    extra.iter_mut().for_each(Vec::clear);
}

/// Does something with each wanted column, and the value that a row has there.
macro_rules! columns {
    ($outputs:ident, $wanted:ident, $row:expr, |$column:ident, $value:ident| $then:expr) => {{
        columns!(@each $outputs $wanted $column $value $then;
            BASE_COLOR base_color $row.base_color.unwrap_or(defaults::BASE_COLOR);
            METALLIC metallic $row.metallic.unwrap_or(defaults::METALLIC);
            ROUGHNESS roughness $row.roughness.unwrap_or(defaults::ROUGHNESS);
            SPECULAR specular $row.specular.unwrap_or(defaults::SPECULAR);
            IOR ior $row.ior.unwrap_or(defaults::IOR);
            TRANSMISSION transmission $row.transmission.unwrap_or(defaults::TRANSMISSION);
            OPACITY opacity $row.opacity.unwrap_or(defaults::OPACITY);
            EMISSION emission $row.emission.unwrap_or(defaults::EMISSION);
            NORMAL normal $row.normal;
            OCCLUSION occlusion $row.occlusion.unwrap_or(defaults::OCCLUSION);
            FEATURE feature $row.feature.unwrap_or(defaults::FEATURE);
            LINE_COLOR line_color $row.line_color;
            LINE_WIDTH line_width $row.line_width;
            PRIORITY priority $row.priority;
            COLOR color $row.color;
            LINE_OPACITY line_opacity $row.line_opacity.unwrap_or(defaults::LINE_OPACITY);
        );
        for (index, $column) in $outputs.aovs.iter_mut().enumerate() {
            let $value = $row.aovs.get(index).copied().flatten().unwrap_or(Vec3::ZERO);
            $then;
        }
    }};
    (@each $outputs:ident $wanted:ident $column:ident $value:ident $then:expr; $($flag:ident $name:ident $of_row:expr;)*) => { $(
        if $wanted.contains(OutputSet::$flag) {
            let $column = &mut $outputs.$name;
            let $value = $of_row;
            $then;
        }
    )* };
}

/// Appends a row to the wanted columns and to the extra ones.
pub(super) fn append(row: &Row, wanted: OutputSet, outputs: &mut OutputBatch) {
    columns!(outputs, wanted, row, |column, value| column.push(value));
    outputs.len += 1;
}

/// Puts a row in the place of another.
pub(super) fn replace(index: usize, row: &Row, wanted: OutputSet, outputs: &mut OutputBatch) {
    columns!(outputs, wanted, row, |column, value| column[index] = value);
}

/// Fills the wanted columns and the extra ones up to a number of rows, with the values of keys that are left out.
pub(super) fn fill_up(len: usize, wanted: OutputSet, outputs: &mut OutputBatch) {
    let row = Row::default();
    columns!(outputs, wanted, row, |column, value| column.resize(len, value));
    outputs.len = len;
}
