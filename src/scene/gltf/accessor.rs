//! Reading accessors: typed arrays inside the buffers.
//!
//! Nothing is allocated by a count that a file merely claims: the bytes for that many elements must be there first.

use std::fmt::Write as _;

use gltf::json::accessor::{ComponentType, Type};
use gltf::json::validation::Checked;

use super::document::Document;
use super::report::Report;

/// The most elements of an accessor that has no bytes of its own (sparse over zeros).
const MAX_ZEROS: u64 = 1 << 24;

/// What an accessor must hold to be of use.
#[derive(Clone, Copy)]
pub(super) struct Wanted {
    pub types: &'static [Type],
    pub components: &'static [ComponentType],
}

/// Any component type: KHR_mesh_quantization widens most attributes to them.
pub(super) const ANY_NUMBER: &[ComponentType] =
    &[ComponentType::I8, ComponentType::U8, ComponentType::I16, ComponentType::U16, ComponentType::F32];

/// What indices may be made of.
pub(super) const UNSIGNED: &[ComponentType] = &[ComponentType::U8, ComponentType::U16, ComponentType::U32];

/// Floats only.
pub(super) const FLOAT: &[ComponentType] = &[ComponentType::F32];

/// The checked bytes of an accessor.
struct Elements<'a> {
    /// `None`: all zeros.
    bytes: Option<&'a [u8]>,
    stride: usize,
    /// Bytes of one element.
    size: usize,
    count: usize,
    component: ComponentType,
    /// Components of one element.
    width: usize,
    normalized: bool,
    /// Elements that replace those in `bytes`.
    patches: Vec<(usize, &'a [u8])>,
}

impl Document {
    /// Reads an accessor as vectors of `N` floats; components that it lacks become 1 (the alpha of a colour).
    /// `None` if that cannot be done, which is reported at `place`.
    pub fn floats<const N: usize>(
        &self,
        accessor: usize,
        wanted: Wanted,
        place: &str,
        report: &mut Report,
    ) -> Option<Vec<[f32; N]>> {
        let elements = self.elements(accessor, wanted, place, report)?;
        let (component, normalized) = (elements.component, elements.normalized);
        Some(elements.decode(1.0, |bytes| to_float(component, normalized, bytes)))
    }

    /// Reads an accessor as vectors of `N` integers; otherwise as [`Self::floats`].
    pub fn integers<const N: usize>(
        &self,
        accessor: usize,
        wanted: Wanted,
        place: &str,
        report: &mut Report,
    ) -> Option<Vec<[u32; N]>> {
        let elements = self.elements(accessor, wanted, place, report)?;
        let component = elements.component;
        Some(elements.decode(0, |bytes| to_integer(component, bytes)))
    }

    fn elements(&self, index: usize, wanted: Wanted, place: &str, report: &mut Report) -> Option<Elements<'_>> {
        match self.check_elements(index, wanted) {
            Ok(elements) => Some(elements),
            Err(Some(message)) => report.fail(place, format!("accessors[{index}]: {message}")),
            Err(None) => None,
        }
    }

    /// `Err(None)`: already reported.
    fn check_elements(&self, index: usize, wanted: Wanted) -> Result<Elements<'_>, Option<String>> {
        let accessor = self.root.accessors.get(index).ok_or_else(|| "there is no such accessor".to_owned())?;
        let (Checked::Valid(kind), Checked::Valid(component)) = (accessor.type_, accessor.component_type) else {
            return Err(Some("its type is not one that glTF knows".into()));
        };
        let component = component.0;
        if !wanted.types.contains(&kind) || !wanted.components.contains(&component) {
            return Err(Some(format!(
                "expected {}, found {}",
                spelled(wanted.types, wanted.components),
                spelled(&[kind], &[component])
            )));
        }
        let width = kind.multiplicity();
        let size = width * component.size();
        let claimed = accessor.count.0;
        let bytes = match accessor.buffer_view {
            None if claimed > MAX_ZEROS => {
                return Err(Some(format!("{claimed} elements without a buffer view are too many")));
            }
            None => None,
            Some(view) => Some(self.view(view.value())?),
        };
        let stride = accessor
            .buffer_view
            .and_then(|view| self.root.buffer_views[view.value()].byte_stride)
            .map_or(size, |stride| if stride.0 == 0 { size } else { stride.0 });
        if stride < size {
            return Err(Some(format!("the stride of {stride} bytes is less than the {size} bytes of an element")));
        }
        let bytes = match bytes {
            None => None,
            Some(bytes) => {
                let offset = accessor.byte_offset.map_or(0, |offset| offset.0);
                Some(window(bytes, offset, claimed, stride, size).ok_or_else(|| {
                    format!(
                        "{claimed} elements of {size} bytes, {stride} bytes apart, from byte {offset}, reach beyond its \
                         buffer view, which has {} bytes",
                        bytes.len()
                    )
                })?)
            }
        };
        let count = usize::try_from(claimed).map_err(|_| Some("too many elements".to_owned()))?;
        let patches = self.sparse(index, count, size)?;
        Ok(Elements { bytes, stride, size, count, component, width, normalized: accessor.normalized, patches })
    }

    fn sparse(&self, index: usize, count: usize, size: usize) -> Result<Vec<(usize, &[u8])>, Option<String>> {
        let Some(sparse) = &self.root.accessors[index].sparse else {
            return Ok(Vec::new());
        };
        let Checked::Valid(component) = sparse.indices.component_type else {
            return Err(Some("its sparse indices have a type that glTF does not know".into()));
        };
        let component = component.0;
        let patched = sparse.count.0;
        let part = |name: &str, view: usize, offset: u64, size: usize| {
            let bytes = self.view(view)?;
            window(bytes, offset, patched, size, size)
                .ok_or_else(|| Some(format!("its {patched} sparse {name} reach beyond bufferViews[{view}]")))
        };
        let indices =
            part("indices", sparse.indices.buffer_view.value(), sparse.indices.byte_offset.0, component.size())?;
        let values = part("values", sparse.values.buffer_view.value(), sparse.values.byte_offset.0, size)?;
        indices
            .chunks_exact(component.size())
            .zip(values.chunks_exact(size))
            .map(|(index, value)| match to_integer(component, index) as usize {
                index if index < count => Ok((index, value)),
                index => Err(Some(format!("its sparse index {index} is beyond its {count} elements"))),
            })
            .collect()
    }
}

