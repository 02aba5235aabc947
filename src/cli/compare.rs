//! `tusche compare`: how much two pictures differ.

use super::args::CompareArguments;
use super::{Failure, print};
use crate::diag::Diagnostic;
use crate::film::compare::{Comparison, compare};

pub(super) fn run(arguments: &CompareArguments) -> Result<(), Failure> {
    let comparison = compare(&arguments.expected, &arguments.actual)?;
    if arguments.json {
        let figures = serde_json::to_string_pretty(&comparison)
            .map_err(|error| Diagnostic::error(format!("cannot write the figures: {error}")))?;
        print(&(figures + "\n"))?;
    } else {
        let Comparison { rmse, psnr, largest, largest_at, differing_share, .. } = &comparison;
        let place =
            largest_at.as_ref().map_or_else(String::new, |at| format!(" ({} at {}, {})", at.channel, at.x, at.y));
        print(&format!(
            "root mean square error  {rmse:.6}\n\
             peak signal to noise    {psnr:.2} dB\n\
             largest difference      {largest:.6}{place}\n\
             pixels that differ      {:.4} %\n",
            differing_share * 100.0
        ))?;
    }
    if comparison.largest <= arguments.tolerance { Ok(()) } else { Err(Failure::Silent) }
}
