//! How a [`SampleBuffer`] is filled: node by node, through the [gate](super::gate).
//!
//! The tracer works in waves, so nodes of one path mostly arrive in the order of their samples; then closing the buffer
//! copies nothing. A column starts as [`Column::Constant`], becomes a [`Column::Palette`] at the first value that differs and
//! one value per row when there are too many, so uniform columns never cost memory.

use std::ops::{Range, RangeInclusive};

use super::buffer::{Column, Node, NodeColumnSet, NodeColumns, PixelRect, Rows, SampleBuffer, SampleColor};
use super::gate::{Faults, GateLog, clean_color, clean_node, clean_offset};
use super::path::NodePath;

/// What a [`SampleBufferBuilder`] keeps.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct SampleLayout {
    /// Samples per pixel, at least 1.
    pub samples_per_pixel: u32,
    /// Columns of the nodes.
    pub columns: NodeColumnSet,
    /// Whether the camera's nodes keep their world position.
    pub position: bool,
    /// How many extra outputs the camera's nodes keep.
    pub aovs: usize,
    /// Line widths above this, in pixels, are clamped by the gate.
    pub max_width: f32,
    /// Lower bounds of the same kind by material, where its shader declares one. May be shorter than `materials`.
    pub declared_widths: Vec<Option<f32>>,
    /// Materials in the scene: `shader` values are 0 … this, included.
    pub materials: usize,
}

impl SampleLayout {
    /// The widest line that the gate lets pass for a shader (its id, from 1).
    pub(super) fn max_width_of(&self, shader: u32) -> f32 {
        let declared = (shader as usize).checked_sub(1).and_then(|index| *self.declared_widths.get(index)?);
        declared.map_or(self.max_width, |declared| declared.min(self.max_width))
    }
}

/// Fills a [`SampleBuffer`]. Nodes of one path may arrive in any order of samples; the order of the samples is the
/// fast one.
#[derive(Debug)]
pub struct SampleBufferBuilder {
    layout: SampleLayout,
    rect: PixelRect,
    offset: Vec<[f32; 2]>,
    /// Empty as long as all samples have the colour `ground`.
    color: Vec<[f32; 3]>,
    alpha: Vec<f32>,
    ground: SampleColor,
    position: Column<[f32; 3]>,
    aovs: Vec<Column<[f32; 3]>>,
    paths: Vec<PathRows>,
    /// Where in `paths` the last node went: waves come path by path.
    last: usize,
    /// Surfaces behind those of `paths`, each with its place in the lists of its path, from 1.
    behind: Vec<(PathRows, usize)>,
    gate: GateLog,
    /// Faults of extra outputs; who made them is known when the camera's nodes are complete.
    extra_faults: Vec<(u32, Faults)>,
}

impl SampleBufferBuilder {
    /// An empty buffer for a rectangle: black, transparent samples at their pixels' corners, without nodes.
    #[must_use]
    pub fn new(rect: PixelRect, layout: &SampleLayout) -> Self {
        Self::with_places(rect, layout, vec![[0.0; 2]; rect.pixels() * layout.samples_per_pixel as usize])
    }

    /// The same with the samples at places in their pixels, each component 0 … 1.
    #[must_use]
    pub fn with_places(rect: PixelRect, layout: &SampleLayout, mut offset: Vec<[f32; 2]>) -> Self {
        let samples = rect.pixels() * layout.samples_per_pixel as usize;
        offset.resize(samples, [0.0; 2]);
        debug_assert!(offset.iter().flatten().all(|x| (0.0..=1.0).contains(x)), "a sample lies outside its pixel");
        let kept = |keep: bool| if keep { Column::Values(vec![[0.0; 3]; samples]) } else { Column::Constant([0.0; 3]) };
        Self {
            rect,
            offset,
            color: Vec::new(),
            alpha: Vec::new(),
            ground: SampleColor::default(),
            position: kept(layout.position),
            aovs: vec![kept(true); layout.aovs],
            paths: vec![PathRows::new(NodePath::CAMERA, samples)],
            last: 0,
            behind: Vec::new(),
            gate: GateLog::default(),
            extra_faults: Vec::new(),
            layout: layout.clone(),
        }
    }

    /// Where in their pixels all samples lie.
    #[must_use]
    pub fn places(&self) -> &[[f32; 2]] {
        &self.offset
    }

