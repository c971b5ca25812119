//! Numbers about a trace: counts, percentiles, the curve of rays still active.

mod summary;

pub use summary::{Summary, active_rays};
