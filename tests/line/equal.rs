//! The search against the oracle, on random samples.

use proptest::prelude::*;
use tusche::line::{LineBuffer, LineScript, Method, Rules, SeenLine};
use tusche::math::Vec3;
use tusche::sample::{HandMadeSample, Node, NodePath, PixelRect, SampleBuffer, SampleColor};
use tusche::scene::ids::ObjectId;
use tusche::scene::settings::{Composition, HiddenLines, LineOverrides, LineSettings, LineType, RayKinds, TypeStyle};

use super::picture::{Tiles, layout};

/// A sample with its nodes.
#[derive(Clone, Debug)]
struct Sample {
    offset: [f32; 2],
    color: [f32; 3],
    nodes: Vec<(NodePath, Node)>,
    behind: Vec<(NodePath, Node)>,
}

#[derive(Clone)]
struct Case {
    rect: PixelRect,
    samples_per_pixel: u32,
    tiles: [i32; 2],
    settings: LineSettings,
    overrides: Vec<LineOverrides>,
    /// Materials whose lines a script styles.
    scripts: Vec<LineScript>,
    samples: Vec<Sample>,
}

fn few<T: Clone + std::fmt::Debug + 'static>(values: impl Into<Vec<T>>) -> impl Strategy<Value = T> + Clone {
    proptest::sample::select(values.into())
}

fn node() -> impl Strategy<Value = Node> {
    let normals = [[0.0, 0.0, 1.0], [0.0, 0.0, -1.0], [0.6, 0.0, 0.8], [0.6, 0.0, 0.800_000_1], [1.0, 2.0, -3.0]];
    let unit = || few([0.0, 0.25, 0.5, 0.500_000_06, 1.0]);
    (
        (0..3u32, 1..3u32, [unit(), unit()], few(normals), [unit(), unit(), unit()]),
        // Equal depths must be common: they are what ties are about.
        prop_oneof![3 => few([1.0, 2.0, 3.0]), 1 => 1.0..3.0f32],
        (
            few([0.0, -1.0, 0.1, 0.5, 1.0, 2.5, 4.0, 1e9, f32::NAN]),
            few([1.0, 1.0, 1.0, 1.0, 0.5, 0.25, 0.0, f32::NAN, 7.0, -1.0]),
        ),
        few([0, 0, 0, 1, -1, i32::MIN, i32::MAX]),
        ([unit(), unit(), unit()], [unit(), unit(), unit()], [unit(), unit(), unit()]),
        facet(),
    )
        .prop_map(
            |((object, shader, uv, normal, feature), depth, (line_width, line_opacity), priority, colors, facet)| {
                Node {
                    object,
                    // Whoever reads it must not compare it.
                    member: 7,
                    position: facet.0,
                    geometric_normal: facet.1,
                    footprint: facet.2,
                    shader,
                    uv,
                    normal,
                    feature,
                    depth,
                    line_color: colors.0,
                    line_width,
                    line_opacity,
                    priority,
                    throughput: colors.1,
                    contribution: colors.2,
                }
            },
        )
}

/// Positions, normals and footprints of which many pairs overlap by a little more or less than thresholds.
fn facet() -> impl Strategy<Value = ([f32; 3], [f32; 3], f32)> + Clone {
    let coordinate = || prop_oneof![few([0.0, 1.0, 2.0, -1.0, 3.0]), -3.0..3.0f32];
    let normals = [[0.0, 0.0, 1.0], [0.6, 0.0, 0.8], [0.0, -0.6, 0.8], [0.1, 0.2, 0.9], [1.0, 0.0, 0.0]];
    ([coordinate(), coordinate(), coordinate()], few(normals), few([0.5, 1.0, 1.0, 0.25, 0.0]))
}