    /// Sets a sample's place in its pixel (each component 0 … 1) and its colour. The gate checks the colour; `shader`
    /// is who made it.
    ///
    /// # Panics
    /// If the rectangle has no such sample. So do [`Self::set_color`], [`Self::set_extras`] and [`Self::push`].
    pub fn set_sample(&mut self, sample: u32, offset: [f32; 2], color: SampleColor, shader: u32) {
        self.offset[sample as usize] = clean_offset(offset);
        self.set_color(sample, color, shader);
    }

    /// Sets a sample's colour, made by `shader`, as the gate lets it pass.
    #[inline]
    pub fn set_color(&mut self, sample: u32, color: SampleColor, shader: u32) {
        let (SampleColor { color, alpha }, faults) = clean_color(color);
        self.gate.note(NodePath::CAMERA, sample, shader, faults);
        if self.color.is_empty() {
            self.break_ground();
        }
        self.color[sample as usize] = color;
        self.alpha[sample as usize] = alpha;
    }

    /// From now on each sample has a colour of its own.
    #[cold]
    fn break_ground(&mut self) {
        self.color = vec![self.ground.color; self.offset.len()];
        self.alpha = vec![self.ground.alpha; self.offset.len()];
    }

    /// Sets one colour of a row of samples; no shader made it.
    ///
    /// # Panics
    /// If the rectangle has not all of them.
    pub fn set_same_color(&mut self, samples: Range<u32>, color: SampleColor) {
        let (color, faults) = clean_color(color);
        let places = samples.start as usize..samples.end as usize;
        if self.color.is_empty() && places == (0..self.offset.len()) {
            self.ground = color;
        } else {
            if self.color.is_empty() {
                self.break_ground();
            }
            self.color[places.clone()].fill(color.color);
            self.alpha[places].fill(color.alpha);
        }
        if !faults.is_empty() {
            samples.for_each(|sample| self.gate.note(NodePath::CAMERA, sample, 0, faults));
        }
    }

    /// Sets what only the camera's node of a sample keeps: position and extra outputs (as many as the layout says).
    pub fn set_extras(&mut self, sample: u32, position: [f32; 3], aovs: &[[f32; 3]]) {
        let mut faults = Faults::default();
        if let Column::Values(values) = &mut self.position {
            values[sample as usize] = faults.numbers(position);
        }
        for (column, &value) in self.aovs.iter_mut().zip(aovs) {
            if let Column::Values(values) = column {
                values[sample as usize] = faults.numbers(value);
            }
        }
        if !faults.is_empty() {
            self.extra_faults.push((sample, faults));
        }
    }

    /// Adds a surface behind the node of a path on the same ray: `surface` 1 is the second of the ray's list. The gate checks
    /// it as any node. A miss is no surface; one without a surface before it in the list is dropped when the buffer is
    /// closed.
    ///
    /// # Panics
    /// If the rectangle has no such sample, or `surface` is 0.
    pub fn push_behind(&mut self, path: NodePath, surface: usize, sample: u32, mut node: Node) {
        self.check(sample);
        assert!(surface > 0, "the first surface is the node itself");
        if node.object == 0 {
            return;
        }
        let kept = NodeColumnSet { throughput: false, contribution: false, ..self.layout.columns };
        let faults = clean_node(&mut node, kept, &self.layout);
        self.gate.note(path, sample, node.shader, faults);
        let place = self.behind.iter().position(|(rows, of)| *of == surface && rows.path == path);
        let place = place.unwrap_or_else(|| {
            self.behind.push((PathRows::new(path, 0), surface));
            self.behind.len() - 1
        });
        self.behind[place].0.extend(sample..sample + 1, std::iter::once(&node), kept);
    }

    /// Adds a node; of several at one path of one sample the first stays. Columns that the layout does not keep are
    /// dropped here; the gate checks the others.
    pub fn push(&mut self, path: NodePath, sample: u32, mut node: Node) {
        self.push_clean(path, sample..sample + 1, &mut node);
    }

    /// Adds one and the same node to a row of samples, none of which has a node at its path yet.
    ///
    /// # Panics
    /// If the rectangle has not all of them. So does [`Self::push_row`].
    pub fn push_same(&mut self, path: NodePath, samples: RangeInclusive<u32>, mut node: Node) {
        let (&first, &last) = (samples.start(), samples.end());
        let faults = self.push_clean(path, first..first + 1, &mut node);
        if first == last {
            return;
        }
        self.check(last);
        if !faults.is_empty() {
            samples.skip(1).for_each(|sample| self.gate.note(path, sample, node.shader, faults));
        }
        let columns = self.layout.columns;
        self.rows_of(path).repeat(first + 1..last + 1, columns);
    }

