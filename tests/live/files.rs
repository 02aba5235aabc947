//! Editors, and what else happens to files.

use std::fs;
use std::time::{Duration, Instant};

use tusche::live::News;

use super::{INK, SCENE, Watching, background, inked, is_near, options, paper, place, replace, with_background};

#[test]
fn a_file_that_is_written_in_place() {
    let place = place();
    let watching = Watching::start(options(&place));
    assert!(is_near(background(&watching.picture()), 0.25));
    for grey in [0.5, 0.75, 0.125] {
        place.file("scene.toml", with_background(grey));
        watching.picture_with("picture of the new scene", |picture| is_near(background(picture), grey));
    }
}

#[test]
fn a_file_that_is_replaced_by_renaming() {
    let place = place();
    let watching = Watching::start(options(&place));
    watching.picture();
    for grey in [0.5, 0.75, 0.125] {
        replace(&place.folder.path().join("scene.toml"), with_background(grey));
        watching.picture_with("picture of the new scene", |picture| is_near(background(picture), grey));
    }
}

#[test]
fn a_file_that_is_deleted_and_made_again() {
    let place = place();
    let watching = Watching::start(options(&place));
    watching.picture();
    for grey in [0.5, 0.75, 0.125] {
        let gone = Instant::now();
        fs::remove_file(place.folder.path().join("scene.toml")).expect("it is there");
        place.file("scene.toml", with_background(grey));
        let was_short = gone.elapsed() < Duration::from_millis(100);
        let (_, before) = watching.wait_and_see("picture of the new scene", |news| match news {
            News::Picture { picture, .. } => is_near(background(picture), grey).then_some(()),
            _ => None,
        });
        let faults = before.iter().any(|news| matches!(news, News::Faults(_)));
        assert!(!(was_short && faults), "a file that is gone for a moment is no fault: {before:#?}");
    }
}

#[test]
fn a_file_that_is_saved_all_the_time() {
    let place = place();
    let watching = Watching::start(options(&place));
    watching.picture();
    let end = Instant::now() + Duration::from_secs(5);
    let mut saves = 0;
    let mut pictures = 0;
    while Instant::now() < end {
        saves += 1;
        let grey = 0.3 + 0.001 * f32::from(saves % 100_u16);
        place.file("scene.toml", with_background(grey));
        std::thread::sleep(Duration::from_millis(10));
        pictures += watching.news.try_iter().filter(|news| matches!(news, News::Picture { .. })).count();
    }
    assert!(pictures > 0, "{saves} saves kept all pictures away");
    place.file("scene.toml", with_background(0.875));
    watching.picture_with("picture of the last save", |picture| is_near(background(picture), 0.875));
}

#[test]
fn a_file_that_cannot_be_read_for_a_while() {
    let place = place();
    let watching = Watching::start(options(&place));
    watching.picture();
    // The tests may run as a user who can read everything, but nobody can read a folder.
    let script = place.folder.path().join("ink.rhai");
    fs::remove_file(&script).expect("it is there");
    fs::create_dir(&script).expect("folders can be made");
    let faults = watching.faults();
    assert!(faults.contains("ink.rhai") && faults.contains("this is a folder, not a file"), "{faults}");
    fs::remove_dir(&script).expect("it is empty");
    place.file("ink.rhai", INK.replace("color: p.paper", "color: gray(0.625)"));
    watching.mended();
    watching.picture_with("picture of the new script", |picture| is_near(paper(picture), 0.625));
}

#[test]
fn a_file_that_is_not_there_yet() {
    let place = place();
    let script = place.folder.path().join("ink.rhai");
    fs::remove_file(&script).expect("it is there");
    // Not even its folder is.
    place.file("scene.toml", SCENE.replace("ink.rhai", "shaders/deep/ink.rhai"));
    let watching = Watching::start(options(&place));
    assert!(watching.faults().contains("no such file"));
    place.file("shaders/deep/ink.rhai", INK);
    watching.mended();
    assert!(is_near(paper(&watching.picture()), 0.7));
}

#[test]
fn a_scene_that_is_not_there_yet() {
    let place = place();
    fs::remove_file(place.folder.path().join("scene.toml")).expect("it is there");
    let watching = Watching::start(options(&place));
    assert!(watching.faults().contains("no such file"));
    place.file("scene.toml", SCENE);
    watching.mended();
    watching.picture();
}

