//! `tusche watch` as its users meet it.

use std::fs;
use std::io::{BufRead, BufReader};
use std::path::Path;
use std::process::{Child, Command, Stdio};
use std::sync::mpsc::{Receiver, channel};
use std::time::Instant;

use super::{INK, LIMIT, SCENE, place, replace, with_background};
use crate::common::Workplace;

/// A running command.
struct Running {
    child: Child,
    lines: Receiver<String>,
}

impl Running {
    fn start(place: &Workplace, arguments: &[&str]) -> Self {
        let mut child = Command::new(env!("CARGO_BIN_EXE_tusche"))
            .current_dir(place.folder.path())
            .args(arguments)
            .stderr(Stdio::piped())
            .spawn()
            .expect("the command can be run");
        let stderr = child.stderr.take().expect("it is piped");
        let (sender, lines) = channel();
        std::thread::spawn(move || {
            for line in BufReader::new(stderr).lines().map_while(Result::ok) {
                if sender.send(line).is_err() {
                    break;
                }
            }
        });
        Self { child, lines }
    }

    /// Waits for a line that holds a text.
    #[track_caller]
    fn says(&self, text: &str) -> String {
        let end = Instant::now() + LIMIT;
        let mut before = Vec::new();
        loop {
            match self.lines.recv_timeout(end.saturating_duration_since(Instant::now())) {
                Ok(line) if line.contains(text) => return line,
                Ok(line) => before.push(line),
                Err(_) => panic!("it did not say `{text}` but:\n{}", before.join("\n")),
            }
        }
    }

    #[cfg(unix)]
    #[track_caller]
    fn ends_cleanly(mut self) {
        let pid = self.child.id().to_string();
        let sent = Command::new("kill").args(["-INT", &pid]).status().expect("signals can be sent");
        assert!(sent.success());
        let end = Instant::now() + LIMIT;
        while Instant::now() < end {
            if let Some(status) = self.child.try_wait().expect("it can be asked") {
                assert_eq!(status.code(), Some(0));
                return;
            }
            std::thread::sleep(std::time::Duration::from_millis(20));
        }
        panic!("it did not end");
    }
}