    /// Adds the nodes of a row of samples, as [`Self::push`] does: for each sample the one at its place among `nodes`, which are left as
    /// the gate lets them pass.
    pub fn push_row(
        &mut self,
        path: NodePath,
        samples: Range<u32>,
        nodes: &mut [Node],
        places: impl Iterator<Item = usize> + Clone,
    ) {
        self.check(samples.end - 1);
        for (sample, place) in samples.clone().zip(places.clone()) {
            let node = &mut nodes[place];
            let faults = clean_node(node, self.layout.columns, &self.layout);
            self.gate.note(path, sample, node.shader, faults);
        }
        let columns = self.layout.columns;
        let nodes = &*nodes;
        self.rows_of(path).extend(samples, places.map(|place| &nodes[place]), columns);
    }

    fn push_clean(&mut self, path: NodePath, sample: Range<u32>, node: &mut Node) -> Faults {
        self.check(sample.start);
        let faults = clean_node(node, self.layout.columns, &self.layout);
        self.gate.note(path, sample.start, node.shader, faults);
        let columns = self.layout.columns;
        self.rows_of(path).extend(sample, std::iter::once(&*node), columns);
        faults
    }

    fn check(&self, sample: u32) {
        assert!((sample as usize) < self.offset.len(), "sample {sample} lies outside the buffer");
    }

    fn rows_of(&mut self, path: NodePath) -> &mut PathRows {
        if self.paths[self.last].path != path {
            self.last = self.paths.iter().position(|rows| rows.path == path).unwrap_or_else(|| {
                self.paths.push(PathRows::new(path, 0));
                self.paths.len() - 1
            });
        }
        &mut self.paths[self.last]
    }

    /// Sorts the nodes and closes the buffer. A sample without a camera node gets a miss.
    #[must_use]
    pub fn finish(mut self) -> SampleBuffer {
        self.add_missing_camera_nodes();
        self.paths.sort_by_key(|rows| rows.path);
        let per_pixel = self.layout.samples_per_pixel;
        let mut paths: Vec<_> =
            self.paths.into_iter().map(|rows| rows.finish(&self.rect, per_pixel, |_| true)).collect();
        self.behind.sort_by_key(|(rows, surface)| (rows.path, *surface));
        for (rows, surface) in self.behind {
            let Ok(front) = paths.binary_search_by_key(&rows.path, |nodes| nodes.path) else { continue };
            let front = &mut paths[front];
            if front.behind.len() + 1 == surface {
                let before = front.behind.last().unwrap_or(front);
                let behind = rows.finish(&self.rect, per_pixel, |sample| {
                    let row = before.row_in_pixel((sample / per_pixel) as usize, sample);
                    row.is_some_and(|row| before.object.get(row) != 0)
                });
                if !behind.rows.is_empty() {
                    front.behind.push(behind);
                }
            }
        }
        for (sample, faults) in self.extra_faults {
            self.gate.note(NodePath::CAMERA, sample, paths[0].shader.get(sample as usize), faults);
        }
        SampleBuffer {
            rect: self.rect,
            samples_per_pixel: self.layout.samples_per_pixel,
            offset: self.offset,
            color: column(self.color, self.ground.color),
            alpha: column(self.alpha, self.ground.alpha),
            position: self.position.collapsed(),
            aovs: self.aovs.into_iter().map(Column::collapsed).collect(),
            paths,
            gate: self.gate.counts(self.layout.materials),
        }
    }

    fn add_missing_camera_nodes(&mut self) {
        let camera = &mut self.paths[0];
        if camera.samples.rising && camera.samples.len() == self.offset.len() {
            return;
        }
        let mut present = vec![false; self.offset.len()];
        for row in 0..camera.samples.len() {
            present[camera.samples.get(row) as usize] = true;
        }
        for sample in (0..).zip(present).filter_map(|(sample, present)| (!present).then_some(sample)) {
            camera.extend(sample..sample + 1, std::iter::once(&Node::default()), self.layout.columns);
        }
    }
}

/// The nodes of one path, in the order they came.
#[derive(Debug)]
struct PathRows {
    path: NodePath,
    /// How many rows to make room for.
    expected: usize,
    samples: RowSamples,
    object: Column<u32>,
    member: Column<u32>,
    shader: Column<u32>,
    uv: Column<[f32; 2]>,
    normal: Column<[f32; 3]>,
    feature: Column<[f32; 3]>,
    depth: Column<f32>,
    line_color: Column<[f32; 3]>,
    line_width: Column<f32>,
    line_opacity: Column<f32>,
    priority: Column<i32>,
    position: Column<[f32; 3]>,
    geometric_normal: Column<[f32; 3]>,
    footprint: Column<f32>,
    throughput: Column<[f32; 3]>,
    contribution: Column<[f32; 3]>,
}

