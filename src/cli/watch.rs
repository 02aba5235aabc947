//! `tusche watch`: a picture that follows its files, in a browser, a viewer and picture files.

use std::net::{IpAddr, Ipv4Addr};
use std::str::FromStr;
use std::time::Duration;

use clap::Args;

use super::args::{LineMode, SceneArguments};
use super::request::{check_outputs, scene_request};
use super::{Failure, terminal};
use crate::diag::Diagnostic;
use crate::film::check_writable;
use crate::live::{Kept, News, PageOptions, SessionOptions, TEV_ADDRESS, Watch, WatchOptions};

#[derive(Debug, Args)]
#[command(
    after_help = "Examples:\n  \
        tusche watch scene.toml                          open the address that it prints\n  \
        tusche watch scene.toml -o picture.png           write the picture after every save, too\n  \
        tusche watch model.glb --size 960x540 --samples 4 --port 8000\n  \
        tusche watch scene.toml --display tev            show it in a running tev viewer\n\n\
        Ctrl-C ends it.",
    mut_arg("output", |argument| argument.help("Writes every final picture to these files, too"))
)]
pub(super) struct WatchArguments {
    #[command(flatten)]
    pub scene: SceneArguments,
    /// Serves the page at this port; 0 is any that is free.
    #[arg(long, value_name = "N", default_value_t = 0, conflicts_with = "no_page")]
    pub port: u16,
    /// Serves the page at this address of the machine, so that others can reach it: whoever knows the page's address can
    /// change the scene file.
    #[arg(long, value_name = "IP", default_value_t = IpAddr::V4(Ipv4Addr::LOCALHOST), conflicts_with = "no_page")]
    pub host: IpAddr,
    /// Serves no page.
    #[arg(long)]
    pub no_page: bool,
    /// Shows pictures in a viewer: `tev`, or `tev=HOST:PORT` for one that listens elsewhere than at its default.
    #[arg(long, value_name = "VIEWER")]
    pub display: Option<Display>,
    /// Most memory to keep so that edits need less work, such as 500M or 2G.
    #[arg(long, value_name = "SIZE", default_value = "2G")]
    pub cache: Bytes,
    /// How many threads render [default: one for each core].
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u16).range(1..=1024))]
    pub threads: Option<u16>,
    /// Side of a tile in pixels; changes memory and speed, never the picture.
    #[arg(long, value_name = "N", default_value_t = 32, value_parser = clap::value_parser!(u32).range(1..=4096))]
    pub tile: u32,
}

/// A viewer.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct Display {
    /// `HOST:PORT`.
    address: String,
}

impl FromStr for Display {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        const HOW: &str = "write `tev`, or `tev=HOST:PORT`";
        let address = match text.split_once('=') {
            None if text == "tev" => TEV_ADDRESS,
            Some(("tev", address)) => address,
            _ => return Err(HOW.into()),
        };
        let has_port =
            address.rsplit_once(':').is_some_and(|(host, port)| !host.is_empty() && port.parse::<u16>().is_ok());
        if has_port { Ok(Self { address: address.into() }) } else { Err(HOW.into()) }
    }
}

/// A number of bytes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Bytes(u64);

impl FromStr for Bytes {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let digits = text.trim_end_matches(|c: char| c.is_ascii_alphabetic());
        let shift = match text[digits.len()..].to_ascii_uppercase().as_str() {
            "" | "B" => 0,
            "K" | "KB" | "KIB" => 10,
            "M" | "MB" | "MIB" => 20,
            "G" | "GB" | "GIB" => 30,
            _ => return Err("write a number of bytes, with K, M or G behind it if you like".into()),
        };
        let number: u64 = digits.parse().map_err(|_| format!("`{digits}` is not a whole number"))?;
        number.checked_mul(1 << shift).map(Self).ok_or_else(|| "this is too much".into())
    }
}