#[test]
fn a_module_of_a_script() {
    let place = place();
    place.file("ink.rhai", "import \"lib/tones\" as t;\nfn surface(hit, p) { #{ color: t::tone() } }");
    place.file("lib/tones.rhai", "fn tone() { gray(0.5) }");
    place.file("scene.toml", SCENE.replace("params = { paper = [0.8, 0.7, 0.5] }\n", ""));
    let watching = Watching::start(options(&place));
    assert!(is_near(paper(&watching.picture()), 0.5));
    place.file("lib/tones.rhai", "fn tone() { gray(0.75) }");
    watching.picture_with("picture of the new module", |picture| is_near(paper(picture), 0.75));
}

#[test]
fn a_texture_that_is_replaced() {
    let png = |value: u8| {
        let mut bytes = Vec::new();
        let image = image::RgbImage::from_pixel(2, 2, image::Rgb([value; 3]));
        image.write_to(&mut std::io::Cursor::new(&mut bytes), image::ImageFormat::Png).expect("PNG can be written");
        bytes
    };
    let place = place();
    place.file(
        "ink.rhai",
        "fn params() { #{ paper: () } }\nfn surface(hit, p) { #{ color: texture(p.paper, hit.uv).rgb } }",
    );
    let params = "params = { paper = { file = \"paper.png\", color = \"linear\" } }";
    place.file("scene.toml", SCENE.replace("params = { paper = [0.8, 0.7, 0.5] }", params));
    place.file("paper.png", png(51));
    let watching = Watching::start(options(&place));
    let first = paper(&watching.picture());
    assert!(is_near(first, 0.2), "{first}");
    replace(&place.folder.path().join("paper.png"), png(204));
    watching.picture_with("picture of the new texture", |picture| is_near(paper(picture), 0.8));
}

#[test]
fn only_files_that_were_read_are_followed_and_only_contents_count() {
    let place = place();
    let watching = Watching::start(options(&place));
    let loaded = |news: &News| match news {
        News::Loaded { generation, files, folders } => Some((*generation, *files, *folders)),
        _ => None,
    };
    assert_eq!(watching.wait("load", loaded), (1, 2, 1));
    place.file("other.rhai", INK);
    place.file("ink.rhai", INK);
    replace(&place.folder.path().join("scene.toml"), SCENE);
    place.file("scene.toml", SCENE.replace("samples = 2", "samples = 3"));
    assert_eq!(watching.wait("load", loaded).0, 2);
    place.file("lib/tones.rhai", "fn tone() { gray(0.5) }");
    place.file("ink.rhai", INK.replace("fn surface", "import \"lib/tones\" as t;\nfn surface"));
    assert_eq!(watching.wait("load", loaded), (3, 3, 2));
    place.file("ink.rhai", INK);
    assert_eq!(watching.wait("load", loaded), (4, 2, 1));
}

#[test]
fn a_folder_that_is_replaced() {
    let place = place();
    place.file("scene.toml", SCENE.replace("ink.rhai", "shaders/ink.rhai"));
    place.file("shaders/ink.rhai", INK);
    let watching = Watching::start(options(&place));
    watching.picture();
    let (folder, old) = (place.folder.path().join("shaders"), place.folder.path().join("old"));
    fs::rename(&folder, old).expect("folders can be renamed");
    place.file("shaders/ink.rhai", INK.replace("color: p.paper", "color: gray(0.625)"));
    watching.picture_with("picture of the new folder", |picture| is_near(paper(picture), 0.625));
    place.file("shaders/ink.rhai", INK.replace("color: p.paper", "color: gray(0.375)"));
    watching.picture_with("picture of a file in it", |picture| is_near(paper(picture), 0.375));
}

#[cfg(unix)]
#[test]
fn a_file_behind_a_link() {
    let place = place();
    let script = place.folder.path().join("ink.rhai");
    fs::remove_file(&script).expect("it is there");
    let real = place.file("elsewhere/real.rhai", INK);
    std::os::unix::fs::symlink(&real, &script).expect("links can be made");
    let watching = Watching::start(options(&place));
    let first = inked(&watching.picture());
    fs::write(&real, INK.replace("ink_width: 2.0", "ink_width: 6.0")).expect("files can be written");
    watching.picture_with("picture with wider lines", |picture| inked(picture) > first);
}