/// The sample of each row. While rows and samples are the same numbers, as at the camera's path, none is written down.
#[derive(Debug)]
struct RowSamples {
    /// Rows without `listed`.
    count: u32,
    listed: Option<Vec<u32>>,
    /// Whether samples have been strictly rising.
    rising: bool,
}

impl Default for RowSamples {
    fn default() -> Self {
        Self { count: 0, listed: None, rising: true }
    }
}

impl RowSamples {
    fn len(&self) -> usize {
        self.listed.as_ref().map_or(self.count as usize, Vec::len)
    }

    fn get(&self, row: usize) -> u32 {
        self.listed.as_ref().map_or(row as u32, |listed| listed[row])
    }

    /// Adds rows for samples that follow each other.
    fn extend(&mut self, samples: Range<u32>, expected: usize) {
        if self.listed.is_none() && samples.start == self.count {
            self.count = samples.end;
        } else {
            samples.for_each(|sample| self.push(sample, expected));
        }
    }

    fn push(&mut self, sample: u32, expected: usize) {
        match &mut self.listed {
            None if sample == self.count => self.count += 1,
            None => {
                let mut listed = Vec::with_capacity(expected.max(self.count as usize + 1));
                listed.extend(0..self.count);
                self.rising = sample > self.count;
                listed.push(sample);
                self.listed = Some(listed);
            }
            Some(listed) => {
                self.rising &= listed.last().is_none_or(|&last| last < sample);
                listed.push(sample);
            }
        }
    }
}

impl PathRows {
    fn new(path: NodePath, expected: usize) -> Self {
        let neutral = Node::default();
        Self {
            path,
            expected,
            samples: RowSamples::default(),
            object: Column::Constant(neutral.object),
            member: Column::Constant(neutral.member),
            shader: Column::Constant(neutral.shader),
            uv: Column::Constant(neutral.uv),
            normal: Column::Constant(neutral.normal),
            feature: Column::Constant(neutral.feature),
            depth: Column::Constant(neutral.depth),
            line_color: Column::Constant(neutral.line_color),
            line_width: Column::Constant(neutral.line_width),
            line_opacity: Column::Constant(neutral.line_opacity),
            priority: Column::Constant(neutral.priority),
            position: Column::Constant(neutral.position),
            geometric_normal: Column::Constant(neutral.geometric_normal),
            footprint: Column::Constant(neutral.footprint),
            throughput: Column::Constant(neutral.throughput),
            contribution: Column::Constant(neutral.contribution),
        }
    }

