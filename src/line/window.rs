//! The samples that a line pass can see: a grid of tiles.

use std::ops::Range;

use super::bounds::{PathBounds, TileBounds};
use super::differ::Features;
use super::pair::{LineNode, Rank};
use super::{LineScript, LineType, Rules};
use crate::sample::{NodeColumns, NodePath, PixelRect, SampleBuffer};
use crate::scene::settings::TypeStyle;

/// A tile of samples with what the line pass has prepared for it.
#[derive(Clone, Copy, Debug)]
pub struct LineTile<'a> {
    /// The samples.
    pub buffer: &'a SampleBuffer,
    /// Made from them, by the rules that lines are then searched with.
    pub bounds: &'a TileBounds,
}

/// A rectangle of the picture cut into tiles of one size (those at the right and lower border may be smaller), of
/// which those near the targets are present.
#[derive(Clone, Debug)]
pub struct Window<'a> {
    /// Upper left pixel of the grid.
    pub origin: [i32; 2],
    /// Side of a tile in pixels.
    pub tile: i32,
    /// Tiles per row of the grid.
    pub columns: usize,
    /// The tiles, row by row; `None` where not yet or no longer there.
    pub tiles: Vec<Option<LineTile<'a>>>,
}

impl<'a> Window<'a> {
    /// A window of one tile alone.
    #[must_use]
    pub fn single(tile: LineTile<'a>) -> Self {
        let rect = tile.buffer.rect;
        let side = rect.width().max(rect.height()).max(1) as i32;
        Self { origin: [rect.x0, rect.y0], tile: side, columns: 1, tiles: vec![Some(tile)] }
    }

    /// The same tiles, seen at one path.
    pub(super) fn at_path(&self, path: NodePath) -> PathWindow<'a> {
        PathWindow {
            origin: self.origin,
            tile: self.tile,
            columns: self.columns,
            tiles: self.tiles.iter().map(|tile| tile.and_then(|tile| PathTile::new(tile, path))).collect(),
        }
    }
}

/// The nodes of a [`Window`] at one path.
#[derive(Clone, Debug)]
pub(super) struct PathWindow<'a> {
    origin: [i32; 2],
    tile: i32,
    columns: usize,
    /// The tiles that have nodes at the path.
    pub tiles: Vec<Option<PathTile<'a>>>,
}

/// Part of a row of pixels that lies in one tile.
#[derive(Clone, Copy, Debug)]
pub(super) struct Segment<'w, 'a> {
    /// Place of the tile in the window.
    pub index: usize,
    pub tile: &'w PathTile<'a>,
    pub y: i32,
    /// Left, included.
    pub x0: i32,
    /// Right, excluded.
    pub x1: i32,
}

impl<'a> PathWindow<'a> {
    /// The tiles that overlap a rectangle and have nodes, with their places in the window, row by row.
    pub(super) fn tiles_in(&self, rect: PixelRect) -> impl Iterator<Item = (usize, &PathTile<'a>)> {
        let rows = self.tiles.len().div_ceil(self.columns.max(1));
        let columns = self.grid_range(rect.x0, rect.x1, 0, self.columns);
        let rows = self.grid_range(rect.y0, rect.y1, 1, rows);
        rows.flat_map(move |row| columns.clone().map(move |column| row * self.columns + column))
            .filter_map(|index| Some((index, self.tiles.get(index)?.as_ref()?)))
    }

    /// The tile that a pixel lies in, if it has nodes, with its place in the window.
    pub(super) fn tile_of(&self, [x, y]: [i32; 2]) -> Option<(usize, &PathTile<'a>)> {
        self.tiles_in(PixelRect { x0: x, y0: y, x1: x + 1, y1: y + 1 })
            .find(|(_, tile)| tile.buffer.rect.contains(x, y))
    }

    /// The rows of pixels of a rectangle, cut at tile borders, from the top, each from the left.
    pub(super) fn segments(&self, rect: PixelRect) -> impl Iterator<Item = Segment<'_, 'a>> {
        let height = self.tile * self.tiles.len().div_ceil(self.columns.max(1)) as i32;
        let (y0, y1) = (rect.y0.max(self.origin[1]), rect.y1.min(self.origin[1] + height));
        (y0..y1).flat_map(move |y| {
            let row = PixelRect { y0: y, y1: y + 1, ..rect };
            self.tiles_in(row).filter_map(move |(index, tile)| {
                let part = row.intersection(&tile.buffer.rect);
                (part.pixels() > 0).then_some(Segment { index, tile, y, x0: part.x0, x1: part.x1 })
            })
        })
    }

