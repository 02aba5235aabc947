//! What accuracy costs: measures, ladders and reports.

mod course;
mod flip;
mod ladder;
mod truth;
mod width;