    /// Adds the nodes of samples that follow each other: column by column, which is quicker than node by node.
    fn extend<'n>(&mut self, samples: Range<u32>, nodes: impl Iterator<Item = &'n Node> + Clone, kept: NodeColumnSet) {
        let (row, expected) = (self.samples.len(), self.expected);
        self.samples.extend(samples, expected);
        self.object.extend(row, nodes.clone().map(|node| node.object), expected);
        self.shader.extend(row, nodes.clone().map(|node| node.shader), expected);
        if kept.depth {
            self.depth.extend(row, nodes.clone().map(|node| node.depth), expected);
        }
        if kept.uv {
            self.uv.extend(row, nodes.clone().map(|node| node.uv), expected);
        }
        if kept.normal {
            self.normal.extend(row, nodes.clone().map(|node| node.normal), expected);
        }
        if kept.feature {
            self.feature.extend(row, nodes.clone().map(|node| node.feature), expected);
        }
        if kept.lines {
            self.line_color.extend(row, nodes.clone().map(|node| node.line_color), expected);
            self.line_width.extend(row, nodes.clone().map(|node| node.line_width), expected);
            self.line_opacity.extend(row, nodes.clone().map(|node| node.line_opacity), expected);
            self.priority.extend(row, nodes.clone().map(|node| node.priority), expected);
        }
        if kept.member {
            self.member.extend(row, nodes.clone().map(|node| node.member), expected);
        }
        if kept.overlap || kept.position {
            self.position.extend(row, nodes.clone().map(|node| node.position), expected);
        }
        if kept.overlap {
            self.geometric_normal.extend(row, nodes.clone().map(|node| node.geometric_normal), expected);
            self.footprint.extend(row, nodes.clone().map(|node| node.footprint), expected);
        }
        if kept.throughput {
            self.throughput.extend(row, nodes.clone().map(|node| node.throughput), expected);
        }
        if kept.contribution {
            self.contribution.extend(row, nodes.map(|node| node.contribution), expected);
        }
    }

    /// Gives further samples the node of the last row.
    fn repeat(&mut self, samples: Range<u32>, kept: NodeColumnSet) {
        let count = samples.len();
        self.samples.extend(samples, self.expected);
        self.object.repeat(count);
        self.shader.repeat(count);
        if kept.depth {
            self.depth.repeat(count);
        }
        if kept.uv {
            self.uv.repeat(count);
        }
        if kept.normal {
            self.normal.repeat(count);
        }
        if kept.feature {
            self.feature.repeat(count);
        }
        if kept.lines {
            self.line_color.repeat(count);
            self.line_width.repeat(count);
            self.line_opacity.repeat(count);
            self.priority.repeat(count);
        }
        if kept.member {
            self.member.repeat(count);
        }
        if kept.overlap || kept.position {
            self.position.repeat(count);
        }
        if kept.overlap {
            self.geometric_normal.repeat(count);
            self.footprint.repeat(count);
        }
        if kept.throughput {
            self.throughput.repeat(count);
        }
        if kept.contribution {
            self.contribution.repeat(count);
        }
    }

    /// The columns of the samples to be kept.
    fn finish(self, rect: &PixelRect, samples_per_pixel: u32, keep: impl Fn(u32) -> bool) -> NodeColumns {
        let samples = &self.samples;
        let rows = 0..samples.len() as u32;
        let sample_of = |row: u32| samples.get(row as usize);
        let all_kept = rows.clone().all(|row| keep(sample_of(row)));
        let order = (!samples.rising || !all_kept).then(|| {
            let mut order: Vec<u32> = rows.clone().filter(|&row| keep(sample_of(row))).collect();
            order.sort_by_key(|&row| sample_of(row));
            order.dedup_by_key(|row| sample_of(*row));
            order
        });
        let order = order.as_deref();
        let all = rect.pixels() * samples_per_pixel as usize;
        let rows = if order.map_or(samples.len(), <[u32]>::len) == all {
            Rows::Every { samples: all as u32, per_pixel: samples_per_pixel }
        } else {
            let sample: Vec<u32> = match order {
                Some(order) => order.iter().map(|&row| sample_of(row)).collect(),
                None => rows.map(sample_of).collect(),
            };
            let mut first = vec![0; rect.pixels() + 1];
            for &sample in &sample {
                first[(sample / samples_per_pixel) as usize + 1] += 1;
            }
            for pixel in 1..first.len() {
                first[pixel] += first[pixel - 1];
            }
            Rows::Some { first, sample }
        };
        NodeColumns {
            path: self.path,
            rows,
            object: self.object.ordered(order),
            member: self.member.ordered(order),
            shader: self.shader.ordered(order),
            uv: self.uv.ordered(order),
            normal: self.normal.ordered(order),
            feature: self.feature.ordered(order),
            depth: self.depth.ordered(order),
            line_color: self.line_color.ordered(order),
            line_width: self.line_width.ordered(order),
            line_opacity: self.line_opacity.ordered(order),
            priority: self.priority.ordered(order),
            position: self.position.ordered(order),
            geometric_normal: self.geometric_normal.ordered(order),
            footprint: self.footprint.ordered(order),
            throughput: self.throughput.ordered(order),
            contribution: self.contribution.ordered(order),
            behind: Vec::new(),
        }
    }
}

impl<T: Copy + PartialEq> Column<T> {
    /// Appends the value of row number `row`. Behind the gate `==` means equal bits, so nothing is lost when equal
    /// values share one.
    #[inline]
    pub(super) fn push(&mut self, row: usize, value: T, expected: usize) {
        match self {
            Self::Values(values) => values.push(value),
            Self::Palette { values, places } => {
                let last = places[row - 1];
                if values[usize::from(last)] == value {
                    places.push(last);
                } else {
                    self.push_other(row, value, expected);
                }
            }
            Self::Constant(constant) if row == 0 => *constant = value,
            Self::Constant(constant) if *constant == value => {}
            Self::Constant(constant) => {
                let mut places = Vec::with_capacity(expected.max(row + 1));
                places.resize(row, 0);
                places.push(1);
                *self = Self::Palette { values: vec![*constant, value], places };
            }
        }
    }