impl Drop for Running {
    fn drop(&mut self) {
        // It may have ended already.
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}

fn modified(path: &Path) -> Option<std::time::SystemTime> {
    fs::metadata(path).ok()?.modified().ok()
}

#[cfg(unix)]
#[test]
fn it_writes_pictures_until_it_is_interrupted() {
    let place = place();
    let running = Running::start(&place, &["watch", "scene.toml", "-o", "out.png", "-o", "out.exr"]);
    assert!(running.says("the page: ").contains("http://127.0.0.1:"));
    running.says("picture of 2 samples per pixel");
    running.says("wrote out.");
    running.says("wrote out.");
    let png = place.folder.path().join("out.png");
    let first = (fs::read(&png).expect("it is written"), modified(&png));
    replace(&place.folder.path().join("scene.toml"), with_background(0.75));
    running.says("wrote out.png");
    assert_ne!(fs::read(&png).expect("it is written"), first.0);
    place.file("ink.rhai", "fn surface(");
    running.says("ink.rhai:1:");
    place.file("ink.rhai", INK);
    running.says("mended");
    running.ends_cleanly();
    // The picture is what `render` makes of the same scene.
    place.run(&["render", "scene.toml", "-o", "fresh.png", "-o", "fresh.exr", "-q"]).exits(0);
    place.run(&["compare", "out.png", "fresh.png"]).exits(0);
    place.run(&["compare", "out.exr", "fresh.exr"]).exits(0);
    let strange: Vec<_> = fs::read_dir(place.folder.path())
        .expect("it can be listed")
        .flatten()
        .filter(|entry| entry.file_name().to_string_lossy().ends_with(".part"))
        .collect();
    assert!(strange.is_empty(), "{strange:?}");
}

#[cfg(unix)]
#[test]
fn a_memory_limit_that_is_too_small_is_told() {
    let place = place();
    let running = Running::start(&place, &["watch", "scene.toml", "--cache", "1K", "--no-page"]);
    running.says("only the picture is kept, and every edit renders all of it again");
    running.says("--cache");
    running.ends_cleanly();
}

/// `TUSCHE_RELOADS=1000` makes that many reloads.
#[cfg(target_os = "linux")]
fn reloads() -> usize {
    std::env::var("TUSCHE_RELOADS").ok().and_then(|text| text.parse().ok()).unwrap_or(180)
}

#[cfg(target_os = "linux")]
#[test]
fn reloads_leave_nothing_behind() {
    let place = place();
    let running = Running::start(&place, &["watch", "scene.toml"]);
    running.says("picture of");
    let process = format!("/proc/{}", running.child.id());
    let count = |what: &str| fs::read_dir(format!("{process}/{what}")).expect("the system tells").count();
    let kibibytes = || {
        let status = fs::read_to_string(format!("{process}/status")).expect("the system tells");
        let line = status.lines().find_map(|line| line.strip_prefix("VmRSS:")).expect("memory is told");
        line.trim_end_matches("kB").trim().parse::<usize>().expect("it is a number")
    };
    let scene = place.folder.path().join("scene.toml");
    let mut found = Vec::new();
    // Each makes three: another scene, a broken script, and the script as it was.
    let rounds = reloads() / 3;
    for round in 0..rounds {
        replace(&scene, with_background(0.3 + 0.01 * (round % 60) as f32));
        running.says("picture of");
        place.file("ink.rhai", "fn surface(");
        running.says("ink.rhai:1:");
        place.file("ink.rhai", INK);
        running.says("mended");
        running.says("picture of");
        if round % (rounds / 3).max(1) == rounds / 6 {
            found.push((count("task"), count("fd"), kibibytes()));
        }
    }
    // Threads of a pool may still be on their way out.
    let [first, .., last] = found[..] else { panic!("{found:?}") };
    assert!(last.0 <= first.0 + 2 && last.1 <= first.1, "threads and open files grew: {found:?}");
    assert!(last.2 <= first.2 + first.2 / 10, "memory grew: {found:?}");
}

#[test]
fn flags_that_do_not_fit_are_refused() {
    let place = place();
    for (arguments, text) in [
        (&["--lines", "brute"][..], "--lines exact"),
        (&["--display", "screen"], "write `tev`"),
        (&["--cache", "much"], "write a number of bytes"),
        (&["--no-page", "--port", "1"], "cannot be used with"),
        (&["-o", "a.png", "-o", "./a.png"], "given twice"),
        (&["--host", "localhost"], "invalid"),
    ] {
        let all: Vec<_> = ["watch", "scene.toml"].iter().chain(arguments).copied().collect();
        place.run(&all).exits(2).says(text);
    }
    place.run(&["watch", "scene.toml", "-o", "nowhere/a.png"]).exits(1).says("there is no folder");
}

#[cfg(unix)]
#[test]
fn a_picture_file_that_the_scene_reads_is_not_overwritten() {
    let place = place();
    place.file("scene.toml", SCENE.replace("background = [0.25, 0.25, 0.25]", "background = { image = \"sky.png\" }"));
    let mut bytes = Vec::new();
    let image = image::RgbImage::from_pixel(2, 2, image::Rgb([9; 3]));
    image.write_to(&mut std::io::Cursor::new(&mut bytes), image::ImageFormat::Png).expect("PNG can be written");
    place.file("sky.png", &bytes);
    let running = Running::start(&place, &["watch", "scene.toml", "-o", "sky.png", "--no-page"]);
    running.says("the scene reads this file");
    running.ends_cleanly();
    assert_eq!(fs::read(place.folder.path().join("sky.png")).expect("it is there"), bytes);
}