/// The bytes from `offset` that hold `count` elements, if they are all there.
fn window(bytes: &[u8], offset: u64, count: u64, stride: usize, size: usize) -> Option<&[u8]> {
    let length = match count.checked_sub(1) {
        None => 0,
        Some(before) => before.checked_mul(stride as u64)?.checked_add(size as u64)?,
    };
    let end = usize::try_from(offset.checked_add(length)?).ok()?;
    bytes.get(usize::try_from(offset).ok()?..end)
}

impl Elements<'_> {
    fn decode<T: Copy, const N: usize>(&self, absent: T, component: impl Fn(&[u8]) -> T) -> Vec<[T; N]> {
        let bytes_each = self.component.size();
        let element = |bytes: &[u8]| {
            let mut out = [absent; N];
            for (out, bytes) in out.iter_mut().zip(bytes.chunks_exact(bytes_each).take(self.width)) {
                *out = component(bytes);
            }
            out
        };
        let zeros = [0; 64];
        let mut all: Vec<_> = match self.bytes {
            Some(bytes) => {
                (0..self.count).map(|i| element(&bytes[i * self.stride..i * self.stride + self.size])).collect()
            }
            None => vec![element(&zeros[..self.size]); self.count],
        };
        for (index, bytes) in &self.patches {
            all[*index] = element(bytes);
        }
        all
    }
}

/// A component as a float; the divisors and the clamp are those of the specification (section 3.6.2.2).
fn to_float(component: ComponentType, normalized: bool, bytes: &[u8]) -> f32 {
    let (value, unit) = match (component, bytes) {
        (ComponentType::I8, [a]) => (f32::from(i8::from_le_bytes([*a])), 127.0),
        (ComponentType::U8, [a]) => (f32::from(*a), 255.0),
        (ComponentType::I16, [a, b]) => (f32::from(i16::from_le_bytes([*a, *b])), 32_767.0),
        (ComponentType::U16, [a, b]) => (f32::from(u16::from_le_bytes([*a, *b])), 65_535.0),
        (ComponentType::U32, [a, b, c, d]) => (u32::from_le_bytes([*a, *b, *c, *d]) as f32, u32::MAX as f32),
        (ComponentType::F32, [a, b, c, d]) => return f32::from_le_bytes([*a, *b, *c, *d]),
        _ => return 0.0,
    };
    if normalized { f32::max(value / unit, -1.0) } else { value }
}

fn to_integer(component: ComponentType, bytes: &[u8]) -> u32 {
    match (component, bytes) {
        (ComponentType::U8, [a]) => u32::from(*a),
        (ComponentType::U16, [a, b]) => u32::from(u16::from_le_bytes([*a, *b])),
        (ComponentType::U32, [a, b, c, d]) => u32::from_le_bytes([*a, *b, *c, *d]),
        // Callers ask for unsigned components only.
        _ => 0,
    }
}

fn spelled(types: &[Type], components: &[ComponentType]) -> String {
    let mut text = String::new();
    for (i, kind) in types.iter().enumerate() {
        let or = if i == 0 { "" } else { " or " };
        let _ = write!(text, "{or}{}", format!("{kind:?}").to_uppercase());
    }
    for (i, component) in components.iter().enumerate() {
        let of = if i == 0 { " of" } else { "," };
        let _ = write!(text, "{of} {}", format!("{component:?}").to_lowercase());
    }
    text
}
