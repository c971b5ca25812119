//! The median of very many, given up half way when nobody wants it any more.
//!
//! Passes over all that is left, each around a pivot from an even sample, until the standard library's selection takes
//! milliseconds. What comes out is a function of the items alone.

use std::cmp::Ordering;

use crate::{MeshError, Watch};

/// Selected without a question.
const FEW: usize = 1 << 17;
/// Items looked at for a pivot.
const SAMPLE: usize = 63;

/// Puts the `nth` item by `order`, which knows no equals, into its place, smaller ones before it and larger ones behind it.
pub fn select<T: Copy>(
    items: &mut [T],
    nth: usize,
    order: impl Fn(&T, &T) -> Ordering,
    watch: &dyn Watch,
) -> Result<(), MeshError> {
    let (mut from, mut to) = (0, items.len());
    while to - from > FEW {
        if watch.cancelled() {
            return Err(MeshError::Cancelled);
        }
        let at = from + divide(&mut items[from..to], nth - from, &order);
        match nth.cmp(&at) {
            Ordering::Less => to = at,
            Ordering::Equal => return Ok(()),
            Ordering::Greater => from = at + 1,
        }
    }
    items[from..to].select_nth_unstable_by(nth - from, order);
    Ok(())
}

/// Divides `items` around one that lies about where the `nth` does; where it went.
fn divide<T: Copy>(items: &mut [T], nth: usize, order: &impl Fn(&T, &T) -> Ordering) -> usize {
    let last = items.len() - 1;
    let mut sample: [usize; SAMPLE] = std::array::from_fn(|k| k * last / (SAMPLE - 1));
    sample.sort_unstable_by(|&a, &b| order(&items[a], &items[b]));
    items.swap(sample[nth * (SAMPLE - 1) / last], last);
    let pivot = items[last];
    let mut at = 0;
    for i in 0..last {
        // Without a branch: half of them would be guessed wrong.
        items.swap(i, at);
        at += usize::from(order(&items[at], &pivot) == Ordering::Less);
    }
    items.swap(at, last);
    at
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_nth_of_many() {
        let mut state = 1u32;
        let mut items: Vec<(u32, u32)> = (0..3 * FEW as u32)
            .map(|i| {
                state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
                (state >> 22, i)
            })
            .collect();
        let mut sorted = items.clone();
        sorted.sort_unstable();
        for nth in [0, 1, items.len() / 2, items.len() - 1] {
            assert!(select(&mut items, nth, Ord::cmp, &()).is_ok());
            assert_eq!(items[nth], sorted[nth]);
            assert!(items[..nth].iter().all(|item| *item < sorted[nth]));
        }
        struct Never;
        impl Watch for Never {
            fn cancelled(&self) -> bool {
                true
            }
        }
        assert!(matches!(select(&mut items, 5, Ord::cmp, &Never), Err(MeshError::Cancelled)));
    }
}