    /// Appends values from row number `row` on.
    fn extend(&mut self, row: usize, mut values: impl Iterator<Item = T>, expected: usize) {
        let mut row = row;
        while let Some(value) = values.next() {
            self.push(row, value, expected);
            row += 1;
            if let Self::Values(all) = self {
                all.extend(values);
                return;
            }
        }
    }

    /// Appends the value of the last row some times more.
    fn repeat(&mut self, count: usize) {
        match self {
            Self::Values(values) => {
                if let Some(&last) = values.last() {
                    values.resize(values.len() + count, last);
                }
            }
            Self::Palette { places, .. } => {
                if let Some(&last) = places.last() {
                    places.resize(places.len() + count, last);
                }
            }
            Self::Constant(_) => {}
        }
    }

    /// Appends a value that is not that of the row before to a palette.
    fn push_other(&mut self, row: usize, value: T, expected: usize) {
        let Self::Palette { values, places } = self else { return };
        if let Some(place) = values.iter().position(|known| *known == value) {
            places.push(place as u8);
            return;
        }
        // Values that come faster than this will be too many; it is sooner said than tried.
        if values.len() < (16 + row / 32).min(256) {
            places.push(values.len() as u8);
            values.push(value);
            return;
        }
        let mut all = Vec::with_capacity(expected.max(row + 1));
        all.extend(places.iter().map(|&place| values[usize::from(place)]));
        all.push(value);
        *self = Self::Values(all);
    }

    /// The values in another order, in no more memory than they need.
    pub(super) fn ordered(self, order: Option<&[u32]>) -> Self {
        if order.is_none() {
            return match self {
                Self::Values(mut values) => {
                    values.shrink_to_fit();
                    Self::Values(values)
                }
                Self::Palette { values, mut places } => {
                    places.shrink_to_fit();
                    Self::Palette { values, places }
                }
                constant => constant,
            };
        }
        // Pushed once more, so that equal columns have equal forms whatever the order they came in.
        let order = order.unwrap_or_default();
        let mut ordered = Self::Constant(self.get(order.first().map_or(0, |&row| row as usize)));
        for (row, &from) in order.iter().enumerate() {
            ordered.push(row, self.get(from as usize), order.len());
        }
        ordered.ordered(None)
    }

    /// [`Self::Constant`] if all values are equal.
    fn collapsed(self) -> Self {
        match &self {
            Self::Values(values) => match values.split_first() {
                Some((first, rest)) if rest.iter().all(|value| value == first) => Self::Constant(*first),
                _ => self,
            },
            Self::Palette { .. } | Self::Constant(_) => self,
        }
    }
}

/// Values of samples, or the one of all if there are none.
fn column<T: Copy + PartialEq>(values: Vec<T>, ground: T) -> Column<T> {
    if values.is_empty() { Column::Constant(ground) } else { Column::Values(values).collapsed() }
}

/// A sample as data, for tests and for line work on pictures from elsewhere.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct HandMadeSample<'a> {
    /// Place in the pixel, each component 0 … 1.
    pub offset: [f32; 2],
    /// Colour without lines.
    pub color: SampleColor,
    /// Its nodes, at most one per path.
    pub nodes: &'a [(NodePath, Node)],
    /// The surfaces behind them, for each path front to back.
    pub behind: &'a [(NodePath, Node)],
}

impl SampleBuffer {
    /// A buffer from samples in order (pixel by pixel, row by row), through the gate as if they had been traced.
    /// Samples that are missing at the end are transparent misses; any too many are ignored.
    #[must_use]
    pub fn from_samples(rect: PixelRect, layout: &SampleLayout, samples: &[HandMadeSample<'_>]) -> Self {
        let mut builder = SampleBufferBuilder::new(rect, layout);
        let count = builder.offset.len();
        for (index, sample) in (0..).zip(samples.iter().take(count)) {
            let shader = sample.nodes.iter().find(|(path, _)| *path == NodePath::CAMERA).map_or(0, |(_, n)| n.shader);
            builder.set_sample(index, sample.offset, sample.color, shader);
            for &(path, node) in sample.nodes {
                builder.push(path, index, node);
            }
            for (place, &(path, node)) in sample.behind.iter().enumerate() {
                let before = sample.behind[..place].iter().filter(|(other, _)| *other == path).count();
                builder.push_behind(path, before + 1, index, node);
            }
        }
        builder.finish()
    }
}
