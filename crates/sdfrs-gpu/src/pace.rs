//! How much to hand to the GPU at a time: as much as takes a few hundredths of a second, by measurement.
//!
//! Drivers kill what runs for seconds, a screen freezes meanwhile, and nothing on its way can be
//! cancelled. Twin: the CPU's tiles.

use std::time::Duration;

/// What a submission should take.
const TARGET: Duration = Duration::from_millis(30);

/// A batch size that follows the measured cost.
#[derive(Debug, Clone)]
pub struct Pace {
    size: u64,
    least: u64,
    most: u64,
}

impl Pace {
    /// Between `least` and `most` units of work; starts with `least`.
    pub fn new(least: u64, most: u64) -> Self {
        let least = least.max(1);
        Self { size: least, least, most: most.max(least) }
    }

    pub fn size(&self) -> u64 {
        self.size
    }

    /// Learns from `done` units that took `time`; grows fourfold at most, since costs differ from place to place.
    pub fn learn(&mut self, done: u64, time: Duration) {
        let nanos = time.as_nanos().max(1_000);
        let fits = (u128::from(done) * TARGET.as_nanos() / nanos) as u64;
        self.size = fits.clamp(self.least, self.most).min(self.size.saturating_mul(4));
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn it_grows_while_cheap_and_shrinks_at_once() {
        let mut pace = Pace::new(1000, 1_000_000);
        pace.learn(1000, Duration::from_millis(1));
        assert_eq!(pace.size(), 4000);
        for _ in 0..9 {
            pace.learn(pace.size(), Duration::from_micros(10));
        }
        assert_eq!(pace.size(), 1_000_000);
        pace.learn(1_000_000, Duration::from_secs(3));
        assert_eq!(pace.size(), 10_000);
        pace.learn(10_000, Duration::from_secs(600));
        assert_eq!(pace.size(), 1000);
    }
}
