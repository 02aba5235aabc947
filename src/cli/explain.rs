//! `tusche explain`: the plan, with reasons, and no pixels.

use super::args::{ExplainArguments, SceneArguments};
use super::request::{Request, output_paths};
use super::{Failure, print};
use crate::study::Settings;

pub(super) fn run(arguments: &ExplainArguments) -> Result<(), Failure> {
    let outputs = output_paths(&arguments.scene)?;
    let request = Request::new(&arguments.scene, arguments.scene.frame, &outputs)?;
    let mut text = request.plan.to_string();
    if let Some(quality) = arguments.scene.quality {
        // What the scene itself says is known only without the preset.
        let own = SceneArguments { quality: None, quiet: true, ..arguments.scene.clone() };
        let own = Request::new(&own, arguments.scene.frame, &outputs)?;
        text += &quality.explain(&Settings::of(&own.scene));
    }
    print(&text)
}
