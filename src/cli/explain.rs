//! `tusche explain`: the plan, with reasons, and no pixels.

use super::args::ExplainArguments;
use super::request::{Request, output_paths};
use super::{Failure, print};

pub(super) fn run(arguments: &ExplainArguments) -> Result<(), Failure> {
    let outputs = output_paths(&arguments.scene)?;
    let request = Request::new(&arguments.scene, arguments.scene.frame, &outputs)?;
    print(&request.plan.to_string())
}
