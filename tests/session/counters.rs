//! Counters prove what is not done again.

use std::sync::{Arc, OnceLock};

use tusche::film::Layer;
use tusche::live::{Event, Kept, LivePicture, Session, SessionOptions, Setup};
use tusche::render::RenderOptions;
use tusche::scene::settings::Background;
use tusche::scene::texture::{Image, Pixels, Texture, TextureFilter, Wrap};
use tusche::shade::{Host, Shaders};

use super::Sources;
use crate::common::render_with;

const SCENE: &str = r#"
[render]
size = [96, 64]
samples = 2
[camera]
position = [0.0, 1.5, 4.0]
target = [0.0, 0.5, 0.0]
fov = 40.0
[lines]
width = 2.0
normal = 40.0
[materials.paint]
shader = "paint.rhai"
params = { ink = 2.0 }
[materials.ground]
shader = "ground.rhai"
[[objects]]
shape = "box"
size = [5.0, 0.2, 5.0]
material = "ground"
translate = [0.0, -0.1, 0.0]
[[objects]]
shape = "sphere"
radius = 0.5
material = "paint"
translate = [0.0, 0.5, 0.0]
[[lights]]
kind = "sun"
direction = [-0.5, -0.8, -0.4]
"#;
const PAINT: &str = "fn params() { #{ ink: 1.0 } }
fn surface(hit, p) { #{ base_color: rgb(0.8, 0.2, 0.1) * hit.normal.y, line_width: p.ink * hit.uv.x } }";
const GROUND: &str = "fn surface(hit, p) { #{ base_color: rgb(0.5, 0.5, 0.5), roughness: 0.0, metallic: 0.5 } }";

struct Desk {
    session: Session,
    sources: Sources,
}

impl Desk {
    fn new() -> Self {
        let options = SessionOptions { tile: 16, progressive: false, ..SessionOptions::default() };
        let session = Session::new(options).unwrap_or_else(|fault| panic!("{fault}"));
        let scripts = [("paint.rhai", PAINT), ("ground.rhai", GROUND)];
        let scripts = scripts.map(|(name, text)| (name.to_owned(), text.to_owned())).to_vec();
        let mut desk = Self { session, sources: Sources { scene: SCENE.to_owned(), scripts } };
        let first = desk.save();
        assert_eq!(first.redone.traced, first.redone.tiles);
        desk
    }

    fn save(&mut self) -> Arc<LivePicture> {
        self.session.set_scene(self.sources.setup(&[Layer::Rgba]));
        self.session.render().unwrap_or_else(|faults| panic!("{faults}"))
    }

    /// Compares a picture with a fresh one, to the bit.
    #[track_caller]
    fn is_fresh(&self, live: &LivePicture) {
        let (fresh, _) = render_with(&self.sources.scene(), &[Layer::Rgba], &RenderOptions::default());
        assert!(live.channels == fresh.channels, "{:?}", live.redone);
    }

    fn replace(&mut self, old: &str, new: &str) -> Arc<LivePicture> {
        let texts = self.sources.scripts.iter_mut().map(|(_, text)| text).chain([&mut self.sources.scene]);
        let mut found = 0;
        for text in texts {
            found += text.matches(old).count();
            *text = text.replace(old, new);
        }
        assert_eq!(found, 1, "`{old}` stands {found} times in the sources");
        self.save()
    }
}

fn rays(picture: &LivePicture) -> u64 {
    let rays = picture.stats.rays;
    rays.camera + rays.shadow + rays.reflection + rays.refraction
}

#[test]
fn an_edit_that_means_nothing_does_nothing() {
    let mut desk = Desk::new();
    let again =
        desk.replace("fn surface(hit, p) { #{ base_color: rgb(0.5", "fn surface(hit, p) {\n #{ base_color: rgb(0.5");
    assert_eq!((rays(&again), again.redone.lined, again.redone.developed), (0, 0, 0), "{:?}", again.redone);
    assert_eq!((again.redone.shaded, again.changed.pixels()), (0, 0), "{:?}", again.redone);
}

#[test]
fn a_line_setting_runs_the_line_pass_and_the_film_alone() {
    let mut desk = Desk::new();
    let wider = desk.replace("normal = 40.0", "normal = 40.0\nmin_width = 1.0");
    assert_eq!(rays(&wider), 0);
    assert_eq!((wider.redone.traced, wider.redone.shaded, wider.redone.restyled), (0, 0, 0));
    assert!(wider.redone.materials.is_empty());
    assert_eq!(wider.redone.lined, wider.redone.tiles);
    assert!(wider.redone.developed > 0 && wider.redone.developed < wider.redone.tiles, "{:?}", wider.redone);
}

#[test]
fn tint_runs_the_line_pass_and_the_film_alone() {
    let mut desk = Desk::new();
    desk.replace("normal = 40.0", "normal = 40.0\ncolor = [0.9, 0.3, 0.1]");
    for (old, new) in [("normal = 40.0", "normal = 40.0\ntint = false"), ("tint = false", "tint = true")] {
        let tinted = desk.replace(old, new);
        let redone = &tinted.redone;
        assert_eq!((rays(&tinted), redone.shaded, redone.restyled), (0, 0, 0), "{redone:?}");
        // Only where lines are seen in the mirror.
        assert!(redone.lined > 0 && redone.lined < redone.tiles / 2 && redone.developed > 0, "{redone:?}");
        desk.is_fresh(&tinted);
    }
}

#[test]
fn a_threshold_concerns_the_tiles_where_pairs_lie_between() {
    let mut desk = Desk::new();
    desk.replace("normal = 40.0", "normal = 15.0");
    // The ball bends less than that within a line's reach, whether seen itself or in the mirror.
    let fewer = desk.replace("normal = 15.0", "normal = 100.0");
    assert_eq!((rays(&fewer), fewer.redone.shaded, fewer.redone.restyled), (0, 0, 0), "{:?}", fewer.redone);
    assert!(fewer.redone.lined > 0 && fewer.redone.lined < fewer.redone.tiles / 2, "{:?}", fewer.redone);
    assert!(fewer.changed.pixels() > 0);
    desk.is_fresh(&fewer);
    // Nothing bends more.
    let same = desk.replace("normal = 100.0", "normal = 120.0");
    assert_eq!((rays(&same), same.redone.lined, same.redone.developed), (0, 0, 0), "{:?}", same.redone);
    let more = desk.replace("normal = 120.0", "normal = 15.0");
    assert!(more.redone.lined == fewer.redone.lined && more.changed == fewer.changed, "{:?}", more.redone);
    desk.is_fresh(&more);
}

#[test]
fn turning_a_test_off_and_on_shades_nothing() {
    let mut desk = Desk::new();
    for (old, new) in [("normal = 40.0", "normal = false"), ("normal = false", "normal = 40.0")] {
        let turned = desk.replace(old, new);
        let redone = &turned.redone;
        assert_eq!((rays(&turned), redone.shaded, redone.restyled), (0, 0, 0), "{redone:?}");
        desk.is_fresh(&turned);
    }
}

#[test]
fn turning_the_object_test_off_concerns_the_borders_of_objects() {
    let mut desk = Desk::new();
    desk.replace("normal = 40.0", "normal = 40.0\nobject = true");
    let without = desk.replace("object = true", "object = false");
    assert_eq!((rays(&without), without.redone.shaded), (0, 0), "{:?}", without.redone);
    assert!(without.redone.lined > 0 && without.redone.lined < without.redone.tiles, "{:?}", without.redone);
    desk.is_fresh(&without);
}

#[test]
fn the_line_width_of_a_script_runs_its_line_slice_alone() {
    let mut desk = Desk::new();
    let wider = desk.replace("line_width: p.ink * hit.uv.x", "line_width: p.ink * hit.uv.y");
    assert_eq!(rays(&wider), 0);
    assert_eq!((wider.redone.traced, wider.redone.shaded), (0, 0), "{:?}", wider.redone);
    assert_eq!(wider.redone.materials, ["paint"]);
    assert!(wider.redone.restyled > 0 && wider.redone.restyled < wider.redone.tiles, "{:?}", wider.redone);
    assert!(wider.redone.lined < wider.redone.tiles, "{:?}", wider.redone);
    // A parameter that only lines read is the same to it.
    let thinner = desk.replace("ink = 2.0", "ink = 1.5");
    assert_eq!((rays(&thinner), thinner.redone.shaded), (0, 0), "{:?}", thinner.redone);
    assert_eq!(thinner.redone.materials, ["paint"]);
}

#[test]
fn a_colour_is_shaded_with_rays_that_are_known() {
    let mut desk = Desk::new();
    let bluer = desk.replace("rgb(0.8, 0.2, 0.1)", "rgb(0.1, 0.2, 0.8)");
    assert_eq!(rays(&bluer), 0);
    assert_eq!((bluer.redone.traced, bluer.redone.restyled), (0, 0));
    assert!(bluer.redone.shaded > 0 && bluer.redone.shaded < bluer.redone.tiles, "{:?}", bluer.redone);
    assert!(bluer.redone.lined < bluer.redone.tiles, "{:?}", bluer.redone);
}

#[test]
fn lists_of_surfaces_are_restyled_and_shaded_with_rays_that_are_known() {
    let mut desk = Desk::new();
    let first = desk.replace("normal = 40.0", "normal = 40.0\nsurfaces = 2");
    assert!(first.redone.traced == first.redone.tiles && first.stats.lines.surfaces_behind > 0, "{:?}", first.redone);
    let wider = desk.replace("line_width: p.ink * hit.uv.x", "line_width: p.ink * hit.uv.y");
    assert_eq!((rays(&wider), wider.redone.shaded), (0, 0), "{:?}", wider.redone);
    assert!(wider.redone.restyled > 0, "{:?}", wider.redone);
    let wider = desk.replace("normal = 40.0", "normal = 40.0\nmin_width = 1.0");
    assert_eq!(rays(&wider), 0, "a line setting costs no rays: {:?}", wider.redone);
    let bluer = desk.replace("rgb(0.8, 0.2, 0.1)", "rgb(0.1, 0.2, 0.8)");
    assert_eq!((rays(&bluer), bluer.redone.traced), (0, 0), "{:?}", bluer.redone);
    desk.is_fresh(&bluer);
}

#[test]
fn what_glass_shows_is_shaded_with_rays_that_are_known() {
    let mut desk = Desk::new();
    let glass = desk.replace("base_color: rgb(0.8, 0.2, 0.1) * hit.normal.y", "transmission: 1.0, roughness: 0.0");
    assert!(glass.stats.rays.refraction > 0);
    let lighter = desk.replace("rgb(0.5, 0.5, 0.5)", "rgb(0.7, 0.5, 0.5)");
    // But for a few that meet an edge, where it depends on shaders which of two triangles is seen.
    let [few, all] = [&lighter, &glass].map(|picture| picture.stats.rays).map(|rays| rays.reflection + rays.refraction);
    assert!(lighter.stats.rays.camera == 0 && few * 10 < all, "{few} of {all}");
    assert_eq!(lighter.redone.traced, 0, "{:?}", lighter.redone);
    desk.is_fresh(&lighter);
    let wider = desk.replace("line_width: p.ink * hit.uv.x", "line_width: p.ink * hit.uv.y");
    assert_eq!((rays(&wider), wider.redone.shaded), (0, 0), "{:?}", wider.redone);
    desk.is_fresh(&wider);
}

#[test]
fn a_colour_under_lines_that_cover_it_leaves_the_lines_alone() {
    let mut desk = Desk::new();
    desk.replace("line_width: p.ink * hit.uv.x", "line_width: p.ink");
    let bluer = desk.replace("rgb(0.8, 0.2, 0.1)", "rgb(0.1, 0.2, 0.8)");
    assert!(bluer.redone.shaded > 0 && bluer.redone.lined == 0 && bluer.redone.developed > 0, "{:?}", bluer.redone);
    desk.is_fresh(&bluer);
    // Thinner than half a pixel, they let it through.
    desk.replace("line_width: p.ink", "line_width: 0.2");
    let redder = desk.replace("rgb(0.1, 0.2, 0.8)", "rgb(0.8, 0.2, 0.1)");
    assert!(redder.redone.lined > 0, "{:?}", redder.redone);
    desk.is_fresh(&redder);
}

#[test]
fn what_the_memory_limit_leaves_out_is_told() {
    let desk = Desk::new();
    let picture = |cache_bytes| {
        let options = SessionOptions { tile: 16, progressive: false, cache_bytes, ..SessionOptions::default() };
        let session = Session::new(options).unwrap_or_else(|fault| panic!("{fault}"));
        session.set_scene(desk.sources.setup(&[Layer::Rgba]));
        session.render().unwrap_or_else(|faults| panic!("{faults}"))
    };
    let all = picture(1 << 30);
    assert_eq!((all.cache.kept, all.cache.limit), (Kept::All, 1 << 30));
    assert!(all.cache.needed > 100_000, "{:?}", all.cache);
    let some = picture(all.cache.needed - 1);
    assert_eq!(some.cache.kept, Kept::Samples);
    assert!(some.cache.to_string().contains("what rays met is not kept"), "{}", some.cache);
    let none = picture(1000);
    assert_eq!(none.cache.kept, Kept::Nothing);
    assert!(none.cache.to_string().contains("every edit renders all of it again"), "{}", none.cache);
    assert!(some.channels == all.channels && none.channels == all.channels);
}

#[test]
fn a_moved_light_traces_shadow_rays_alone() {
    let mut desk = Desk::new();
    let lit = desk.replace("[-0.5, -0.8, -0.4]", "[0.5, -0.8, -0.4]");
    assert_eq!((lit.stats.rays.camera, lit.stats.rays.reflection), (0, 0));
    assert!(lit.stats.rays.shadow > 0);
    assert_eq!(lit.redone.traced, 0);
}

#[test]
fn a_moved_object_is_traced() {
    let mut desk = Desk::new();
    let moved = desk.replace("translate = [0.0, 0.5, 0.0]", "translate = [0.2, 0.5, 0.0]");
    assert_eq!(moved.redone.traced, moved.redone.tiles);
}

/// Found by random edits: what a surface of opacity 0 saw of the lights was taken for what the surface behind it sees.
#[test]
fn what_an_invisible_surface_sees_of_the_lights_is_its_own() {
    let mut desk = Desk::new();
    desk.replace("base_color: rgb(0.8, 0.2, 0.1) * hit.normal.y", "opacity: 0.0 * hit.uv.x");
    desk.replace("roughness: 0.0, metallic: 0.5", "color: rgb(0.1, 0.9, 0.5)");
    let lit = desk.replace("color: rgb(0.1, 0.9, 0.5)", "roughness: 1.0");
    desk.is_fresh(&lit);
}

#[test]
fn a_script_is_replaced_by_name_and_a_faulty_one_is_not() {
    let desk = Desk::new();
    let (generation, warnings) = desk
        .session
        .set_shader("paint.rhai", &PAINT.replace("hit.uv.x", "hit.uv.y"))
        .unwrap_or_else(|faults| panic!("{faults}"));
    assert_eq!((generation, warnings.0.len()), (2, 0));
    let picture = desk.session.render().unwrap_or_else(|faults| panic!("{faults}"));
    assert_eq!((picture.generation, picture.redone.traced), (2, 0));
    assert_eq!(picture.redone.materials, ["paint"]);
    let fault = desk
        .session
        .set_shader("paint.rhai", "fn params() { #{ ink: 1.0 } } fn surface(hit, p) { #{ line_widht: 1.0 } }")
        .unwrap_err();
    assert!(fault.to_string().contains("line_width"), "{fault}");
    let fault = desk.session.set_shader("pain.rhai", PAINT).unwrap_err();
    assert!(fault.to_string().contains("ground.rhai"), "{fault}");
    assert_eq!(desk.session.render().map(|picture| picture.generation).ok(), Some(2));
}

#[test]
fn subscribers_hear_complete_pictures_with_ever_more_samples() {
    let session =
        Session::new(SessionOptions { tile: 16, ..SessionOptions::default() }).unwrap_or_else(|f| panic!("{f}"));
    assert!(session.render().is_err(), "there is nothing to wait for");
    let events = session.subscribe();
    let scripts =
        [("paint.rhai", PAINT), ("ground.rhai", GROUND)].map(|(name, text)| (name.into(), text.into())).to_vec();
    let sources = Sources { scene: SCENE.replace("samples = 2", "samples = 5"), scripts };
    let generation = session.set_scene(sources.setup(&[Layer::Rgba]));
    session.render().unwrap_or_else(|faults| panic!("{faults}"));
    let shown = events.try_iter().filter_map(|event| match event {
        Event::Picture(picture) => Some((picture.generation, picture.samples, picture.is_final)),
        _ => None,
    });
    let shown: Vec<_> = shown.collect();
    assert_eq!(shown.first(), Some(&(generation, 1, false)));
    assert_eq!(shown.last(), Some(&(generation, 5, true)));
    // At least twice as many each time; how many more depends on how fast the machine is.
    assert!(shown.windows(2).all(|two| two[1].1 >= (2 * two[0].1).min(5)), "{shown:?}");
}

#[test]
fn another_image_behind_the_scene_is_seen() {
    let desk = Desk::new();
    let show = |color: [f32; 4]| {
        let mut builder = desk.sources.scene().into_builder();
        let image = Image { width: 1, height: 1, pixels: Pixels::Rgba32F { data: vec![color] } };
        let texture = builder.add_texture(Texture {
            name: "sky".into(),
            image: Arc::new(image),
            wrap: [Wrap::Repeat; 2],
            filter: TextureFilter::Linear,
            levels: OnceLock::new(),
        });
        builder.render.background = Background::Image { texture, strength: 1.0 };
        let scene = builder.build().unwrap_or_else(|faults| panic!("{faults}"));
        let (shaders, _) = Shaders::compile(&scene, &Host::new()).unwrap_or_else(|faults| panic!("{faults}"));
        desk.session.set_scene(Setup { scene, shaders, layers: vec![Layer::Rgba] });
        desk.session.render().unwrap_or_else(|faults| panic!("{faults}"))
    };
    let first = show([0.1, 0.2, 0.3, 1.0]);
    let same = show([0.1, 0.2, 0.3, 1.0]);
    let other = show([0.4, 0.2, 0.3, 1.0]);
    assert_eq!((same.redone.shaded, same.redone.developed), (0, 0), "{:?}", same.redone);
    assert!((first.channels[0][0] - 0.1).abs() < 1e-4 && (other.channels[0][0] - 0.4).abs() < 1e-4);
}
