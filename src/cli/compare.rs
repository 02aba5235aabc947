//! `tusche compare`: how much two pictures differ.

use super::args::CompareArguments;
use super::{Failure, print};
use crate::film::compare::{self, Comparison};

pub(super) fn run(arguments: &CompareArguments) -> Result<(), Failure> {
    let comparison = compare::compare_files(&arguments.expected, &arguments.actual)?;
    let Comparison { rmse, psnr, largest, differing_share, .. } = comparison;
    if arguments.json {
        // JSON has no infinity: equal pictures have no PSNR.
        let finite = |x: f64| x.is_finite().then_some(x);
        let figures = serde_json::json!({
            "rmse": finite(rmse),
            "psnr": finite(psnr),
            "largest": finite(largest),
            "differing_share": differing_share,
        });
        print(&format!("{figures:#}\n"))?;
    } else {
        print(&format!(
            "root mean square error   {rmse:.6}\npeak signal to noise     {psnr:.2} dB\nlargest difference       \
             {largest:.6}\npixels that differ       {:.4} %\n",
            differing_share * 100.0
        ))?;
    }
    if largest <= arguments.tolerance { Ok(()) } else { Err(Failure::Silent) }
}
