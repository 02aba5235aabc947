//! `tusche shader …`: one file per subcommand; this one holds what they share.

mod args;
mod bench;
mod check;
mod json;
mod new;
mod preview;
mod reference;

use std::path::Path;

use super::Failure;
use crate::diag::Diagnostics;
use crate::files::FileStore;
use crate::scene::ids::MaterialId;
use crate::scene::{Scene, SceneBuilder, file};
pub(super) use args::ShaderCommand;

pub(super) fn run(command: &ShaderCommand) -> Result<(), Failure> {
    match command {
        ShaderCommand::Check(arguments) => check::run(arguments),
        ShaderCommand::Bench(arguments) => bench::run(arguments),
        ShaderCommand::New(arguments) => new::run(arguments),
        ShaderCommand::Preview(arguments) => preview::run(arguments),
        ShaderCommand::Reference(arguments) => reference::run(arguments),
    }
}

/// A shader's file on the stage, and its material there. `set` holds `NAME=VALUE` for its parameters.
fn load(path: &Path, set: &[String]) -> Result<(Scene, MaterialId), Diagnostics> {
    let (builder, material) = load_builder(path, set)?;
    Ok((builder.build()?, material))
}

fn load_builder(path: &Path, set: &[String]) -> Result<(SceneBuilder, MaterialId), Diagnostics> {
    let mut faults = Diagnostics::default();
    let parsed = set.iter().filter_map(|text| file::Override::parse(text).map_err(|found| faults.extend(found)).ok());
    let params: Vec<_> = parsed.collect();
    if faults.has_errors() {
        return Err(faults);
    }
    let (builder, material, _) = file::load_shader(path, &FileStore::new(), &params)?;
    Ok((builder, material))
}
