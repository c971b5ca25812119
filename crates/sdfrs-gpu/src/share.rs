//! How many rays a dispatch advances by how many steps, from what the last ones cost.
//!
//! A dispatch cannot be called back, systems give up drivers that are silent for two seconds, and a user who
//! cancels waits for its end: each aims at [`TARGET`]. Law (tests below): from any cost per evaluation the
//! dispatches settle near the target, and none is eight times as much work as one that was measured.

use std::time::Duration;

/// What a dispatch should cost.
pub const TARGET: Duration = Duration::from_millis(40);
/// Rays of the first dispatch, and evaluations of each; fewer where they would be more than so many operations.
const FIRST_RAYS: u32 = 4096;
const FIRST_STEPS: u32 = 16;
const FIRST_OPS: u64 = 1 << 26;
/// Fewest rays that share a dispatch before their steps are cut as well: what any GPU runs side by side.
const FEWEST: u32 = 1024;
/// Growth from one dispatch to the next.
const MOST_RAYS: f64 = 8.0;
const MOST_STEPS: f64 = 2.0;

/// Rays side by side, and evaluations of each.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Share {
    pub rays: u32,
    pub steps: u32,
}

/// Says what the next dispatch should do.
#[derive(Debug, Clone)]
pub struct Shares {
    rays: u32,
    steps: u32,
    /// Steps of a dispatch at most.
    most: u32,
}

impl Shares {
    /// For a field of so many operations a point: nothing can cut the first dispatch short.
    pub fn new(ops: u64) -> Self {
        let points = (FIRST_OPS / ops.max(1)).max(1);
        let rays = points.min(FIRST_RAYS.into()) as u32;
        let steps = (points / u64::from(rays)).min(FIRST_STEPS.into()) as u32;
        Self { rays, steps, most: u32::MAX }
    }

    /// Never more steps than that in a dispatch.
    pub fn at_most(self, most: u32) -> Self {
        Self { most, ..self }
    }

    /// What to do next of a list with `left` rays.
    pub fn share(&self, left: u32) -> Share {
        Share { rays: self.rays.min(left), steps: self.steps.min(self.most) }
    }

    /// A new tile: its rays take many steps at first, and few of them go on for long.
    pub fn restart(&mut self) {
        self.steps = self.steps.min(FIRST_STEPS);
    }

    /// Learns what a dispatch cost; `whole` says that it held all rays there were.
    pub fn learn(&mut self, done: Share, whole: bool, cost: Duration) {
        let room = TARGET.as_secs_f64() / cost.as_secs_f64().max(1e-6);
        if whole && room > 1.0 {
            // Rays that go on are few: more steps for each, fewer waits for the host.
            self.steps = scaled(done.steps, room.min(MOST_STEPS), 1);
            self.rays = scaled(done.rays.max(self.rays), room.min(MOST_RAYS), FEWEST);
        } else {
            let (rays, room_left) = (done.rays, room.min(MOST_RAYS));
            self.rays = scaled(rays, room_left, FEWEST.min(rays.max(1)));
            if room < 1.0 && self.rays <= FEWEST {
                self.steps = scaled(done.steps, room * f64::from(rays) / f64::from(self.rays), 1);
            }
        }
    }
}

fn scaled(n: u32, factor: f64, least: u32) -> u32 {
    // The cast saturates.
    ((f64::from(n) * factor) as u32).max(least)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Dispatches until a list of `rays` with 1,000 steps each is done, at so many seconds an evaluation.
    fn run(rays: u32, second: f64, overhead: f64) -> Vec<f64> {
        let mut shares = Shares::new((second * 1e9) as u64);
        let (mut costs, mut spent) = (Vec::new(), 0);
        while spent < 1000 && costs.len() < 4000 {
            let (mut left, mut least) = (rays, u32::MAX);
            while left > 0 {
                let share = shares.share(left);
                let steps = share.steps.min(1000 - spent);
                let cost = overhead + f64::from(share.rays) * f64::from(steps) * second;
                costs.push(cost);
                shares.learn(Share { steps, ..share }, share.rays == rays, Duration::from_secs_f64(cost));
                left -= share.rays;
                least = least.min(steps);
            }
            spent += least;
        }
        costs
    }

    #[test]
    fn dispatches_stay_short_at_any_cost() {
        // From a real GPU on a sphere to a processor on thousands of ops.
        for (rays, second) in [(1 << 20, 1e-11), (1 << 20, 1e-9), (300_000, 1e-7), (4096, 1e-6), (50, 1e-4)] {
            let costs = run(rays, second, 2e-4);
            let worst = costs.iter().copied().fold(0.0, f64::max);
            assert!(worst < 0.1 || costs[0] == worst, "{rays} rays, {second}: {worst} s");
        }
    }

    #[test]
    fn a_cheap_scene_takes_few_dispatches() {
        assert!(run(1 << 20, 1e-11, 2e-4).len() < 30, "{}", run(1 << 20, 1e-11, 2e-4).len());
    }

    #[test]
    fn the_first_dispatch_is_small() {
        assert_eq!(Shares::new(12).share(1 << 20), Share { rays: FIRST_RAYS, steps: FIRST_STEPS });
        assert_eq!(Shares::new(12).share(10).rays, 10);
        for ops in [0, 1000, 100_000, 10_000_000, u64::MAX] {
            let Share { rays, steps } = Shares::new(ops).share(1 << 20);
            let work = u128::from(rays) * u128::from(steps) * u128::from(ops);
            assert!(
                rays > 0 && steps > 0 && (rays == 1 || work <= u128::from(FIRST_OPS)),
                "{ops}: {rays} {steps}"
            );
        }
    }
}