/// Random pixels as a renderer makes them: mostly one of a few nodes, so that some blocks are uniform.
fn sample() -> impl Strategy<Value = Sample> {
    let camera = NodePath::CAMERA;
    let deeper = [camera.reflected(), camera.refracted(), camera.reflected().refracted()];
    (
        [prop_oneof![few([0.0, 0.5, 1.0]), 0.0..1.0f32], prop_oneof![few([0.0, 0.5, 1.0]), 0.0..1.0f32]],
        [0.0..1.0f32, 0.0..1.0f32, 0.0..1.0f32],
        node(),
        proptest::collection::btree_map(few(deeper), node(), 0..3),
        // Up to four behind each, now and then more than a list can hold.
        proptest::collection::vec((few([camera, camera, deeper[0], deeper[1], deeper[2]]), node()), 0..6),
    )
        .prop_map(move |(offset, color, first, deeper, behind)| Sample {
            offset,
            color,
            nodes: [(camera, first)].into_iter().chain(deeper).collect(),
            behind,
        })
}

/// Of no, all, or some objects; the settings of a scene have them only beside lists, but nothing breaks without.
fn hidden() -> impl Strategy<Value = Option<HiddenLines>> {
    let objects = few([None, Some(vec![]), Some(vec![ObjectId(0)]), Some(vec![ObjectId(0), ObjectId(1)])]);
    let style = (few([0.0, 0.1, 1.0, 4.0]), objects);
    let style = style.prop_map(|(width, objects)| HiddenLines { color: Vec3::new(0.5, 0.0, 1.0), width, objects });
    proptest::option::of(style)
}

fn settings() -> impl Strategy<Value = LineSettings> {
    let threshold = |values: &[f32]| few(values.iter().map(|&t| Some(t)).chain([None]).collect::<Vec<_>>());
    (
        (any::<bool>(), any::<bool>(), threshold(&[0.0, 0.25, 0.4]), threshold(&[0.0, 1.0, 90.0, 179.9, 180.0])),
        (threshold(&[0.0, 0.25, 0.3]), few([0.0, 0.5, 1.0]), any::<bool>(), few([1.0, 3.0, 5.0, 20.0])),
        (any::<bool>(), any::<bool>(), 0..8u8, few([1, 1, 2, 3, 4]), hidden(), threshold(&[0.0, 0.5, 1.0, 2.0])),
        types(),
    )
        .prop_map(
            |((object, shader, uv, normal), (feature, min_width, width_compensation, max_width), rest, types)| {
                LineSettings {
                    object,
                    shader,
                    uv,
                    normal,
                    feature,
                    overlap: rest.5,
                    min_width,
                    width_compensation,
                    max_width,
                    tint: rest.0,
                    compose: if rest.1 { Composition::Replace } else { Composition::Throughput },
                    // Mostly all: 3 of 8 leave kinds out.
                    paths: if rest.2 < 3 { RayKinds::from_bits_truncate(rest.2 + 1) } else { RayKinds::all() },
                    enabled: true,
                    color: Vec3::ZERO,
                    width: 2.0,
                    types,
                    surfaces: rest.3,
                    hidden: rest.4,
                }
            },
        )
}

/// What types change: mostly nothing.
fn types() -> impl Strategy<Value = [TypeStyle; LineType::ALL.len()]> {
    let one = (
        few([None, None, None, Some(0.0), Some(0.3), Some(1.5), Some(4.0), Some(1e9)]),
        few([None, None, Some(0.0), Some(0.5), Some(1.0)]),
        few([None, None, Some(Vec3::new(0.25, 0.5, 1.0))]),
    );
    let one = one.prop_map(|(width, opacity, color)| TypeStyle { color, width, opacity });
    let all = proptest::collection::vec(one, LineType::ALL.len());
    let all = all.prop_map(|all| std::array::from_fn(|index| all[index]));
    prop_oneof![2 => Just([TypeStyle::default(); LineType::ALL.len()]), 1 => all]
}