pub(super) fn run(arguments: &WatchArguments) -> Result<(), Failure> {
    let scene = &arguments.scene;
    if !matches!(scene.lines, LineMode::Off | LineMode::Exact) {
        return Err(Failure::Usage("`tusche watch` finds lines by `--lines exact` only, or not at all".into()));
    }
    check_outputs(scene)?;
    // Better told now than after the first picture.
    scene.output.iter().try_for_each(|path| check_writable(path))?;
    let watch = Watch::new(WatchOptions {
        scene: scene_request(scene, scene.frame)?,
        outputs: scene.output.clone(),
        layers: scene.layer.clone(),
        session: SessionOptions {
            threads: arguments.threads.map_or(0, usize::from),
            tile: arguments.tile,
            cache_bytes: arguments.cache.0,
            progressive: true,
        },
        page: (!arguments.no_page).then_some(PageOptions { host: arguments.host, port: arguments.port }),
        tev: arguments.display.as_ref().map(|display| display.address.clone()),
    })?;
    let handle = watch.handle();
    // A second handler cannot be set; there is none, so this cannot fail but for exotic systems.
    let _ = ctrlc::set_handler(move || handle.stop());
    if let Some(url) = watch.url() {
        // Said even if nothing else is: without it, nobody finds the page.
        terminal::note(&format!("the page: {url}"));
    }
    let mut talk = Talk { quiet: scene.quiet, bar: None };
    watch.run(&mut |news| talk.tell(news));
    talk.end_bar();
    Ok(())
}

/// What is said while watching.
struct Talk {
    quiet: bool,
    /// The picture under way, by its samples.
    bar: Option<(u32, terminal::Progress)>,
}

impl Talk {
    fn tell(&mut self, news: News) {
        if let News::Progress { samples, share } = news {
            return self.progress(samples, share);
        }
        self.end_bar();
        match news {
            News::Faults(faults) | News::ScriptErrors(faults) => terminal::say(&faults),
            _ if self.quiet => {}
            News::Warnings(warnings) => terminal::say(&warnings),
            News::Trouble(fault) => terminal::say(&fault.into()),
            News::Mended => terminal::note("mended"),
            News::Picture { picture, after: Some(after) } if picture.is_final => {
                let samples = picture.samples;
                let s = if samples == 1 { "" } else { "s" };
                terminal::note(&format!("picture of {samples} sample{s} per pixel in {}", time(after)));
            }
            News::Wrote(path) => terminal::note(&format!("wrote {}", path.display())),
            News::Saved(path) => terminal::note(&format!("wrote the page's edits to {}", path.display())),
            News::Note(text) => terminal::note(&text),
            News::Memory(cache) if cache.kept == Kept::All => terminal::note(&cache.to_string()),
            News::Memory(cache) => {
                let hint = "give it more with --cache, or ask for fewer pixels or samples";
                terminal::say(&Diagnostic::warning(cache.to_string()).hint(hint).into());
            }
            News::Picture { .. } | News::Loaded { .. } | News::Progress { .. } => {}
        }
    }

    fn progress(&mut self, samples: u32, share: f64) {
        if self.bar.as_ref().is_none_or(|(known, _)| *known != samples) {
            self.end_bar();
            self.bar = Some((samples, terminal::Progress::new(!self.quiet, format!("{samples} samples"))));
        }
        if let Some((_, bar)) = &self.bar {
            bar.set(share);
        }
    }

    fn end_bar(&mut self) {
        if let Some((_, bar)) = self.bar.take() {
            bar.done();
        }
    }
}

fn time(duration: Duration) -> String {
    match duration.as_secs_f64() {
        seconds if seconds < 1.0 => format!("{:.0} ms", seconds * 1e3),
        seconds => format!("{seconds:.1} s"),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn viewers_have_addresses() {
        assert_eq!("tev".parse(), Ok(Display { address: TEV_ADDRESS.into() }));
        assert_eq!("tev=studio:14158".parse(), Ok(Display { address: "studio:14158".into() }));
        for text in ["", "tev=", "tev=studio", "tev=:1", "tev=studio:99999", "other"] {
            assert!(text.parse::<Display>().is_err(), "{text}");
        }
    }

    #[test]
    fn sizes_have_units() {
        for (text, bytes) in
            [("0", 0), ("17", 17), ("3k", 3 << 10), ("500M", 500 << 20), ("2G", 2 << 30), ("1GiB", 1 << 30)]
        {
            assert_eq!(text.parse(), Ok(Bytes(bytes)), "{text}");
        }
        for text in ["", "G", "-1", "1.5G", "1T", "99999999999G"] {
            assert!(text.parse::<Bytes>().is_err(), "{text}");
        }
    }
}
