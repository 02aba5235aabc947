//! What accuracy costs: measures, ladders and reports.

mod flip;