/// What materials change, for fewer or more materials than there are.
fn overrides() -> impl Strategy<Value = Vec<LineOverrides>> {
    fn some<T: Clone + std::fmt::Debug + 'static>(values: Vec<T>) -> impl Strategy<Value = Option<T>> {
        prop_oneof![2 => Just(None), 1 => few(values).prop_map(Some)]
    }
    let on = || some(vec![false, true]);
    let one = (
        on(),
        on(),
        some(vec![None, Some(0.0), Some(0.3)]),
        some(vec![None, Some(0.0), Some(30.0), Some(180.0)]),
        some(vec![None, Some(0.0), Some(0.2)]),
        some(vec![None, Some(0.25), Some(1.5)]),
    );
    let one = one.prop_map(|(object, shader, uv, normal, feature, overlap)| LineOverrides {
        object,
        shader,
        uv,
        normal,
        feature,
        overlap,
    });
    prop_oneof![1 => Just(Vec::new()), 2 => proptest::collection::vec(one, 0..4)]
}

fn case() -> impl Strategy<Value = Case> {
    ((-20..20i32, -20..20i32, 1..14i32, 1..14i32), 1..9u32, [1..16i32, 1..16i32], settings(), overrides())
        .prop_flat_map(|((x0, y0, width, height), samples_per_pixel, tiles, settings, overrides)| {
            let rect = PixelRect { x0, y0, x1: x0 + width, y1: y0 + height };
            let count = rect.pixels() * samples_per_pixel as usize;
            // A palette of samples, and which pixels take which: runs of equal ones make uniform blocks.
            let palette = proptest::collection::vec(sample(), 1..8);
            let choice = proptest::collection::vec((0..8usize, 1..40usize), count.min(60));
            let offsets = proptest::collection::vec([0.0..1.0f32, 0.0..1.0f32], count);
            let (none, color, opacity) = (LineScript::None, LineScript::Color, LineScript::Opacity);
            let scripts =
                few([vec![], vec![], vec![opacity], vec![none, color], vec![opacity, color], vec![opacity, opacity]]);
            (palette, choice, offsets, any::<bool>(), scripts).prop_map(
                move |(palette, choice, offsets, jitter, scripts)| {
                    let runs = choice.iter().flat_map(|&(entry, length)| std::iter::repeat_n(entry, length)).cycle();
                    let samples = runs
                        .zip(&offsets)
                        .map(|(entry, &offset)| {
                            let sample = palette[entry % palette.len()].clone();
                            if jitter { Sample { offset, ..sample } } else { sample }
                        })
                        .collect();
                    let (settings, overrides) = (settings.clone(), overrides.clone());
                    Case { rect, samples_per_pixel, tiles, settings, overrides, scripts, samples }
                },
            )
        })
}

/// In few words: proptest prints a case as often as it shrinks.
impl std::fmt::Debug for Case {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let Self { rect, samples_per_pixel, tiles, settings, overrides, scripts, samples } = self;
        writeln!(
            f,
            "{rect:?}, {samples_per_pixel} samples, tiles of {tiles:?}\n{settings:?}\n{overrides:?}\nscripts: {scripts:?}"
        )?;
        samples.iter().try_for_each(|sample| writeln!(f, "{sample:?}"))
    }
}

impl Case {
    fn rules(&self) -> Rules {
        let rules = Rules::new(&self.settings, self.samples_per_pixel);
        rules.with_materials(&self.overrides).with_scripts(&self.scripts)
    }

    fn cut(&self, side: i32, rules: Rules) -> Tiles {
        Tiles::new(self.rect, side, &rules, |tile| self.buffer(tile))
    }

    fn buffer(&self, tile: PixelRect) -> SampleBuffer {
        let mut samples = Vec::new();
        for y in tile.y0..tile.y1 {
            for x in tile.x0..tile.x1 {
                let pixel = (y - self.rect.y0) as usize * self.rect.width() as usize + (x - self.rect.x0) as usize;
                let first = pixel * self.samples_per_pixel as usize;
                samples.extend(self.samples[first..first + self.samples_per_pixel as usize].iter().map(|sample| {
                    let color = SampleColor { color: sample.color, alpha: 1.0 };
                    HandMadeSample { offset: sample.offset, color, nodes: &sample.nodes, behind: &sample.behind }
                }));
            }
        }
        SampleBuffer::from_samples(tile, &layout(self.samples_per_pixel, self.settings.max_width), &samples)
    }

