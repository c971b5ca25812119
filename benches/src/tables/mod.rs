//! The tables of docs/performance.md, as Markdown: minima of ours over the peers', beside the bars.

pub mod eval;
#[cfg(target_arch = "x86_64")]
pub mod limits;
pub mod texture;
pub mod trace;

/// Seconds each rival gets for points.
const SECONDS: f64 = 0.4;

/// A bar, and whether a ratio is over it.
fn bar(limit: Option<f64>, ratio: f64) -> String {
    limit.map_or("".into(), |v| format!("{v:.2}{}", if ratio <= v { "" } else { " (missed)" }))
}
