//! The arguments of `tusche shader …` as typed.

use std::path::PathBuf;

use clap::{Args, Subcommand};

use crate::cli::args::Size;

#[derive(Debug, Subcommand)]
pub enum ShaderCommand {
    /// Says what is wrong with shaders, what they read and write, and how they run.
    Check(CheckArguments),
    /// Measures what shaders cost.
    Bench(BenchArguments),
    /// Writes a commented shader to start from.
    New(NewArguments),
    /// Renders shaders on a ball and a knot.
    Preview(PreviewArguments),
    /// Prints every input, output and function that shaders know.
    Reference(ReferenceArguments),
}

/// Which shaders, with which parameters.
#[derive(Debug, Args)]
pub struct ShaderArguments {
    /// Shaders: .rhai files, or builtin:NAME.
    #[arg(value_name = "FILE", required = true)]
    pub files: Vec<PathBuf>,
    /// Changes a parameter, for example ink_width=3 or paint=[1,0,0]; may be given more than once.
    #[arg(long, value_name = "PARAM=VALUE", value_parser = setting)]
    pub set: Vec<String>,
}

fn setting(text: &str) -> Result<String, String> {
    match text.split_once('=') {
        Some((name, value)) if !name.trim().is_empty() && !value.trim().is_empty() => Ok(text.to_owned()),
        _ => Err("write it as PARAM=VALUE, for example ink_width=3".into()),
    }
}

#[derive(Debug, Args)]
#[command(after_help = "Exit codes: 0 no errors (warnings may be), 1 errors, 2 bad usage.")]
pub struct CheckArguments {
    #[command(flatten)]
    pub shaders: ShaderArguments,
    /// Prints all that was found as one JSON document, for editors.
    #[arg(long)]
    pub json: bool,
}

#[derive(Debug, Args)]
pub struct BenchArguments {
    #[command(flatten)]
    pub shaders: ShaderArguments,
    /// How many hits a batch has.
    #[arg(long, value_name = "N", default_value_t = 4096, value_parser = clap::value_parser!(u32).range(1..=1 << 20))]
    pub hits: u32,
    /// Prints the figures as JSON.
    #[arg(long)]
    pub json: bool,
}

#[derive(Debug, Args)]
#[command(after_help = "Example:\n  tusche shader preview cel.rhai -o ball.png --set ink_width=4")]
pub struct PreviewArguments {
    #[command(flatten)]
    pub shaders: ShaderArguments,
    /// Where to write the picture, .png or .exr, of a single shader [default: the shader's name with .png, in the
    /// current folder].
    #[arg(short, long, value_name = "FILE")]
    pub output: Option<PathBuf>,
    /// Size of the picture in pixels [default: 640x400].
    #[arg(long, value_name = "WxH")]
    pub size: Option<Size>,
    /// Samples per pixel [default: 16].
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=4096))]
    pub samples: Option<u32>,
    /// Says nothing but errors.
    #[arg(short, long)]
    pub quiet: bool,
}

#[derive(Debug, Args)]
pub struct NewArguments {
    /// What to call it: NAME.rhai is written, and must not be there yet. May begin with a folder.
    #[arg(value_name = "NAME")]
    pub name: String,
    /// Starts from this shader: `template`, or one that comes with Tusche.
    #[arg(long, value_name = "TEMPLATE", default_value = "template")]
    pub from: String,
}

#[derive(Debug, Args)]
pub struct ReferenceArguments {
    /// Prints Markdown, as in shaders/README.md, instead of text for a terminal.
    #[arg(long)]
    pub markdown: bool,
}