    /// All lines of the picture with the pixel and number of their samples, however it was cut.
    fn by_place(&self, lines: &[LineBuffer]) -> Vec<([i32; 2], u32, Bits)> {
        let mut all: Vec<_> = lines
            .iter()
            .flat_map(|lines| {
                assert!(lines.samples.is_sorted());
                lines.samples.iter().zip(&lines.lines).map(|(sample, line)| {
                    let pixel = sample / self.samples_per_pixel;
                    let (x, y) = (pixel % lines.rect.width(), pixel / lines.rect.width());
                    let pixel = [lines.rect.y0 + y as i32, lines.rect.x0 + x as i32];
                    (pixel, sample % self.samples_per_pixel, bits(line))
                })
            })
            .collect();
        all.sort();
        all
    }
}

/// A line as numbers that compare bit by bit.
type Bits = (Vec<u32>, String);

fn bits(line: &SeenLine) -> Bits {
    let floats = line.color.iter().chain(&line.lined).chain([&line.alpha]).map(|x| x.to_bits()).collect();
    (floats, format!("{}/{} {:?} {:?} {}", line.path, line.hidden, line.fired, line.neighbor, line.own))
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 400, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn the_search_is_the_oracle_and_tiles_do_not_matter(case in case()) {
        let whole = case.cut(64, case.rules());
        let expected = case.by_place(&whole.lines(Method::Brute));
        prop_assert_eq!(&case.by_place(&whole.lines(Method::Exact)), &expected, "search, one tile");
        for side in case.tiles {
            let cut = case.cut(side, case.rules());
            prop_assert_eq!(&case.by_place(&cut.lines(Method::Brute)), &expected, "brute, tiles of {}", side);
            prop_assert_eq!(&case.by_place(&cut.lines(Method::Exact)), &expected, "search, tiles of {}", side);
        }
    }

    #[test]
    fn any_pair_looks_like_the_one_that_is_seen(case in case()) {
        let looks = |tiles: Tiles, method: Method| -> Vec<_> {
            let lines = case.by_place(&tiles.lines(method)).into_iter();
            lines.map(|(pixel, sample, (floats, text))| {
                (pixel, sample, floats, text.split(' ').next().map(str::to_owned))
            }).collect()
        };
        let expected = looks(case.cut(64, case.rules()), Method::Brute);
        for side in [64].into_iter().chain(case.tiles) {
            let rules = case.rules().with_any_pair();
            prop_assert_eq!(&looks(case.cut(side, rules), Method::Exact), &expected, "tiles of {}", side);
        }
    }
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 24, failure_persistence: None, ..ProptestConfig::default() })]

    /// Few random neighbours line some of the samples that all do, whatever the tiles; so many that each is met draw the same.
    #[test]
    fn the_path_method_is_the_oracle_with_some_of_the_neighbors(mut case in case()) {
        (case.settings.surfaces, case.settings.hidden) = (1, None);
        let whole = case.cut(64, case.rules());
        let expected = case.by_place(&whole.lines(Method::Brute));
        let every = 25 * case.samples.len() as u32;
        prop_assert_eq!(&case.by_place(&whole.lines(Method::Path { probes: every })), &expected);

        let few = case.by_place(&whole.lines(Method::Path { probes: 3 }));
        let places = |lines: &[([i32; 2], u32, Bits)]| -> std::collections::BTreeSet<_> {
            lines.iter().map(|(pixel, sample, _)| (*pixel, *sample)).collect()
        };
        prop_assert!(places(&few).is_subset(&places(&expected)));
        for side in case.tiles {
            let cut = case.cut(side, case.rules());
            prop_assert_eq!(&case.by_place(&cut.lines(Method::Path { probes: 3 })), &few, "tiles of {}", side);
        }
    }
}