    /// The tiles that pixels `low .. high` along an axis fall into.
    fn grid_range(&self, low: i32, high: i32, axis: usize, count: usize) -> Range<usize> {
        let first = (low - self.origin[axis]).div_euclid(self.tile).max(0) as usize;
        let last = (high - 1 - self.origin[axis]).div_euclid(self.tile).max(-1) + 1;
        first..(last as usize).min(count)
    }
}

/// The nodes of a [`LineTile`] at one path.
#[derive(Clone, Copy, Debug)]
pub(super) struct PathTile<'a> {
    pub buffer: &'a SampleBuffer,
    pub nodes: &'a NodeColumns,
    pub bounds: &'a PathBounds,
}

impl<'a> PathTile<'a> {
    /// `None` if no sample has a node at the path, or if the rules draw no lines there.
    pub(super) fn new(tile: LineTile<'a>, path: NodePath) -> Option<Self> {
        Some(Self { buffer: tile.buffer, nodes: tile.buffer.nodes(path)?, bounds: tile.bounds.at_path(path)? })
    }

    /// The node of a row that lies in a pixel.
    #[inline(always)]
    pub(super) fn node(&self, pixel: [i32; 2], row: usize) -> LineNode {
        LineNode {
            pixel,
            offset: self.offset(row),
            features: self.features(row),
            rank: self.rank(row),
            radius_squared: self.bounds.radius_squared.get(row),
        }
    }

    /// Place of a row's sample in its pixel.
    #[inline(always)]
    pub(super) fn offset(&self, row: usize) -> [f32; 2] {
        self.buffer.offset[self.nodes.rows.sample(row) as usize]
    }

    #[inline(always)]
    pub(super) fn rank(&self, row: usize) -> Rank {
        Rank::new(self.nodes.priority.get(row), self.nodes.depth.get(row))
    }

    /// Where the surface at a place of a row's list is kept: its columns and its row there.
    pub(super) fn surface(&self, row: usize, place: u32) -> Option<(&'a NodeColumns, usize)> {
        let Some(behind) = (place as usize).checked_sub(1) else { return Some((self.nodes, row)) };
        let behind = self.nodes.behind.get(behind)?;
        let sample = self.nodes.rows.sample(row);
        Some((behind, behind.row_in_pixel((sample / self.buffer.samples_per_pixel) as usize, sample)?))
    }

    #[inline(always)]
    pub(super) fn style(&self, row: usize, rules: &Rules) -> LineStyle {
        style(self.nodes, row, rules)
    }

    #[inline(always)]
    pub(super) fn features(&self, row: usize) -> Features {
        features(self.nodes, row)
    }
}

/// What of a node a line shows: colour, width and opacity.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct LineStyle {
    color: [f32; 3],
    width: f32,
    opacity: f32,
    /// Whether a script decides.
    scripted: bool,
}

impl LineStyle {
    pub(super) fn is_opaque(&self, rules: &Rules) -> bool {
        rules.alpha(self.width) * self.opacity >= 1.0 && !self.scripted
    }
}

/// How much the line of a row covers, 0 … 1, if it is of a type that may change it.
pub(super) fn alpha(nodes: &NodeColumns, row: usize, kind: Option<LineType>, rules: &Rules) -> f32 {
    let changed = rules.types().map_or_else(TypeStyle::default, |types| types.style(kind));
    let width = changed.width.unwrap_or_else(|| nodes.line_width.get(row));
    rules.alpha(width) * nodes.line_opacity.get(row) * changed.opacity.unwrap_or(1.0)
}

/// The style of a row.
#[inline(always)]
pub(super) fn style(nodes: &NodeColumns, row: usize, rules: &Rules) -> LineStyle {
    LineStyle {
        color: nodes.line_color.get(row),
        width: nodes.line_width.get(row),
        opacity: nodes.line_opacity.get(row),
        scripted: !rules.no_scripts() && rules.script_of(nodes.shader.get(row)) != LineScript::None,
    }
}

/// The feature attributes of a row.
#[inline(always)]
pub(super) fn features(nodes: &NodeColumns, row: usize) -> Features {
    Features {
        object: nodes.object.get(row),
        shader: nodes.shader.get(row),
        uv: nodes.uv.get(row),
        normal: nodes.normal.get(row),
        feature: nodes.feature.get(row),
    }
}
