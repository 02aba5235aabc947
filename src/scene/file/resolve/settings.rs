//! `[render]` and `[lines]`.

use std::collections::BTreeSet;

use super::super::document::Node;
use super::super::format;
use super::{Resolver, rgb, unknown_name};
use crate::diag::Diagnostic;
use crate::math::Vec3;
use crate::scene::check::{MAX_PIXELS, MAX_SAMPLES};
use crate::scene::ids::ObjectId;
use crate::scene::settings::{
    Background, Composition, FilterKind, HiddenLines, LineOverrides, LineSettings, LineType, RayKinds, RenderSettings,
    Sampler, TypeStyle,
};
use crate::scene::texture::{Texture, TextureFilter, Wrap};

impl Resolver<'_> {
    pub(super) fn render(&mut self, render: &format::Render) {
        let node = self.part("render");
        let depth = render.reflection_depth + render.refraction_depth;
        if depth > 30 {
            let span = ["refraction_depth", "reflection_depth"].iter().find_map(|key| node.get(key)).unwrap_or(node);
            let message = format!("`reflection_depth` and `refraction_depth` add up to {depth}: 30 is the most");
            self.fault(message, span.span.clone());
        }
        let pixels: u64 = render.size.iter().map(|n| u64::from(*n)).product();
        if pixels > MAX_PIXELS {
            self.fault(format!("`size` makes {pixels} pixels: {MAX_PIXELS} are the most"), node.span_of("size"));
        }
        let most = render.samples.saturating_mul(render.line_oversampling);
        if most > MAX_SAMPLES {
            let message =
                format!("`samples` times `line_oversampling` are {most} samples per pixel: {MAX_SAMPLES} are the most");
            let span = ["line_oversampling", "samples"].iter().find_map(|key| node.get(key)).unwrap_or(node);
            self.fault(message, span.span.clone());
        }
        if render.strata.is_some_and(|strata| strata != 1) {
            let warning = Diagnostic::warning("strata are not built yet: `strata` is ignored");
            self.faults.push(warning.at(node.key_span("strata")));
        }
        let background = match &render.background {
            format::Background::Transparent(_) => Background::Transparent,
            format::Background::Color(color) => Background::Color(rgb(*color)),
            format::Background::Gradient(format::Gradient { bottom, top }) => {
                Background::Gradient { bottom: rgb(*bottom), top: rgb(*top) }
            }
            format::Background::Image(image) => self.background_image(image, node),
        };
        self.scene.render = RenderSettings {
            size: render.size,
            samples: render.samples,
            line_oversampling: render.line_oversampling,
            sampler: match render.sampler {
                format::Sampler::Stratified => Sampler::Stratified,
                format::Sampler::Sobol => Sampler::Sobol,
                format::Sampler::BlueNoise => Sampler::BlueNoise,
            },
            seed: render.seed,
            background,
            ambient: match render.ambient {
                format::Ambient::Gray(level) => Vec3::splat(level as f32),
                format::Ambient::Color(color) => rgb(color),
            },
            filter: match render.filter {
                format::Filter::Box => FilterKind::Box,
                format::Filter::Tent => FilterKind::Tent,
                format::Filter::Gaussian => FilterKind::Gaussian,
                format::Filter::Mitchell => FilterKind::Mitchell,
                format::Filter::BlackmanHarris => FilterKind::BlackmanHarris,
            },
            filter_radius: render.filter_radius as f32,
            reflection_depth: render.reflection_depth,
            refraction_depth: render.refraction_depth,
        };
    }

    fn background_image(&mut self, background: &format::BackgroundImage, render: &Node) -> Background {
        let span = render.get("background").unwrap_or(render).span_of("image");
        let path = self.path(&background.image, &span);
        let Some(image) = self.image(&path, true, &span) else { return Background::Transparent };
        let texture = self.scene.add_texture(Texture {
            name: background.image.clone(),
            image,
            wrap: [Wrap::Repeat, Wrap::Clamp],
            filter: TextureFilter::Linear,
            levels: std::sync::OnceLock::new(),
        });
        Background::Image { texture, strength: background.strength as f32 }
    }

    pub(super) fn lines(&mut self, lines: &format::Lines) {
        let node = self.part("lines");
        self.check_angle(lines.normal, "lines.normal", node);
        if lines.max_width == 0.0 {
            if lines.width > 0.0 {
                let warning = Diagnostic::warning("no lines are drawn: `max_width` is 0");
                self.faults.push(warning.at(node.span_of("max_width")));
            }
        } else if lines.min_width > lines.max_width {
            let message = format!("`min_width` is {} and `max_width` only {}", lines.min_width, lines.max_width);
            self.fault(message, node.span_of("min_width"));
        }
        if lines.width > lines.max_width && lines.max_width > 0.0 {
            let message = format!("lines are drawn {} pixels wide, as `max_width` says", lines.max_width);
            let warning = Diagnostic::warning(message).at(node.span_of("width"));
            self.faults.push(warning.hint(format!("set `max_width = {}`, too", lines.width)));
        }
        let types = self.line_types(lines, node);
        let has_lists = lines.surfaces > 1 || (node.mentions("surfaces") && node.get("surfaces").is_none());
        if lines.hidden.is_some() && !has_lists {
            let fault = Diagnostic::error("hidden lines need surface lists: `lines.surfaces` is 1");
            let hint = "set `surfaces = 4` in [lines], or more where more lies behind each other";
            self.faults.push(fault.at(node.key_span("hidden")).hint(hint));
        }
        if let Some(hidden) = lines.hidden.as_ref().filter(|hidden| hidden.width > lines.max_width) {
            let message = format!("hidden lines are drawn {} pixels wide, as `max_width` says", lines.max_width);
            let warning = Diagnostic::warning(message).at(node.get("hidden").unwrap_or(node).span_of("width"));
            self.faults.push(warning.hint(format!("set `max_width = {}` in [lines], too", hidden.width)));
        }
        let paths = lines.paths.iter().map(|path| match path {
            format::LinePath::Camera => RayKinds::CAMERA,
            format::LinePath::Reflection => RayKinds::REFLECTION,
            format::LinePath::Refraction => RayKinds::REFRACTION,
        });
        self.scene.lines = LineSettings {
            enabled: true,
            color: rgb(lines.color),
            width: lines.width as f32,
            max_width: lines.max_width as f32,
            min_width: lines.min_width as f32,
            width_compensation: lines.width_compensation,
            object: lines.object,
            shader: lines.shader,
            uv: threshold(lines.uv),
            normal: threshold(lines.normal),
            feature: threshold(lines.feature),
            overlap: threshold(lines.overlap),
            paths: paths.fold(RayKinds::empty(), RayKinds::union),
            tint: lines.tint,
            compose: match lines.compose {
                format::Compose::Replace => Composition::Replace,
                format::Compose::Throughput => Composition::Throughput,
            },
            types,
            surfaces: lines.surfaces,
            hidden: lines.hidden.as_ref().map(|hidden| HiddenLines {
                color: rgb(hidden.color),
                width: hidden.width as f32,
                objects: None,
            }),
        };
    }

    /// Finds the objects whose hidden lines are drawn. The objects must be there.
    pub(super) fn hidden_objects(&mut self, file: &format::SceneFile) {
        let Some(names) = file.lines.hidden.as_ref().and_then(|hidden| hidden.objects.as_ref()) else { return };
        let listed = self.part("lines").get("hidden").and_then(|hidden| hidden.get("objects"));
        let mut objects = BTreeSet::new();
        for (name, node) in names.iter().zip(listed.map_or(&[][..], Node::items)) {
            let part = format!("{name}/");
            let placed = self.scene.objects.iter().enumerate();
            let found: Vec<_> = placed
                .filter(|(_, object)| object.name == *name || object.name.starts_with(&part))
                .map(|(index, _)| ObjectId::from_index(index))
                .collect();
            // An object that could not be made was reported where it stands.
            let written = file.objects.iter().filter_map(|object| object.name.as_deref());
            let lost = self.node.mentions("objects") && self.node.get("objects").is_none();
            if found.is_empty() && !lost && !written.clone().any(|known| known == name) {
                let known: BTreeSet<&str> =
                    self.scene.objects.iter().map(|object| object.name.as_str()).chain(written).collect();
                self.faults.push(unknown_name("object", name, known.iter().copied()).at(node.span.clone()));
            }
            objects.extend(found);
        }
        if let Some(hidden) = &mut self.scene.lines.hidden {
            hidden.objects = Some(objects.into_iter().collect());
        }
    }

    /// In the order of [`LineType::ALL`].
    fn line_types(&mut self, lines: &format::Lines, node: &Node) -> [TypeStyle; LineType::ALL.len()] {
        let types = &lines.types;
        LineType::ALL.map(|kind| {
            let style = match kind {
                LineType::Outline => &types.outline,
                LineType::Silhouette => &types.silhouette,
                LineType::Overlap => &types.overlap,
                LineType::Material => &types.material,
                LineType::Crease => &types.crease,
                LineType::Uv => &types.uv,
                LineType::Feature => &types.feature,
            };
            if style.width.is_some_and(|width| width > lines.max_width) {
                let at = node.get("types").and_then(|types| types.get(kind.name())).unwrap_or(node);
                let message = format!("lines are drawn {} pixels wide, as `max_width` says", lines.max_width);
                self.faults.push(Diagnostic::warning(message).at(at.span_of("width")));
            }
            TypeStyle {
                color: style.color.map(rgb),
                width: style.width.map(|width| width as f32),
                opacity: style.opacity.map(|opacity| opacity as f32),
            }
        })
    }

    /// What a material changes about the line tests; `path` names it in messages.
    pub(super) fn line_overrides(&mut self, lines: &format::MaterialLines, path: &str, node: &Node) -> LineOverrides {
        if let Some(normal) = lines.normal {
            self.check_angle(normal, &format!("{path}.normal"), node);
        }
        LineOverrides {
            object: lines.object,
            shader: lines.shader,
            uv: lines.uv.map(threshold),
            normal: lines.normal.map(threshold),
            feature: lines.feature.map(threshold),
            overlap: lines.overlap.map(threshold),
        }
    }

    fn check_angle(&mut self, normal: format::Threshold, path: &str, node: &Node) {
        if let format::Threshold::Above(degrees) = normal
            && degrees > 180.0
        {
            let message = format!("`{path}` is an angle of at most 180 degrees, found {degrees}");
            self.fault(message, node.span_of("normal"));
        }
    }
}

fn threshold(threshold: format::Threshold) -> Option<f32> {
    match threshold {
        format::Threshold::Off(_) => None,
        format::Threshold::Above(value) => Some(value as f32),
    }
}
